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
Decide whether the robot can be under a falling brick in time.

`reach` decides, from the course of the fall and from what `Track` knows of the robot: where it is,
and where the commands on their way may take it. The latencies of the command path on one machine
are derived here; what they take longer elsewhere is measured, see `latency`, and called the
excess. Instants are integer nanoseconds of one clock.
"""

from collections import deque
from math import hypot, inf, isnan, sqrt
from typing import NamedTuple

from turtle_brick.core.driving import COMMAND_PERIOD, TRANSPORT_DELAY, travel_time
from turtle_brick.core.fall_detection import Fall
from turtle_brick.core.latency import Latency, LONGEST
from turtle_brick.core.parameters import CatcherParameters
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE, QUEUE_DEPTH, TICK

QUEUE_LATENCY = QUEUE_DEPTH * COMMAND_PERIOD + TICK - COMMAND_PERIOD + TRANSPORT_DELAY
"""The longest time (s) from publishing a command to the pose that shows it: six newer commands
must follow it, and if a tick has just passed then, the next one takes it (0.0764 s)."""

COMMAND_LATENCY = 3 * TRANSPORT_DELAY + COMMAND_PERIOD + QUEUE_LATENCY + COMMAND_PERIOD + 0.010
"""The longest time (s) from the decision to the platform's first motion as the arena sees it:
the goal reaches the robot and waits for its next cycle, the command goes through turtlesim's
queue, the pose waits for the robot's next cycle and becomes a transform, and that reaches the
arena (0.010 s: 4 ms until its next step, the rest for the operating system)."""

GUARANTEED_LATENCY = 0.13
"""Promised time (s) from the release of a brick to the robot's motion: COMMAND_LATENCY and three
positions of the brick."""

LEVEL_LATENCY = 3 * TRANSPORT_DELAY + COMMAND_PERIOD + 0.015
"""The longest time (s) from publishing a tilt until the arena sees the platform so."""

CARRY_ON = QUEUE_LATENCY + 2 * COMMAND_PERIOD + TICK
"""Time (s) for which a moving robot may go on from where it is seen: the pose is up to a tick and
a cycle old, and the commands on their way are obeyed in any case."""

FAR = 0.05
"""Distance (m) of a goal that a robot at rest surely begins to drive to."""

ROUNDING = 1e-9
"""Distance (m) by which poses of a robot at rest may differ: tf2 interpolates them."""


class Decision(NamedTuple):
    """What `reach` finds about a fall; lengths in m, times in s."""

    reachable: bool
    fall: Fall
    contact: int
    """Instant (ns) at which the brick's bottom is at the height of the platform's top."""
    available: float
    """Time from the decision to the contact."""
    needed: float
    """Time from the decision until the platform can be under the brick."""
    latency: float
    """Longest time from the decision to the platform's first motion, as reckoned with."""
    distance: float
    reason: str
    """Why the brick can't be caught; empty if it can."""

    @property
    def margin(self) -> float:
        """Time (s) to spare."""
        return self.available - self.needed

    @property
    def summary(self) -> str:
        """The decision with its reason: "reachable: ..." or "unreachable: ..."."""
        if not self.reachable:
            return f'unreachable: {self.reason}'
        return (f'reachable: the robot, {self.distance:.2f} m away, needs {self.needed:.3f} s, and '
                f'the brick lands in {self.available:.3f} s (command latency {self.latency:.2f} s)')


class RobotMotion(NamedTuple):
    """Where the robot is, and where the commands on their way may take it, in the world (m)."""

    x: float
    y: float
    bound_for: tuple[tuple[float, float], ...] = ()
    """Points to which the commands on their way may take it."""
    level: bool = True
    """Whether its platform is level, and all others see it so."""
    reserve: float = 0.0
    """How far (m) it may move although no motion was seen yet."""

    @property
    def at_rest(self) -> bool:
        """Whether it stands still and no command on its way moves it."""
        return not self.bound_for and not self.reserve

    def distance_to(self, place: tuple[float, ...]) -> float:
        """Return the horizontal distance (m) of a place in the world from the robot."""
        return hypot(place[0] - self.x, place[1] - self.y)


def resting_height(parameters: CatcherParameters) -> float:
    """Return the height (m) of the center of a brick on the level platform."""
    return parameters.platform_height + parameters.brick_size[2] / 2.0


def fall_time(height: float, parameters: CatcherParameters) -> float:
    """
    Return the time (s) of a free fall from rest onto the level platform, sqrt(2 h / g).

    :param height: of the brick's center when it is released (m)
    :param parameters: the physical numbers
    :return: The time; 0 from below the platform.
    """
    depth = max(height - resting_height(parameters), 0.0)
    return sqrt(2.0 * depth / parameters.gravity_accel)


def guaranteed_distance(height: float, parameters: CatcherParameters,
                        excess: float = 0.0) -> float:
    """
    Return the distance from a robot at rest within which a brick is promised to be caught.

    :param height: of the brick's center when it is released (m)
    :param parameters: the physical numbers
    :param excess: how much longer decision and commands take than on one machine (s)
    :return: The distance (m), inside the arena; negative where nothing is promised.
    """
    if height < resting_height(parameters):
        return -inf
    time = fall_time(height, parameters) - GUARANTEED_LATENCY - excess
    return parameters.max_velocity * time + parameters.platform_radius


def time_needed(distance: float, parameters: CatcherParameters, excess: float = 0.0) -> float:
    """
    Return the longest time (s) from the decision until the level platform is under a place.

    :param distance: of the place from the robot (m)
    :param parameters: the physical numbers
    :param excess: how much longer the commands take than on one machine (s)
    :return: COMMAND_LATENCY, the excess and the time to travel at max_velocity; 0 where it is
        there already.
    """
    if distance <= parameters.platform_radius:
        return 0.0
    return COMMAND_LATENCY + excess + travel_time(
        distance, parameters.platform_radius, parameters.max_velocity)


def reach(fall: Fall, now: int, robot: RobotMotion | None,
          parameters: CatcherParameters, excess: float = 0.0) -> Decision:
    """
    Compute whether the robot can be under a falling brick when it comes down.

    :param fall: the fall
    :param now: the present instant (ns)
    :param robot: the robot, None where it is not known
    :param parameters: max_velocity, platform_height, platform_radius, gravity_accel, brick_size
    :param excess: how much longer the commands take than on one machine (s)
    :return: The decision. The brick is reachable if it comes down inside the arena and
        `time_needed` is within the time until the contact. The distance of a moving robot is the
        largest that the commands on their way may lead to.
    """
    height = resting_height(parameters)
    time = fall.time_to(height, parameters.gravity_accel)
    contact = fall.stamp + (0 if isnan(time) else round(time / SECONDS_PER_NS))
    available = (contact - now) * SECONDS_PER_NS
    latency = COMMAND_LATENCY + excess
    if robot is None:
        return Decision(False, fall, contact, available, inf, latency, inf,
                        'no robot is available')
    distance = robot.distance_to(fall.position)
    farthest = robot.reserve + max(
        [distance] + [hypot(fall.x - x, fall.y - y) for x, y in robot.bound_for])
    needed = time_needed(farthest, parameters, excess)
    if not robot.level:
        needed = max(needed, LEVEL_LATENCY + excess)
    reason = ''
    if isnan(time):
        reason = (f'the brick falls from {fall.z:.4g} m, below its height of {height:.4g} m on the '
                  'platform')
    elif not (0.0 <= fall.x <= ARENA_SIZE and 0.0 <= fall.y <= ARENA_SIZE):
        reason = f'the landing point ({fall.x:.4g}, {fall.y:.4g}) is outside the arena'
    elif time < 0.0:
        reason = f'the brick, at {fall.z:.4g} m, has already passed the platform'
    elif needed > max(available, 0.0):
        reason = (f'the robot, {distance:.2f} m away, needs {needed:.3f} s, but the brick lands in '
                  f'{max(available, 0.0):.3f} s, {needed - available:.3f} s too early (command '
                  f'latency {latency:.2f} s)')
    return Decision(not reason, fall, contact, available, needed, latency, distance, reason)


class Track:
    """Where the robot was seen and sent, and hence where it may go."""

    MEMORY = 0.07
    """Time (s) at one position after which the robot is at rest: over four ticks of turtlesim."""

    def __init__(self, max_velocity: float, latency: Latency) -> None:
        """
        Know nothing yet of the robot.

        :param max_velocity: its greatest speed (m/s)
        :param latency: how long messages and orders take; told when the robot obeys
        """
        self.excess = 0.0
        """How much longer (s) orders take, at the last instant, than on one machine."""
        self._latency = latency
        self.seen = -inf
        """When the robot was in sight last (ns)."""
        self.unseen = 0
        """When it was out of sight last (ns)."""
        self.level_seen = 0
        """When its platform was seen level last (ns)."""
        self._max_velocity = max_velocity
        self._places: deque[tuple[int, float, float]] = deque()
        """Where it was and when, back to the last one before MEMORY."""
        self._orders: deque[tuple[int, tuple[float, float]]] = deque()
        """Where it was sent and when, back to the last that it may still be obeying."""
        self._sent_from: tuple[int, float, float] | None = None
        """When a robot at rest was sent off (ns), and from where (m), until it moves."""
        self._still = 0
        """When it was seen there last (ns)."""

    @property
    def goal(self) -> tuple[float, float]:
        """Where the robot was sent last, in the world (m)."""
        return self._orders[-1][1]

    @property
    def _way(self) -> float:
        """Return how far (m) the commands on their way can take the robot."""
        return self._max_velocity * (CARRY_ON + self.excess)

    def order(self, now: int, goal: tuple[float, float]) -> None:
        """Note that the robot is sent to a point of the world (m) at an instant (ns)."""
        self._orders.append((now, goal))
        if self._places and self._is_known(now) and not self._onward():
            _, x, y = self._places[-1]
            if hypot(goal[0] - x, goal[1] - y) > FAR:
                self._sent_from = (now, x, y)
                self._still = now

    def lost(self, now: int) -> bool:
        """Tell whether the last order may be lost: messages are, and it may not be obeyed yet."""
        return bool(self._orders and self._latency.loses(now)
                    and self._is_recent(now, self._orders[-1][0]))

    def observe(self, now: int, platform: Platform | None, level_for: float
                ) -> RobotMotion | None:
        """
        Note where the robot is.

        :param now: the present instant (ns)
        :param platform: the platform, None if it is out of sight
        :param level_for: how long ago (s) it was ordered to be level, 0 if it was not
        :return: The robot, None if it is out of sight.
        """
        self.excess = self._latency.excess(now)
        if platform is None:
            self.unseen = now
            self._places.clear()
            return None
        self.seen = now
        if platform.is_level:
            self.level_seen = now
        x, y, _ = platform.pose.position
        self._note_obedience(now, x, y)
        self._places.append((now, x, y))
        _forget(self._places, now, self.MEMORY + self.excess)
        _forget(self._orders, now, COMMAND_LATENCY + self.excess)
        onward = self._onward()
        bound_for = (*onward, *self._toward_goals(now, bool(onward)))
        level = platform.is_level and level_for > LEVEL_LATENCY + self.excess
        return RobotMotion(x, y, bound_for, level,
                           0.0 if bound_for or self._is_known(now) else self._way)

    def _note_obedience(self, now: int, x: float, y: float) -> None:
        """Note how long a robot at rest takes to obey, if that is longer than on one machine."""
        if self._sent_from is None:
            return
        ordered, x_then, y_then = self._sent_from
        if hypot(x - x_then, y - y_then) <= ROUNDING:
            self._still = now
            if (now - ordered) * SECONDS_PER_NS > LONGEST:
                self._sent_from = None
            return
        self._sent_from = None
        # It was seen to stand for longer than that; it moves since some time after it.
        if (self._still - ordered) * SECONDS_PER_NS > COMMAND_LATENCY:
            self._latency.obey(now, (now - ordered) * SECONDS_PER_NS - COMMAND_LATENCY)

    def _onward(self) -> list[tuple[float, float]]:
        """Return where the robot gets if it goes on as it was seen to move; nothing at rest."""
        _, x, y = self._places[-1]
        for _, x_before, y_before in reversed(self._places):
            moved = hypot(x - x_before, y - y_before)
            if moved > ROUNDING:
                # At full speed, however slow it seems: ticks and transforms come in bunches.
                scale = self._way / moved
                return [(x + scale * (x - x_before), y + scale * (y - y_before))]
        return []

    def _toward_goals(self, now: int, moving: bool) -> list[tuple[float, float]]:
        """Return where the robot gets on its way to each goal that it may be obeying."""
        _, x, y = self._places[-1]
        points = []
        for ordered, (goal_x, goal_y) in self._orders:
            # A moving robot obeys the last order; as long as that may be on its way, it may still
            # obey the one before.
            if moving or len(self._orders) > 1 or self._is_recent(now, ordered):
                distance = hypot(goal_x - x, goal_y - y)
                if distance > 0.0:
                    part = min(self._way / distance, 1.0)
                    points.append((x + part * (goal_x - x), y + part * (goal_y - y)))
        return points

    def _is_recent(self, now: int, ordered: int) -> bool:
        """Tell whether an order given at an instant (ns) may not be obeyed yet."""
        return (now - ordered) * SECONDS_PER_NS < COMMAND_LATENCY + self.excess

    def _is_known(self, now: int) -> bool:
        """Tell whether a robot without motion is at rest: else it may be going anywhere."""
        return (now - self._places[0][0]) * SECONDS_PER_NS >= self.MEMORY + self.excess


def _forget(entries: deque, now: int, age: float) -> None:
    """Remove the entries older than an age (s) but the last of them: there may be no younger."""
    while len(entries) > 1 and (now - entries[1][0]) * SECONDS_PER_NS > age:
        entries.popleft()
