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
Decide what to do about a brick, from nothing but where it is and where the robot is.

`transition` is the state machine; `Catcher` feeds it with what `falling` and `reaching` tell, and
says what to publish. No clock is read here and nothing is known of how the brick is moved:
instants come with the observations, in integer nanoseconds of one clock.
"""

from enum import Enum
from math import cos
from math import dist
from math import hypot
from math import inf
from math import pi
from typing import NamedTuple

from turtle_brick.driving import within_arena
from turtle_brick.falling import FallDetector
from turtle_brick.geometry import axes
from turtle_brick.geometry import FARTHEST
from turtle_brick.geometry import Pose
from turtle_brick.geometry import Vector
from turtle_brick.parameters import Parameters
from turtle_brick.reaching import Decision
from turtle_brick.reaching import LEVEL_LATENCY
from turtle_brick.reaching import reach
from turtle_brick.reaching import resting_height
from turtle_brick.reaching import Robot
from turtle_brick.reaching import ROUNDING
from turtle_brick.reaching import Track
from turtle_brick.step_clock import NANO
from turtle_brick.turtlesim_kinematics import ARENA_CENTER

PERIOD = 0.02
"""Time (s) between two looks at what the robot does; the brick is looked at when it moves."""

CENTER = (ARENA_CENTER, ARENA_CENTER)
"""Center of the arena in the world (m), where the brick is carried to."""

RAMP = 0.5
"""Time (s) in which the platform is tilted and levelled."""

PATIENCE = 10.0
"""Time (s) for which the robot tries to get rid of a brick that does not slide."""

SETTLED = 0.05
"""Time (s) after which a brick beside the tilted platform that has not moved floats: it slides
until its trailing edge has cleared."""

LAG = 0.5
"""How far (s) behind the robot the brick that it carries may come: on a busy machine the arena
moves it with where the platform was. Only a brick that has not moved for so long is left behind,
and only for so long may one that is still on the tilted platform stand still."""

LYING = 1.0
"""Time (s) for which a brick lies on the level platform of a robot at rest before it is carried
off, wherever it has come from."""

CLOCK_DIFFERENCE = 0.5
"""How far (s) the stamp of a brick that begins to fall may be from the present: in between, the
clocks of the two nodes have not both been set yet."""

LAST_WORD = 0.1
"""How long (s) before a brick is down it is decided about, if the robot has not come in sight."""

OUT_OF_SIGHT = 1.0
"""Time (s) for which a robot may be out of sight, as on a machine that stands still, before what
was to be caught or carried is given up."""

ARRIVED = 0.02
"""Distance (m) from where it was sent at which the robot, at rest, is there, and may tilt."""

ON_PLATFORM = 0.01
"""How far (m) from its resting height a brick may be and still count as lying there."""


class State(Enum):
    """What the catcher is doing."""

    WAITING = 'waiting for a brick to fall'
    APPROACHING = 'driving under the brick'
    CARRYING = 'carrying the brick to the center'
    TILTING = 'tilting the brick off'
    LEVELLING = 'levelling the platform'


class Observation(NamedTuple):
    """What matters for the next state."""

    decision: bool | None = None
    """Whether a brick that has just begun to fall can be caught; None: none has."""
    falling: bool = False
    on_platform: bool = False
    at_center: bool = False
    off_platform: bool = False
    """The brick has left the tilted platform, whichever way."""
    out_of_patience: bool = False
    level: bool = True
    lying: bool = False
    """The brick has lain on the level platform of the robot at rest for a while."""
    blind: bool = False
    """The robot has just got out of sight: what becomes of the brick on it can't be told."""


def transition(state: State, seen: Observation) -> State:
    """
    Return the state that follows.

    :param state: the present state
    :param seen: what is seen in it
    :return: The next state, often the same.
    """
    if seen.decision:
        return State.APPROACHING
    if seen.blind and state is not State.LEVELLING:
        return state
    if state is State.APPROACHING:
        if seen.on_platform:
            return State.CARRYING
        if not seen.falling:
            return State.LEVELLING
    elif state is State.CARRYING:
        if not seen.on_platform:
            return State.LEVELLING
        if seen.at_center:
            return State.TILTING
    elif state is State.TILTING:
        if seen.off_platform or seen.out_of_patience:
            return State.LEVELLING
    elif state is State.LEVELLING:
        if seen.level:
            return State.WAITING
    elif seen.lying:
        # Placed there, called unreachable and caught all the same, or left over from somebody
        # who was interrupted.
        return State.CARRYING
    return state


class Drive(NamedTuple):
    """Drive to a point of the world (m)."""

    x: float
    y: float


class Tilt(NamedTuple):
    """Set the platform's angle (rad)."""

    angle: float


Action = Decision | Drive | Tilt
"""What the catcher does; a Decision is told to everyone, above all that a brick is unreachable."""


class Ramp:
    """The angle of the platform, which changes smoothly."""

    def __init__(self) -> None:
        """Begin level."""
        self.angle = 0.0
        """The angle (rad) that was ordered last."""
        self._from = 0.0
        self._begun = 0
        self._ordered = 0

    def begin(self, now: int) -> None:
        """Begin a change at an instant (ns)."""
        self._from, self._begun = self.angle, now

    def move(self, now: int, goal: float) -> bool:
        """
        Change the angle as far as it is to be at an instant.

        :param now: the instant (ns)
        :param goal: the angle (rad) that it is to have RAMP after the change has begun
        :return: whether the angle is another now
        """
        if self.angle == goal:
            return False
        part = min((now - self._begun) * NANO / RAMP, 1.0)
        smooth = 0.5 - 0.5 * cos(pi * part)
        self.angle = goal if part == 1.0 else self._from + smooth * (goal - self._from)
        self._ordered = now
        return True

    def level(self, now: int) -> None:
        """Be level at once."""
        self.angle, self._ordered = 0.0, now

    def is_level(self, now: int) -> bool:
        """Tell whether everyone sees at an instant (ns) that level was ordered."""
        return self.angle == 0.0 and (now - self._ordered) * NANO > LEVEL_LATENCY

    def restart(self, now: int) -> None:
        """Begin all times at an instant (ns) before those that are known."""
        self._from, self._begun, self._ordered = self.angle, now, now


class Brick:
    """Where the brick was seen."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self.position: Vector = (inf, inf, inf)
        """In the world (m); far away until it is seen."""
        self.seen = 0
        """When it was seen last (ns)."""
        self.moved = 0
        """When it had moved last (ns)."""
        self._parent = ''

    def observe(self, stamp: int, position: Vector, parent: str) -> bool:
        """
        Take note of where it is.

        :param stamp: instant at which it was there (ns)
        :param position: of its center in the world (m)
        :param parent: the frame in which it is broadcast; a change of it counts as a motion
        :return: whether it has moved
        """
        moves = (stamp < self.seen or parent != self._parent
                 or position != self.position and dist(position, self.position) > ROUNDING)
        if moves:
            self.position, self._parent, self.moved = position, parent, stamp
        self.seen = stamp
        return moves

    @property
    def still(self) -> float:
        """How long (s) it had not moved when it was seen last."""
        return (self.seen - self.moved) * NANO


class Catcher:
    """Catch every brick that can be caught, carry it to the center and tip it off."""

    def __init__(self, parameters: Parameters) -> None:
        """
        Wait for a brick to fall.

        :param parameters: the physical numbers of robot, brick and world
        """
        self.parameters = parameters
        self.state = State.WAITING
        self.decision: Decision | None = None
        """The last one."""
        self._now = 0
        self._detector = FallDetector(parameters.gravity_accel)
        self._undecided = False
        self._brick = Brick()
        self._hovers = False
        self._track = Track(parameters.max_velocity)
        self._ramp = Ramp()
        self._since = 0
        self._carrying_since = 0

    def see_brick(self, stamp: int, position: Vector, parent: str = 'world') -> bool:
        """
        Take note of where the brick is.

        :param stamp: instant at which it was there (ns)
        :param position: of its center in the world (m); one beyond FARTHEST is ignored
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

    def update(self, now: int, platform: Pose | None) -> list[Action]:
        """
        Decide what is to be done now; to be called 50 times per second or more.

        :param now: the present instant (ns); where it is before the last one, the clock was set
            back
        :param platform: pose of the platform's frame in the world, None where it is not known
        :return: What is to be published, in order.
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
            self._brick.moved = self._brick.seen  # A blind catcher can't tell that it stays.
        if decision is not None:
            self.decision = decision
            actions.append(decision)
        fall = decision.fall if decision is not None and decision.reachable else None
        resting = robot if robot is not None and robot.at_rest else None
        state = transition(self.state, Observation(
            decision=None if decision is None else decision.reachable,
            falling=self._is_falling(),
            on_platform=self._is_on_platform(robot),
            at_center=resting is not None and _distance(resting, CENTER) <= ARRIVED,
            off_platform=self._is_off_platform(platform),
            out_of_patience=(now - self._since) * NANO > PATIENCE,
            level=self._ramp.angle == 0.0,
            lying=lying,
            blind=blind))
        if fall is not None or state is not self.state:
            self._since = now
            self._ramp.begin(now)
            if fall is not None:
                self._ramp.level(now)  # At once, whoever has tilted the platform.
                actions += [self._drive(now, (fall.x, fall.y)), Tilt(0.0)]
            else:
                actions += self._enter(state, now, robot)
            self.state = state
        elif resting is not None and state in (State.APPROACHING, State.CARRYING):
            goal = self._track.goal
            if _distance(resting, goal) > ARRIVED:
                # The order was lost on its way, or somebody else has sent it there.
                actions.append(self._drive(now, goal))
        if self._ramp.move(
                now, self.parameters.tilt_angle if self.state is State.TILTING else 0.0):
            actions.append(Tilt(self._ramp.angle))
        return actions

    def _start_afresh(self, now: int) -> None:
        """Begin every span of time at an instant (ns) before those that are remembered."""
        self._track.restart(now)
        self._ramp.restart(now)
        self._brick.seen = self._brick.moved = self._since = self._carrying_since = now

    def _decide(self, now: int, robot: Robot | None) -> Decision | None:
        """Return what is found about a fall that has not been decided about, once it is time."""
        fall = self._detector.fall
        if fall is None:
            self._undecided = False
            return None
        if not self._undecided or abs(now - self._brick.seen) * NANO > CLOCK_DIFFERENCE:
            return None
        decision = reach(fall, now, robot, self.parameters)
        # A robot that is seen too little may turn out to be near, and to stand still.
        hoped_for = Robot(fall.x, fall.y) if robot is None else robot._replace(reserve=0.0)
        if (not decision.reachable and decision.available > LAST_WORD
                and reach(fall, now, hoped_for, self.parameters).reachable):
            return None
        self._undecided = False
        return decision

    def _drive(self, now: int, goal: tuple[float, float]) -> Drive:
        """Order the robot at an instant (ns) to a point of the world (m)."""
        self._track.order(now, goal)
        return Drive(*goal)

    def _enter(self, state: State, now: int, robot: Robot | None) -> list[Action]:
        """Return what is to be done on entering a state other than APPROACHING."""
        if state is State.CARRYING:
            self._carrying_since = now
            return [self._drive(now, CENTER)]
        if state is State.LEVELLING and robot is not None:
            # A brick that has not moved, wherever the robot went and however it tilted, hovers.
            since = self._carrying_since
            self._hovers = (self.state in (State.CARRYING, State.TILTING)
                            and self._brick.moved <= since
                            and (self._brick.seen - since) * NANO >= SETTLED)
            if self._hovers and self.state is State.CARRYING:
                return [self._drive(now, within_arena(*self._brick.position[:2]))]
            if self.state in (State.APPROACHING, State.CARRYING):
                # What was to be caught or carried is gone: stop where the commands on their way
                # will have led.
                stop = robot.bound_for[0] if robot.bound_for else (robot.x, robot.y)
                return [self._drive(now, within_arena(*stop))]
        return []

    def _is_falling(self) -> bool:
        """Tell whether the brick falls, and has not passed the platform yet."""
        return (self._detector.fall is not None
                and self._brick.position[2] > resting_height(self.parameters) - ON_PLATFORM)

    def _is_at_rest_height(self) -> bool:
        """Tell whether the brick is as high as one on the level platform, and does not fall."""
        return (self._detector.fall is None
                and abs(self._brick.position[2] - resting_height(self.parameters)) <= ON_PLATFORM)

    def _is_on_platform(self, robot: Robot | None) -> bool:
        """Tell whether the brick lies on the level platform."""
        if robot is None or not self._is_at_rest_height():
            return False
        if self.state is State.CARRYING and self._brick.still < LAG:
            return True
        # The robot moves on while the transforms of the two are some ms apart.
        near = self.parameters.platform_radius + self.parameters.max_velocity * 0.1
        return _distance(robot, self._brick.position) <= near

    def _is_lying(self, robot: Robot | None) -> bool:
        """Tell whether the brick has lain on the level platform of a robot at rest for long."""
        if (self._hovers or self._brick.still < LYING
                or robot is None or not self._is_at_rest_height()):
            return False
        near = self.parameters.platform_radius + ON_PLATFORM
        return robot.at_rest and robot.level and _distance(robot, self._brick.position) <= near

    def _is_off_platform(self, platform: Pose | None) -> bool:
        """Tell whether the brick does not move although the platform is tilted: it has left."""
        brick = self._brick
        if platform is None:
            return True
        # Counted to when it was last seen: one that is out of sight may move.
        still = (brick.seen - max(brick.moved, self._track.level_seen)) * NANO
        ex, ey, _ = axes(platform.orientation)
        offset = [a - b for a, b in zip(brick.position, platform.position)]
        place = [sum(a * b for a, b in zip(offset, axis)) for axis in (ex, ey)]
        beside = hypot(*place) > self.parameters.platform_radius
        return still >= (SETTLED if beside else LAG)


def _distance(robot: Robot, place: tuple[float, ...]) -> float:
    """Return how far (m) the robot is from a place of the world, seen from above."""
    return hypot(robot.x - place[0], robot.y - place[1])
