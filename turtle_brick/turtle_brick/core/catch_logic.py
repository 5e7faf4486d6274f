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

`transition` is the state machine; `Catcher` makes its observations, with `falling` and `reaching`,
and returns what to publish. No clock is read here: instants come with the observations, in integer
nanoseconds of one clock.
"""

from enum import Enum
from math import cos, dist, hypot, inf, pi
from typing import NamedTuple

from turtle_brick.core.driving import within_arena
from turtle_brick.core.fall_detection import FallDetector
from turtle_brick.core.geometry import FARTHEST, Vector
from turtle_brick.core.parameters import CatcherParameters
from turtle_brick.core.platform import Platform
from turtle_brick.core.reachability import (Decision, LEVEL_LATENCY, reach, resting_height,
                                            RobotMotion, ROUNDING, Track)
from turtle_brick.core.time_steps import NANO
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER

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


class State(Enum):
    """What the catcher is doing."""

    WAITING = 'waiting for a brick to fall'
    APPROACHING = 'driving under the brick'
    CARRYING = 'carrying the brick to the center'
    TILTING = 'tilting the brick off'
    LEVELING = 'leveling the platform'


class Observation(NamedTuple):
    """What the next state depends on."""

    decision: bool | None = None
    """Whether a brick that has just begun to fall can be caught; None if none has."""
    falling: bool = False
    """Whether the brick falls and is still above the platform."""
    on_platform: bool = False
    """Whether the brick lies on the level platform."""
    at_center: bool = False
    """Whether the robot is at rest in the center of the arena."""
    off_platform: bool = False
    """Whether the brick has left the tilted platform."""
    out_of_patience: bool = False
    """Whether the present state has lasted for PATIENCE."""
    level: bool = True
    """Whether the platform was ordered to be level."""
    lying: bool = False
    """Whether the brick has lain on the level platform of the robot at rest for LYING."""
    blind: bool = False
    """Whether the robot has been out of sight, but for less than OUT_OF_SIGHT."""


def transition(state: State, seen: Observation) -> State:
    """
    Return the next state, often the same.

    :param state: the present state
    :param seen: what is seen in it
    """
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
        if not seen.on_platform:
            return State.LEVELING
        if seen.at_center:
            return State.TILTING
    elif state is State.TILTING:
        if seen.off_platform or seen.out_of_patience:
            return State.LEVELING
    elif state is State.LEVELING:
        if seen.level:
            return State.WAITING
    elif seen.lying:
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
        part = min((now - self._begun) * NANO / RAMP, 1.0)
        smooth = 0.5 - 0.5 * cos(pi * part)
        self.angle = goal if part == 1.0 else self._from + smooth * (goal - self._from)
        self._ordered = now
        return True

    def level(self, now: int) -> None:
        """Set the angle to zero at once."""
        self.angle, self._ordered = 0.0, now

    def is_level(self, now: int) -> bool:
        """Tell whether level was ordered so long before an instant (ns) that all others see it."""
        return self.angle == 0.0 and (now - self._ordered) * NANO > LEVEL_LATENCY

    def restart(self, now: int) -> None:
        """Go on at an instant (ns) before the last one, since the clock was set back."""
        self._from, self._begun, self._ordered = self.angle, now, now


class Brick:
    """Where the brick was seen last."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self.position: Vector = (inf, inf, inf)
        """Position in the world (m); infinity until it is seen."""
        self.seen = 0
        """When it was seen last (ns)."""
        self.moved = 0
        """When it moved last (ns)."""
        self._parent = ''

    def observe(self, stamp: int, position: Vector, parent: str) -> bool:
        """
        Note where it is.

        :param stamp: instant at which it was there (ns)
        :param position: of its center in the world (m)
        :param parent: the frame in which it is broadcast; a change of it counts as a motion
        :return: Whether it has moved.
        """
        moves = (stamp < self.seen or parent != self._parent
                 or position != self.position and dist(position, self.position) > ROUNDING)
        if moves:
            self.position, self._parent, self.moved = position, parent, stamp
        self.seen = stamp
        return moves

    @property
    def still(self) -> float:
        """Time (s) from its last motion to when it was seen last."""
        return (self.seen - self.moved) * NANO


class Catcher:
    """Catch every brick that can be caught, carry it to the center and tip it off."""

    def __init__(self, parameters: CatcherParameters) -> None:
        """
        Wait for a brick to fall.

        :param parameters: the physical numbers of robot, brick and world
        """
        self.parameters = parameters
        self.state = State.WAITING
        self.decision: Decision | None = None
        """The last one."""
        self._now = 0
        """The last instant (ns)."""
        self._detector = FallDetector(parameters.gravity_accel)
        self._undecided = False
        """Whether there is a fall without a decision."""
        self._brick = Brick()
        self._hovers = False
        """Whether the brick stayed behind when it was to be carried or tipped off."""
        self._track = Track(parameters.max_velocity)
        self._ramp = Ramp()
        self._since = 0
        """When the present state began (ns)."""
        self._carrying_since = 0
        """When CARRYING began last (ns)."""

    def see_brick(self, stamp: int, position: Vector, parent: str = 'world') -> bool:
        """
        Note where the brick is.

        :param stamp: instant at which it was there (ns)
        :param position: of its center in the world (m); ignored beyond FARTHEST
        :param parent: the frame in which it is broadcast; a change of it counts as a motion
        :return: Whether it has just begun to fall: then `update` should be called at once.
        """
        x, y, z = position
        if not abs(x) + abs(y) + abs(z) <= FARTHEST:
            return False
        if self._brick.observe(stamp, position, parent):
            self._hovers = False
        if self._detector.observe(stamp, x, y, z):
            self._undecided = True
            return True
        return False

    def update(self, now: int, platform: Platform | None) -> list[Action]:
        """
        Decide what to do now; to be called 50 times per second or more.

        :param now: the present instant (ns), before the last one if the clock was set back
        :param platform: the platform, None if it is not known
        :return: What to publish, in order.
        """
        if now < self._now:
            self._start_afresh(now)
        self._now = now
        robot = self._track.observe(now, platform, self._ramp.is_level(now))
        decision = self._decide(now, robot)
        lying = self.state is State.WAITING and self._is_lying(robot)
        actions: list[Action] = []
        if self.state is State.WAITING and decision is None and not lying:
            return actions
        blind = robot is None and (now - self._track.seen) * NANO < OUT_OF_SIGHT
        if blind:
            self._brick.moved = self._brick.seen  # Unseen, it may have moved with the robot.
        if decision is not None:
            self.decision = decision
            actions.append(decision)
        fall = decision.fall if decision is not None and decision.reachable else None
        resting = robot if robot is not None and robot.at_rest else None
        state = transition(self.state, Observation(
            decision=None if decision is None else decision.reachable,
            falling=self._is_falling(),
            on_platform=self._is_on_platform(robot),
            at_center=resting is not None and _distance(resting, CENTER) <= AT_GOAL,
            off_platform=self._is_off_platform(platform),
            out_of_patience=(now - self._since) * NANO > PATIENCE,
            level=self._ramp.angle == 0.0,
            lying=lying,
            blind=blind))
        if fall is not None or state is not self.state:
            self._since = now
            self._ramp.begin(now)
            if fall is not None:
                self._ramp.level(now)
                actions += [self._drive(now, (fall.x, fall.y)), TiltOrder(0.0)]
            else:
                actions += self._enter(state, now, robot)
            self.state = state
        elif resting is not None and state in (State.APPROACHING, State.CARRYING):
            goal = self._track.goal
            if _distance(resting, goal) > AT_GOAL:
                # The order was lost, or somebody else has sent the robot elsewhere.
                actions.append(self._drive(now, goal))
        if self._ramp.move(
                now, self.parameters.tilt_angle if self.state is State.TILTING else 0.0):
            actions.append(TiltOrder(self._ramp.angle))
        return actions

    def _start_afresh(self, now: int) -> None:
        """Go on at an instant (ns) before the last one, since the clock was set back."""
        self._track.restart(now)
        self._ramp.restart(now)
        self._brick.seen = self._brick.moved = self._since = self._carrying_since = now

    def _decide(self, now: int, robot: RobotMotion | None) -> Decision | None:
        """Return the decision about a new fall, None if there is none or it has to wait."""
        fall = self._detector.fall
        if fall is None:
            self._undecided = False
            return None
        if not self._undecided or abs(now - self._brick.seen) * NANO > CLOCK_DIFFERENCE:
            return None
        decision = reach(fall, now, robot, self.parameters)
        # A robot that is not seen, or not for long enough, may turn out to be near and at rest.
        hoped_for = RobotMotion(fall.x, fall.y) if robot is None else robot._replace(reserve=0.0)
        if (not decision.reachable and decision.available > LAST_WORD
                and reach(fall, now, hoped_for, self.parameters).reachable):
            return None
        self._undecided = False
        return decision

    def _drive(self, now: int, goal: tuple[float, float]) -> DriveOrder:
        """Send the robot to a point of the world (m) at an instant (ns)."""
        self._track.order(now, goal)
        return DriveOrder(*goal)

    def _enter(self, state: State, now: int, robot: RobotMotion | None) -> list[Action]:
        """Return what to do on entering a state other than APPROACHING."""
        if state is State.CARRYING:
            self._carrying_since = now
            return [self._drive(now, CENTER)]
        if state is State.LEVELING and robot is not None:
            # A brick that did not move while the robot drove and tilted hovers.
            since = self._carrying_since
            self._hovers = (self.state in (State.CARRYING, State.TILTING)
                            and self._brick.moved <= since
                            and (self._brick.seen - since) * NANO >= SETTLED)
            if self._hovers and self.state is State.CARRYING:
                return [self._drive(now, within_arena(*self._brick.position[:2]))]
            if self.state in (State.APPROACHING, State.CARRYING):
                # The brick is gone: stop where the commands on their way lead.
                stop = robot.bound_for[0] if robot.bound_for else (robot.x, robot.y)
                return [self._drive(now, within_arena(*stop))]
        return []

    def _is_falling(self) -> bool:
        """Tell whether the brick falls and is still above the platform."""
        return (self._detector.fall is not None
                and self._brick.position[2] > resting_height(self.parameters) - ON_PLATFORM)

    def _is_at_rest_height(self) -> bool:
        """Tell whether the brick is as high as on the level platform and does not fall."""
        return (self._detector.fall is None
                and abs(self._brick.position[2] - resting_height(self.parameters)) <= ON_PLATFORM)

    def _is_on_platform(self, robot: RobotMotion | None) -> bool:
        """Tell whether the brick lies on the level platform."""
        if robot is None or not self._is_at_rest_height():
            return False
        if self.state is State.CARRYING and self._brick.still < LAG:
            return True
        # The transforms of brick and robot are some ms apart, and the robot moves meanwhile.
        near = self.parameters.platform_radius + self.parameters.max_velocity * 0.1
        return _distance(robot, self._brick.position) <= near

    def _is_lying(self, robot: RobotMotion | None) -> bool:
        """Tell whether the brick has lain on the level platform of a robot at rest for LYING."""
        if (self._hovers or self._brick.still < LYING
                or robot is None or not self._is_at_rest_height()):
            return False
        near = self.parameters.platform_radius + ON_PLATFORM
        return robot.at_rest and robot.level and _distance(robot, self._brick.position) <= near

    def _is_off_platform(self, platform: Platform | None) -> bool:
        """Tell whether the brick has left the tilted platform: it does not move any more."""
        brick = self._brick
        if platform is None:
            return True
        # Up to when it was seen last: out of sight it may move.
        still = (brick.seen - max(brick.moved, self._track.level_seen)) * NANO
        beside = hypot(*platform.place_of(brick.position)) > self.parameters.platform_radius
        return still >= (SETTLED if beside else LAG)


def _distance(robot: RobotMotion, place: tuple[float, ...]) -> float:
    """Return the horizontal distance (m) of the robot from a place in the world."""
    return hypot(robot.x - place[0], robot.y - place[1])
