# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Decide what to do about a brick, from where it is and where the robot is.

`Sight` is what is seen at one instant, `transition` the state machine, `Progress` its state with
what is kept in mind: all three are values. `Catcher` has the present ones and returns what to
publish. No clock is read here: instants are passed in, in integer nanoseconds of one clock.
"""

from enum import Enum
from math import cos, dist, hypot, inf, pi
from typing import NamedTuple

from turtle_brick.core.fall_detection import Fall, FallDetector
from turtle_brick.core.geometry import MAX_COORDINATE, Vector
from turtle_brick.core.latency import Latency
from turtle_brick.core.parameters import CatcherParameters
from turtle_brick.core.reachability import (Decision, LEVEL_LATENCY, reach, resting_height,
                                            RobotMotion, ROUNDING, Track)
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, within_arena

PERIOD = 0.02
"""Time (s) between two updates; a brick that begins to fall brings one more."""

CENTER = (ARENA_CENTER, ARENA_CENTER)
"""Center of the arena in the world (m), where bricks are carried."""

RAMP = 0.5
"""Time (s) in which the platform is tilted or leveled."""

PATIENCE = 10.0
"""Time (s) after which the robot gives up tipping off a brick that does not slide."""

SETTLED = 0.05
"""Time (s) without motion after which a brick beside the tilted platform counts as floating, and
one that did not follow the robot as hovering."""

LAG = 0.5
"""Longest time (s) for which a brick on the moving or tilted platform may seem to stand still: on
a busy machine the arena learns late where the platform is."""

LYING = 1.0
"""Time (s) for which a brick lies on the level platform of a robot at rest before it is carried
off."""

CLOCK_DIFFERENCE = 0.5
"""Largest difference (s) between a falling brick's stamp and the present for a decision: more
means that only one of two nodes knows yet that the clock was set."""

LAST_WORD = 0.1
"""Time (s) before the contact at which a decision no longer waits for the robot to be seen."""

OUT_OF_SIGHT = 1.0
"""Time (s) for which the robot may be out of sight, as on a busy machine, before a catch is given
up."""

AT_GOAL = 0.02
"""Distance (m) from its goal at which a robot at rest has arrived."""

ON_PLATFORM = 0.01
"""How far (m) from its resting height a brick may be and still count as on the platform."""

APART = 0.1
"""Longest time (s) between the transforms of brick and robot that are seen together: so long the
robot may have driven on, at full speed, from where it was under the brick."""


class State(Enum):
    """What the catcher is doing."""

    WAITING = 'waiting for a brick to fall'
    APPROACHING = 'driving under the brick'
    CARRYING = 'carrying the brick to the center'
    TILTING = 'tilting the brick off'
    LEVELING = 'leveling the platform'


UNDER_WAY = (State.APPROACHING, State.CARRYING)
"""The states in which the robot drives to a goal."""


class Brick(NamedTuple):
    """Where the brick was seen last."""

    position: Vector = (inf, inf, inf)
    """Position of its center in the world (m); infinity until it is seen."""
    seen: int = 0
    """When it was seen last (ns)."""
    moved: int = 0
    """When it moved last (ns)."""
    parent: str = ''
    """The frame in which it is broadcast; a change of it counts as a motion."""

    def observe(self, stamp: int, position: Vector, parent: str) -> 'Brick':
        """Return the brick once it has been seen at an instant (ns)."""
        if (stamp < self.seen or parent != self.parent
                or dist(position, self.position) > ROUNDING):
            return Brick(position, stamp, stamp, parent)
        return Brick(self.position, stamp, self.moved, parent)


class Sight(NamedTuple):
    """What is seen at one instant, and what that says about the brick."""

    parameters: CatcherParameters
    now: int
    """The instant (ns)."""
    brick: Brick
    in_free_fall: bool
    """Whether the brick moves as in a free fall."""
    decision: bool | None
    """Whether a brick that has just begun to fall can be caught; None if none has."""
    robot: RobotMotion | None
    """The robot, None if it is out of sight."""
    platform: Platform | None
    """The platform, None if it is out of sight."""
    robot_seen: float
    """When the robot was in sight last (ns)."""
    robot_unseen: int
    """When it was out of sight last (ns)."""
    level_seen: int
    """When the platform was seen level last (ns)."""
    level_ordered: bool
    """Whether the platform was ordered to be level."""

    @property
    def blind(self) -> bool:
        """Whether the robot has been out of sight, but for less than OUT_OF_SIGHT."""
        return self.robot is None and (self.now - self.robot_seen) * SECONDS_PER_NS < OUT_OF_SIGHT

    @property
    def still_since(self) -> int:
        """Since when the brick is known not to move (ns): it may, with a robot out of sight."""
        return max(self.brick.moved, self.robot_unseen)

    @property
    def still(self) -> float:
        """Time (s) for which it has been seen not to move."""
        return (self.brick.seen - self.still_since) * SECONDS_PER_NS

    @property
    def falling(self) -> bool:
        """Whether the brick falls and is still above the platform."""
        height = resting_height(self.parameters)
        return self.in_free_fall and self.brick.position[2] > height - ON_PLATFORM

    @property
    def at_resting_height(self) -> bool:
        """Whether the brick is as high as on the level platform, and does not fall."""
        height = resting_height(self.parameters)
        return not self.in_free_fall and abs(self.brick.position[2] - height) <= ON_PLATFORM

    @property
    def on_platform(self) -> bool:
        """Whether the brick is where it would be on the level platform."""
        near = self.parameters.platform_radius + self.parameters.max_velocity * APART
        return (self.at_resting_height and self.robot is not None
                and self.robot.distance_to(self.brick.position) <= near)

    @property
    def following(self) -> bool:
        """Whether the brick is at that height and has moved within LAG."""
        return self.at_resting_height and self.robot is not None and self.still < LAG

    @property
    def lying(self) -> bool:
        """Whether the brick has lain on the level platform of the robot at rest for LYING."""
        near = self.parameters.platform_radius + ON_PLATFORM
        return (self.at_resting_height and self.still >= LYING
                and self.robot is not None and self.robot.at_rest and self.robot.level
                and self.robot.distance_to(self.brick.position) <= near)

    @property
    def off_platform(self) -> bool:
        """Whether the brick has left the tilted platform: it does not move any more."""
        if self.platform is None:
            return True
        still = (self.brick.seen - max(self.still_since, self.level_seen)) * SECONDS_PER_NS
        beside = (hypot(*self.platform.coordinates_of(self.brick.position))
                  > self.parameters.platform_radius)
        return still >= (SETTLED if beside else LAG)

    def arrived_at(self, goal: tuple[float, float]) -> bool:
        """Tell whether the robot is at rest at a point of the world (m)."""
        return (self.robot is not None and self.robot.at_rest
                and self.robot.distance_to(goal) <= AT_GOAL)


class Progress(NamedTuple):
    """The state, and what is kept in mind from one instant to the next."""

    state: State = State.WAITING
    since: int = 0
    """When the state began (ns)."""
    carrying_since: int = 0
    """When CARRYING began last (ns)."""
    left_behind: int | None = None
    """When a brick had moved last (ns) that stayed behind when it was to be carried or tipped
    off."""

    def enter(self, state: State, sight: Sight) -> 'Progress':
        """Return the progress once a state has been entered."""
        carrying_since, left_behind = self.carrying_since, self.left_behind
        if state is State.CARRYING:
            carrying_since = sight.now
        elif (state is State.LEVELING and self.state in (State.CARRYING, State.TILTING)
                and sight.robot is not None and sight.still_since <= carrying_since
                and (sight.brick.seen - carrying_since) * SECONDS_PER_NS >= SETTLED):
            left_behind = sight.brick.moved
        return Progress(state, sight.now, carrying_since, left_behind)

    def hovers(self, brick: Brick) -> bool:
        """Tell whether the brick stayed behind, and has not moved since."""
        return brick.moved == self.left_behind


def transition(progress: Progress, seen: Sight) -> State:
    """Return the next state, often the same."""
    state = progress.state
    if seen.decision:
        return State.APPROACHING
    if seen.blind and state is not State.LEVELING:
        return state
    if state is State.APPROACHING:
        if seen.on_platform:
            return State.CARRYING
        if not seen.falling:
            return State.LEVELING
    elif state is State.CARRYING:
        if not (seen.on_platform or seen.following):
            return State.LEVELING
        if seen.arrived_at(CENTER):
            return State.TILTING
    elif state is State.TILTING:
        if seen.off_platform or (seen.now - progress.since) * SECONDS_PER_NS > PATIENCE:
            return State.LEVELING
    elif state is State.LEVELING:
        if seen.level_ordered:
            return State.WAITING
    elif seen.lying and not progress.hovers(seen.brick):
        # Placed there, caught although it was called unreachable, or left there by a catcher that
        # was interrupted.
        return State.CARRYING
    return state


class DriveOrder(NamedTuple):
    """Drive to a point of the world (m)."""

    x: float
    y: float


class TiltOrder(NamedTuple):
    """Set the platform's angle (rad)."""

    angle: float


Action = Decision | DriveOrder | TiltOrder
"""What the node is to publish or log."""


class Ramp:
    """The platform's angle, which changes smoothly."""

    def __init__(self) -> None:
        """Begin level."""
        self.angle = 0.0
        """The angle ordered last (rad)."""
        self._from = 0.0
        self._begun = 0
        self._ordered = 0

    def begin(self, now: int) -> None:
        """Begin a change at an instant (ns)."""
        self._from, self._begun = self.angle, now

    def move(self, now: int, goal: float) -> bool:
        """
        Set the angle for an instant.

        :param now: the instant (ns)
        :param goal: the angle (rad) RAMP after the beginning of the change
        :return: Whether the angle has changed.
        """
        if self.angle == goal:
            return False
        part = min((now - self._begun) * SECONDS_PER_NS / RAMP, 1.0)
        smooth = 0.5 - 0.5 * cos(pi * part)
        self.angle = goal if part == 1.0 else self._from + smooth * (goal - self._from)
        self._ordered = now
        return True

    def level(self, now: int) -> None:
        """Set the angle to zero at once."""
        self.angle, self._ordered = 0.0, now

    def ordered_for(self, now: int) -> float:
        """Return how long (s) before an instant (ns) the angle was ordered."""
        return (now - self._ordered) * SECONDS_PER_NS


class Catcher:
    """Catch every brick that can be caught, carry it to the center and tip it off."""

    def __init__(self, parameters: CatcherParameters) -> None:
        """Wait for a brick to fall."""
        self.parameters = parameters
        self._start_afresh(0)

    def _start_afresh(self, now: int) -> None:
        """Know nothing at an instant (ns) but that the platform is ordered to be level."""
        self.progress = Progress()
        self.decision: Decision | None = None
        """The last one."""
        self._now = now
        """The last instant (ns)."""
        self._brick = Brick()
        self._detector = FallDetector(self.parameters.gravity_accel)
        self._is_refused = False
        """Whether the brick was called unreachable, and has only gone straight down since."""
        self._overlooked: Fall | None = None
        """A fall past the platform that was over before anything could be decided."""
        self.latency = Latency()
        """How long messages and orders take here."""
        self._track = Track(self.parameters.max_velocity, self.latency)
        self._ramp = Ramp()
        self._ramp.level(now)

    @property
    def state(self) -> State:
        """Return what it is doing."""
        return self.progress.state

    def see_brick(self, stamp: int, position: Vector, parent: str = 'world') -> bool:
        """
        Note where the brick is.

        :param stamp: instant at which it was there (ns)
        :param position: of its center in the world (m); ignored beyond MAX_COORDINATE
        :param parent: the frame in which it is broadcast; a change of it counts as a motion
        :return: Whether it has just begun to fall: then `update` should be called at once.
        """
        x, y, z = position
        if not abs(x) + abs(y) + abs(z) <= MAX_COORDINATE:
            return False
        self.latency.see_brick(stamp)
        x_before, y_before, z_before = self._brick.position
        if z > z_before + ROUNDING or x != x_before or y != y_before:
            self._is_refused = False
        self._brick = self._brick.observe(stamp, position, parent)
        fall = self._detector.fall
        has_begun = self._detector.observe(stamp, x, y, z)
        if (fall is not None is self._detector.fall and not self._is_decided(fall)
                and z < resting_height(self.parameters) - ON_PLATFORM):
            self._overlooked = fall
        return has_begun

    def update(self, now: int, platform: Platform | None) -> list[Action]:
        """
        Decide what to do now; to be called 50 times per second or more.

        :param now: the present instant (ns). One before the last means that the clock was set
            back: the catcher starts afresh, waiting and level.
        :param platform: the platform, None if it is out of sight
        :return: What to publish, in order.
        """
        actions: list[Action] = []
        if now < self._now:
            self._start_afresh(now)
            actions.append(TiltOrder(0.0))
        self._now = now
        track, ramp = self._track, self._ramp
        robot = track.observe(
            now, platform, ramp.ordered_for(now) if ramp.angle == 0.0 else 0.0)
        decision = self._decide(robot)
        if decision is not None:
            self.decision = decision
            self._is_refused = not decision.reachable
            actions.append(decision)
        catchable = None if decision is None else decision.reachable
        sight = Sight(self.parameters, now, self._brick, self._detector.fall is not None,
                      catchable, robot, platform, track.seen, track.unseen, track.level_seen,
                      level_ordered=ramp.angle == 0.0)
        before = self.progress
        state = transition(before, sight)
        if catchable or state is not before.state:
            self.progress = before.enter(state, sight)
            ramp.begin(now)
        goal = self._new_goal(before.state, sight)
        if goal is not None:
            track.order(now, goal)
            actions.append(DriveOrder(*goal))
        elif track.lost(now):
            actions.append(DriveOrder(*track.goal))
        if catchable:
            ramp.level(now)
            actions.append(TiltOrder(0.0))
        if (ramp.move(now, self.parameters.tilt_angle if state is State.TILTING else 0.0)
                or self.latency.loses(now)
                and ramp.ordered_for(now) < LEVEL_LATENCY + track.excess):
            actions.append(TiltOrder(ramp.angle))
        return actions

    def _is_decided(self, fall: Fall) -> bool:
        """Tell whether a fall was decided: a refused one once, also where its clock jumps."""
        return self._is_refused or self.decision is not None and self.decision.fall is fall

    def _decide(self, robot: RobotMotion | None) -> Decision | None:
        """Return the decision about a new fall, None if there is none or it has to wait."""
        fall, now, parameters = self._detector.fall, self._now, self.parameters
        if self._overlooked is not None:
            overlooked, self._overlooked = self._overlooked, None
            decision = reach(overlooked, now, robot, parameters, self._track.excess)
            return decision._replace(reachable=False, reason=(
                f'the fall was detected {-decision.available:.3f} s after the brick had landed'))
        if (fall is None or self._is_decided(fall)
                or abs(now - self._brick.seen) * SECONDS_PER_NS > CLOCK_DIFFERENCE):
            return None
        excess = self._track.excess
        available = reach(fall, now, robot, parameters, excess).available
        excess += self.latency.standstill(now, available)
        decision = reach(fall, now, robot, parameters, excess)
        # A robot that is not seen, or not for long enough, may turn out to be near and at rest.
        hoped_for = RobotMotion(fall.x, fall.y) if robot is None else robot._replace(reserve=0.0)
        if (not decision.reachable and decision.available > LAST_WORD
                and reach(fall, now, hoped_for, parameters, excess).reachable):
            return None
        return decision

    def _new_goal(self, before: State, sight: Sight) -> tuple[float, float] | None:
        """
        Return where the robot is to be sent now.

        :param before: the state before the present one
        :param sight: what is seen
        :return: A point of the world (m), None if it is sent nowhere.
        """
        robot, state = sight.robot, self.state
        if self.decision is not None and sight.decision:
            return self.decision.fall.position[:2]
        if state is State.CARRYING is not before:
            return CENTER
        if robot is None:
            return None
        if state is State.LEVELING and before in UNDER_WAY:
            # The brick is gone: return under it if it hovers, or stop where the commands on their
            # way lead.
            if self.progress.hovers(sight.brick):
                return within_arena(*sight.brick.position[:2])
            return within_arena(*(robot.bound_for[0] if robot.bound_for else (robot.x, robot.y)))
        if state in UNDER_WAY and robot.at_rest and not sight.arrived_at(self._track.goal):
            # The order was lost, or somebody else has sent the robot elsewhere.
            return self._track.goal
        return None
