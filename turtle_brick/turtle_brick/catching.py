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

`FallDetector` tells a fall from everything else that a brick may do and knows its course;
`reach` computes whether the robot can be under it in time; `transition` is the state machine;
`Catcher` holds them together and says what to publish. No clock is read here and nothing is
known of how the brick is moved: instants come with the observations, in integer nanoseconds of
one clock.
"""

from collections import deque
from enum import Enum
from math import cos
from math import dist
from math import hypot
from math import inf
from math import isnan
from math import nan
from math import pi
from math import sqrt
from typing import NamedTuple

from turtle_brick.driving import PERIOD
from turtle_brick.driving import TRANSPORT
from turtle_brick.driving import travel_time
from turtle_brick.driving import within_arena
from turtle_brick.geometry import axes
from turtle_brick.geometry import FARTHEST
from turtle_brick.geometry import Pose
from turtle_brick.geometry import Vector
from turtle_brick.parameters import Parameters
from turtle_brick.physics import is_level
from turtle_brick.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.turtlesim_kinematics import QUEUE_DEPTH
from turtle_brick.turtlesim_kinematics import TICK

NANO = 1e-9

CENTRE = (ARENA_SIZE / 2.0, ARENA_SIZE / 2.0)
"""Centre of the arena in the world (m), where the brick is carried to."""

QUEUE_LATENCY = QUEUE_DEPTH * PERIOD + TICK - PERIOD + TRANSPORT
"""The longest time (s) from publishing a command to the pose that shows it: its turn comes when
six newer ones wait behind it, and if a tick has just gone by then, with the next (0.0764 s)."""

COMMAND_LATENCY = 3 * TRANSPORT + PERIOD + QUEUE_LATENCY + PERIOD + 0.010
"""The longest time (s) from the decision to the platform's first motion as the arena sees it:
the goal reaches the robot, waits for its next cycle, the command goes through turtlesim's queue,
the pose waits for the robot's next cycle to become a transform, and that reaches the arena (4 ms
until its next step, the rest for what an operating system does in between)."""

GUARANTEED_LATENCY = 0.13
"""Time (s) from the release of a brick that is promised to be enough to see it fall, to decide
and to set the robot going: COMMAND_LATENCY and three samples of the brick."""

LEVEL_LATENCY = 3 * TRANSPORT + PERIOD + 0.015
"""The longest time (s) from publishing a tilt to the arena seeing the platform like that."""

CARRY_ON = QUEUE_LATENCY + 2 * PERIOD + TICK
"""How long (s) a moving robot may go on from where it is seen: what is seen is up to a tick and
a cycle old, and the commands on their way are obeyed whatever is decided."""

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

ROUNDING = 1e-9
"""Distance (m) by which the transforms of what stands still may differ: tf2 interpolates them."""

ON_PLATFORM = 0.01
"""How far (m) from its resting height a brick may be and still count as lying there."""


class Fall(NamedTuple):
    """A recognised fall: where and how fast the brick was at an instant of it."""

    stamp: int
    x: float
    y: float
    z: float
    speed: float
    """Downward (m/s)."""

    @property
    def position(self) -> Vector:
        """Position of the brick at `stamp` in the world (m)."""
        return (self.x, self.y, self.z)

    def height(self, stamp: int, gravity: float) -> float:
        """Return how high (m) the brick is at an instant (ns) if nothing stops it."""
        time = (stamp - self.stamp) * NANO
        return self.z - self.speed * time - 0.5 * gravity * time * time

    def speed_at(self, height: float, gravity: float) -> float:
        """Return how fast (m/s) the brick is at a height (m); NaN if it was released below it."""
        square = self.speed * self.speed + 2.0 * gravity * (self.z - height)
        return sqrt(square) if square >= 0.0 else nan

    def time_to(self, height: float, gravity: float) -> float:
        """
        Return the time (s) from `stamp` until the brick is down at a height (m).

        It is negative where the brick has passed the height, NaN where it was released below it.
        """
        return (self.speed_at(height, gravity) - self.speed) / gravity


class FallDetector:
    """
    Recognise free fall in a sequence of positions.

    Three samples at any spacing that went straight down, and whose second difference is the
    acceleration due to gravity, are a fall; being placed, carried or slid is not. At 250 Hz a
    fall is known 8 ms after the release.
    """

    TOLERANCE = 0.1
    """Largest deviation of the acceleration, as a part of gravity."""

    STRAIGHT = 0.01
    """Largest sideways motion of what may be a fall, as a part of its way down. A slide on a slope
    of more than 72 degrees has a fall's acceleration, within TOLERANCE, but is not straight."""

    SIDEWAYS = 1e-4
    """Largest sideways motion (m) between two samples of a fall."""

    DEVIATION = 0.01
    """Distance (m) from the recognised course at which the fall is over."""

    INTERRUPTION = 0.05
    """Longest time (s) that goes by between two positions while the clock is set back."""

    def __init__(self, gravity: float) -> None:
        """
        Know no position yet.

        :param gravity: the acceleration due to gravity (m/s^2)
        """
        self.gravity = gravity
        self.fall: Fall | None = None
        self._samples: deque[tuple[int, float, float, float]] = deque(maxlen=3)

    def observe(self, stamp: int, x: float, y: float, z: float) -> bool:
        """
        Take note of a position.

        :param stamp: instant at which the brick was there (ns)
        :param x: its position in the world (m)
        :param y: its position in the world (m)
        :param z: its position in the world (m)
        :return: Whether a fall has been recognised that was not known before. `fall` holds it
            until the brick no longer follows its course.
        """
        samples = self._samples
        descends = False
        if samples:
            stamp_before, x_before, y_before, z_before = samples[-1]
            if stamp <= stamp_before:
                if stamp < stamp_before:
                    samples.clear()
                    samples.append((stamp, x, y, z))
                    self._resume(stamp, z, z_before)
                return False
            if abs(x - x_before) + abs(y - y_before) > self.SIDEWAYS:
                samples.clear()
                self.fall = None
            descends = z < z_before
        samples.append((stamp, x, y, z))
        if self.fall is not None:
            if abs(self.fall.height(stamp, self.gravity) - z) > self.DEVIATION:
                self.fall = None
                samples.clear()
                samples.append((stamp, x, y, z))
            return False
        if not descends or len(samples) < 3:
            return False
        (t0, x0, y0, z0), (t1, _, _, z1), (t2, _, _, z2) = samples
        if not z0 > z1 or hypot(x - x0, y - y0) > self.STRAIGHT * (z0 - z2):
            return False
        first, second = (t1 - t0) * NANO, (t2 - t1) * NANO
        speed_before, speed_after = (z0 - z1) / first, (z1 - z2) / second
        acceleration = (speed_after - speed_before) / (0.5 * (first + second))
        if not abs(acceleration - self.gravity) <= self.TOLERANCE * self.gravity:
            return False
        self.fall = Fall(t2, x, y, z2, speed_after + 0.5 * self.gravity * second)
        return True

    def _resume(self, stamp: int, z: float, z_before: float) -> None:
        """Go on with a fall from a height (m) after the clock was set back to an instant (ns)."""
        if self.fall is not None:
            speed = self.fall.speed_at(z, self.gravity)
            longest = self.INTERRUPTION * speed
            self.fall = self.fall._replace(stamp=stamp, z=z, speed=speed) if (
                0.0 <= z_before - z <= longest) else None


class Decision(NamedTuple):
    """What `reach` found about a fall; every length in m, every time in s."""

    reachable: bool
    fall: Fall
    contact: int
    """Instant (ns) at which the brick's bottom is at the height of the platform's top."""
    available: float
    """Time from the decision to the contact."""
    needed: float
    """Time from the decision until the platform can be under the brick."""
    distance: float
    reason: str
    """Why the brick can't be caught; empty if it can."""

    @property
    def margin(self) -> float:
        """Time (s) to spare."""
        return self.available - self.needed


class Robot(NamedTuple):
    """Where the robot is, and where commands on their way may take it, in the world (m)."""

    x: float
    y: float
    bound_for: tuple[tuple[float, float], ...] = ()
    level: bool = True
    """Whether its platform is level, and will be seen so by everyone."""
    reserve: float = 0.0
    """How far (m) a motion that has not been seen yet may take it."""

    @property
    def at_rest(self) -> bool:
        """Whether it stands still, and will."""
        return not self.bound_for and not self.reserve


def resting_height(parameters: Parameters) -> float:
    """Return the height (m) of the centre of a brick that lies on the level platform."""
    return parameters.platform_height + parameters.brick_size[2] / 2.0


def guaranteed_distance(height: float, parameters: Parameters) -> float:
    """
    Return how far from a robot at rest a brick is sure to be caught inside the arena.

    :param height: of the brick's centre when it is released (m)
    :param parameters: the physical numbers
    :return: The distance (m); negative where nothing is promised.
    """
    fall = height - resting_height(parameters)
    if fall < 0.0:
        return -inf
    time = sqrt(2.0 * fall / parameters.gravity_accel)
    return parameters.max_velocity * (time - GUARANTEED_LATENCY) + parameters.platform_radius


def reach(fall: Fall, now: int, robot: Robot | None, parameters: Parameters) -> Decision:
    """
    Compute whether the robot can be under a falling brick when it comes down.

    :param fall: the fall
    :param now: the present instant (ns)
    :param robot: the robot, None where it is not known
    :param parameters: max_velocity, platform_height, platform_radius, gravity_accel, brick_size
    :return: The decision. The brick is reachable if it comes down inside the arena and the time to
        travel (distance - platform_radius) at max_velocity plus the latency of the command path is
        within the time until the contact; under a robot that is there already it always is. The
        distance of a moving robot is the largest that the commands on their way may make of it.
    """
    height = resting_height(parameters)
    time = fall.time_to(height, parameters.gravity_accel)
    contact = fall.stamp + (0 if isnan(time) else round(time / NANO))
    available = (contact - now) * NANO
    if robot is None:
        return Decision(False, fall, contact, available, inf, inf,
                        'no robot is known that could come')
    distance = hypot(fall.x - robot.x, fall.y - robot.y)
    farthest = robot.reserve + max(
        [distance] + [hypot(fall.x - x, fall.y - y) for x, y in robot.bound_for])
    needed = 0.0
    if farthest > parameters.platform_radius:
        needed = COMMAND_LATENCY + travel_time(
            farthest, parameters.platform_radius, parameters.max_velocity)
    if not robot.level:
        needed = max(needed, LEVEL_LATENCY)
    reason = ''
    if isnan(time):
        reason = (f'it falls from {fall.z:.4g} m, below the {height:.4g} m at which it would '
                  'lie on the platform')
    elif not (0.0 <= fall.x <= ARENA_SIZE and 0.0 <= fall.y <= ARENA_SIZE):
        reason = f'({fall.x:.4g}, {fall.y:.4g}) is outside the arena'
    elif time < 0.0:
        reason = f'at {fall.z:.4g} m it has passed the platform already'
    elif needed > max(available, 0.0):
        reason = (f'the robot, {distance:.2f} m away, needs {needed:.3f} s and the brick is down '
                  f'in {max(available, 0.0):.3f} s, {needed - available:.3f} s too early')
    return Decision(not reason, fall, contact, available, needed, distance, reason)


class State(Enum):
    """What the catcher is doing."""

    WAITING = 'waiting for a brick to fall'
    APPROACHING = 'driving under the brick'
    CARRYING = 'carrying the brick to the centre'
    TILTING = 'tilting the brick off'
    LEVELLING = 'levelling the platform'


class Observation(NamedTuple):
    """What matters for the next state."""

    decision: bool | None = None
    """Whether a brick that has just begun to fall can be caught; None: none has."""
    falling: bool = False
    on_platform: bool = False
    at_centre: bool = False
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
        if seen.at_centre:
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


class Unreachable(NamedTuple):
    """Say, at the brick, that it can't be caught."""

    position: Vector


Action = Drive | Tilt | Unreachable


class Catcher:
    """Catch every brick that can be caught, carry it to the centre and tip it off."""

    MEMORY = 0.07
    """Time (s) at one position after which the robot is at rest: four ticks of turtlesim."""

    def __init__(self, parameters: Parameters) -> None:
        """
        Wait for a brick to fall.

        :param parameters: the physical numbers of robot, brick and world
        """
        self.parameters = parameters
        self.state = State.WAITING
        self.decision: Decision | None = None
        self._now = 0
        self._detector = FallDetector(parameters.gravity_accel)
        self._undecided = False
        self._brick: Vector | None = None
        self._brick_parent = ''
        self._brick_seen = 0
        self._brick_moved = 0
        self._hovers = False
        self._level_seen = 0
        self._robot_seen = -inf
        self._track: deque[tuple[int, float, float]] = deque()
        self._goals: deque[tuple[int, Drive]] = deque()
        self._since = 0
        self._carrying_since = 0
        self._angle = 0.0
        self._angle_before = 0.0
        self._angle_set = 0

    def see_brick(self, stamp: int, position: Vector, parent: str = 'world') -> bool:
        """
        Take note of where the brick is.

        :param stamp: instant at which it was there (ns)
        :param position: of its centre in the world (m); one beyond FARTHEST is ignored
        :param parent: the frame in which it is broadcast; a change of it counts as a motion
        :return: Whether it has just begun to fall: then `update` should be called at once.
        """
        x, y, z = position
        if not abs(x) + abs(y) + abs(z) <= FARTHEST:
            return False
        if stamp < self._brick_seen or parent != self._brick_parent or self._brick is None or (
                position != self._brick and dist(position, self._brick) > ROUNDING):
            self._brick, self._brick_parent = position, parent
            self._brick_moved = stamp
            self._hovers = False
        self._brick_seen = stamp
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
        robot = self._observe_robot(now, platform)
        decision = self._decide(now, robot)
        lying = self.state is State.WAITING and self._is_lying(robot)
        actions: list[Action] = []
        if self.state is State.WAITING and decision is None and not lying:
            return actions
        blind = robot is None and (now - self._robot_seen) * NANO < OUT_OF_SIGHT
        if blind:
            self._brick_moved = self._brick_seen  # It has its time again when the robot is back.
        reachable = None
        if decision is not None:
            self.decision, reachable = decision, decision.reachable
            if not reachable:
                actions.append(Unreachable(decision.fall.position))
        at_rest = robot is not None and robot.at_rest
        state = transition(self.state, Observation(
            decision=reachable,
            falling=self._is_falling(),
            on_platform=self._is_on_platform(robot),
            at_centre=at_rest
            and hypot(robot.x - CENTRE[0], robot.y - CENTRE[1]) <= ARRIVED,
            off_platform=self._is_off_platform(platform),
            out_of_patience=(now - self._since) * NANO > PATIENCE,
            level=self._angle == 0.0,
            lying=lying,
            blind=blind))
        if state is not self.state or reachable:
            self._since = now
            self._angle_before = self._angle
            actions += self._enter(state, now, robot)
            self.state = state
        elif at_rest and state in (State.APPROACHING, State.CARRYING):
            goal = self._goals[-1][1]
            if hypot(robot.x - goal.x, robot.y - goal.y) > ARRIVED:
                # The order was lost on its way, or somebody else has sent it there.
                self._goals.append((now, goal))
                actions.append(goal)
        actions += self._move_platform(now)
        return actions

    def _start_afresh(self, now: int) -> None:
        """Begin every span of time at an instant (ns) before those that are remembered."""
        self._track.clear()
        self._goals = deque((now, goal) for _, goal in self._goals)
        self._brick_seen = self._brick_moved = now
        self._level_seen = self._robot_seen = self._since = self._carrying_since = now
        self._angle_before, self._angle_set = self._angle, now

    def _decide(self, now: int, robot: Robot | None) -> Decision | None:
        """Return what is found about a fall that has not been decided about, once it is time."""
        fall = self._detector.fall
        if fall is None:
            self._undecided = False
        if not self._undecided or abs(now - self._brick_seen) * NANO > CLOCK_DIFFERENCE:
            return None
        decision = reach(fall, now, robot, self.parameters)
        # A robot that is seen too little may turn out to be near, and to stand still.
        hoped_for = (Robot(fall.x, fall.y) if robot is None else robot._replace(reserve=0.0))
        if (not decision.reachable and decision.available > LAST_WORD
                and reach(fall, now, hoped_for, self.parameters).reachable):
            return None
        self._undecided = False
        return decision

    def _enter(self, state: State, now: int, robot: Robot | None) -> list[Action]:
        """Return what is to be done on entering a state."""
        actions: list[Action] = []
        if state is State.APPROACHING:
            # Level at once, whoever has tilted the platform.
            self._angle, self._angle_set = 0.0, now
            actions = [Drive(self.decision.fall.x, self.decision.fall.y), Tilt(0.0)]
        elif state is State.CARRYING:
            if self.state is not state:
                self._carrying_since = now
            actions = [Drive(*CENTRE)]
        elif state is State.LEVELLING and robot is not None:
            # A brick that has not moved, wherever the robot went and however it tilted, hovers.
            since = self._carrying_since
            self._hovers = (self.state in (State.CARRYING, State.TILTING)
                            and self._brick_moved <= since
                            and (self._brick_seen - since) * NANO >= SETTLED)
            if self._hovers and self.state is State.CARRYING:
                actions = [Drive(*within_arena(*self._brick[:2]))]
            elif self.state in (State.APPROACHING, State.CARRYING):
                # What was to be caught or carried is gone: stop where the commands on their way
                # will have led.
                stop = robot.bound_for[0] if robot.bound_for else (robot.x, robot.y)
                actions = [Drive(*within_arena(*stop))]
        if actions:
            self._goals.append((now, actions[0]))
        return actions

    def _move_platform(self, now: int) -> list[Action]:
        """Return the platform's next angle, if it is to change."""
        wanted = self.parameters.tilt_angle if self.state is State.TILTING else 0.0
        if self._angle == wanted:
            return []
        part = min((now - self._since) * NANO / RAMP, 1.0)
        smooth = 0.5 - 0.5 * cos(pi * part)
        self._angle = wanted if part == 1.0 else (
            self._angle_before + smooth * (wanted - self._angle_before))
        self._angle_set = now
        return [Tilt(self._angle)]

    def _is_falling(self) -> bool:
        """Tell whether the brick falls, and has not passed the platform yet."""
        return (self._detector.fall is not None
                and self._brick[2] > resting_height(self.parameters) - ON_PLATFORM)

    def _is_at_rest_height(self) -> bool:
        """Tell whether the brick is as high as one on the level platform, and does not fall."""
        return (self._brick is not None and self._detector.fall is None
                and abs(self._brick[2] - resting_height(self.parameters)) <= ON_PLATFORM)

    def _is_on_platform(self, robot: Robot | None) -> bool:
        """Tell whether the brick lies on the level platform."""
        if robot is None or not self._is_at_rest_height():
            return False
        if (self.state is State.CARRYING
                and (self._brick_seen - self._brick_moved) * NANO < LAG):
            return True
        # The robot moves on while the transforms of the two are some ms apart.
        near = self.parameters.platform_radius + self.parameters.max_velocity * 0.1
        return hypot(self._brick[0] - robot.x, self._brick[1] - robot.y) <= near

    def _is_lying(self, robot: Robot | None) -> bool:
        """Tell whether the brick has lain on the level platform of a robot at rest for long."""
        if (self._hovers or (self._brick_seen - self._brick_moved) * NANO < LYING
                or robot is None or not self._is_at_rest_height()):
            return False
        near = self.parameters.platform_radius + ON_PLATFORM
        return (robot.at_rest and robot.level
                and hypot(self._brick[0] - robot.x, self._brick[1] - robot.y) <= near)

    def _is_off_platform(self, platform: Pose | None) -> bool:
        """Tell whether the brick does not move although the platform is tilted: it has left."""
        if self._brick is None or platform is None:
            return True
        # Counted to when it was last seen: one that is out of sight may move.
        still = (self._brick_seen - max(self._brick_moved, self._level_seen)) * NANO
        ex, ey, _ = axes(platform.orientation)
        offset = [a - b for a, b in zip(self._brick, platform.position)]
        place = [sum(a * b for a, b in zip(offset, axis)) for axis in (ex, ey)]
        beside = hypot(*place) > self.parameters.platform_radius
        return still >= (SETTLED if beside else LAG)

    def _observe_robot(self, now: int, platform: Pose | None) -> Robot | None:
        """Take note of where the robot is; return what its motion and its orders may lead to."""
        track = self._track
        if platform is None:
            track.clear()
            return None
        self._robot_seen = now
        if is_level(platform):
            self._level_seen = now
        x, y, _ = platform.position
        track.append((now, x, y))
        # One older position is kept: the robot may have been out of sight for a while.
        while len(track) > 1 and (now - track[1][0]) * NANO > self.MEMORY:
            track.popleft()
        way = self.parameters.max_velocity * CARRY_ON
        bound_for = []
        for _, x_before, y_before in reversed(track):
            moved = hypot(x - x_before, y - y_before)
            if moved > ROUNDING:
                # However slow it seems: ticks and transforms come in lumps.
                scale = way / moved
                bound_for.append((x + scale * (x - x_before), y + scale * (y - y_before)))
                break
        goals = self._goals
        while len(goals) > 1 and (now - goals[1][0]) * NANO > COMMAND_LATENCY:
            goals.popleft()
        for ordered, goal in goals:
            # A moving robot obeys the last order. For a while after each, it may not yet be seen
            # to obey it, and still obey the one before.
            if bound_for or len(goals) > 1 or (now - ordered) * NANO < COMMAND_LATENCY:
                distance = hypot(goal.x - x, goal.y - y)
                if distance > 0.0:
                    part = min(way / distance, 1.0)
                    bound_for.append((x + part * (goal.x - x), y + part * (goal.y - y)))
        level = (is_level(platform)
                 and self._angle == 0.0 and (now - self._angle_set) * NANO > LEVEL_LATENCY)
        # Seen for too short a time, it may move as fast as it can to anywhere.
        known = bool(bound_for) or (now - track[0][0]) * NANO >= self.MEMORY
        return Robot(x, y, tuple(bound_for), level, 0.0 if known else way)
