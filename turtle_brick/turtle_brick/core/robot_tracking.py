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
Compute the positions that the robot may reach with the commands already sent.

turtlesim executes commands with a delay, so a robot with a new goal first continues in its last
direction or toward its previous goal. All timestamps (ns) come from one clock.
"""

from collections import deque
from math import hypot, inf

from turtle_brick.core.driving import COMMAND_PERIOD
from turtle_brick.core.latency import LatencyMonitor, MAX_DELAY
from turtle_brick.core.reachability import (COMMAND_LATENCY, LEVEL_LATENCY, QUEUE_LATENCY,
                                            RobotMotion)
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import TICK

COMMITTED_TIME = QUEUE_LATENCY + 2 * COMMAND_PERIOD + TICK
"""Maximum time (s) for which a robot can keep moving after its last observed position. The
position is up to one tick and one robot cycle old, and the queued commands are still executed."""

REST_TIME = 0.07
"""Time (s) without motion after which the robot is considered to be at rest. This time exceeds
four turtlesim ticks."""

MIN_GOAL_DISTANCE = 0.05
"""Distance (m) beyond which a new goal is sure to move a robot at rest."""

POSITION_TOLERANCE = 1e-9
"""Maximum apparent motion (m) of an object at rest, caused by interpolation in tf2."""


class RobotTracker:
    """Record the positions and goals of the robot, and compute its motion."""

    def __init__(self, max_velocity: float, latency: LatencyMonitor) -> None:
        """Create a tracker for a robot with a given maximum speed (m/s)."""
        self.excess = 0.0
        """Excess latency (s) at the last observation."""
        self.last_seen = -inf
        """Last time (ns) at which the platform was available."""
        self.last_unseen = 0
        """Last time (ns) at which the platform was unavailable."""
        self.last_level = 0
        """Last time (ns) at which the platform was level."""
        self._latency = latency
        self._max_velocity = max_velocity
        self._positions: deque[tuple[int, float, float]] = deque()
        """Times (ns) and positions (m). The first position is older than REST_TIME."""
        self._goals: deque[tuple[int, tuple[float, float]]] = deque()
        """Times (ns) and goals (m). The first goal may already be in effect."""
        self._departure: tuple[int, float, float] | None = None
        """Time (ns) of a goal, and x and y (m) of a robot at rest, or None if the robot moved."""
        self._last_at_departure = 0
        """Last time (ns) at which the robot was at the position in `_departure`."""

    @property
    def goal(self) -> tuple[float, float]:
        """Position (m) of the last recorded goal in the world frame."""
        return self._goals[-1][1]

    @property
    def _committed_distance(self) -> float:
        """Maximum distance (m) that the robot can cover with the commands already sent."""
        return self._max_velocity * (COMMITTED_TIME + self.excess)

    def record_goal(self, now: int, goal: tuple[float, float]) -> None:
        """Record a goal (m, in the world frame) published at `now` (ns)."""
        self._goals.append((now, goal))
        if not self._positions or not self._is_rest_known(now) or self._extrapolate() is not None:
            return
        _, x, y = self._positions[-1]
        if hypot(goal[0] - x, goal[1] - y) > MIN_GOAL_DISTANCE:
            self._departure = (now, x, y)
            self._last_at_departure = now

    def is_goal_at_risk(self, now: int) -> bool:
        """Return whether the last goal is recent and may have been lost."""
        return (len(self._goals) > 0 and self._latency.loses_messages(now)
                and self._is_recent(now, self._goals[-1][0]))

    def observe(self, now: int, platform: Platform | None, level_for: float
                ) -> RobotMotion | None:
        """
        Record the robot's position and return its motion, or None if the robot is unavailable.

        :param platform: platform of the robot at time `now` (ns), or None if unavailable
        :param level_for: time (s) since a tilt of 0 was commanded, or 0 after any other command
        """
        self.excess = self._latency.excess(now)
        if platform is None:
            self.last_unseen = now
            self._positions.clear()
            return None
        self.last_seen = now
        if platform.is_level:
            self.last_level = now
        x, y, _ = platform.pose.position
        self._measure_response(now, x, y)
        self._positions.append((now, x, y))
        _remove_old(self._positions, now, REST_TIME + self.excess)
        _remove_old(self._goals, now, COMMAND_LATENCY + self.excess)
        destinations = self._destinations(now)
        level = platform.is_level and level_for > LEVEL_LATENCY + self.excess
        is_certain = len(destinations) > 0 or self._is_rest_known(now)
        uncertainty = 0.0 if is_certain else self._committed_distance
        return RobotMotion(x, y, tuple(destinations), level, uncertainty)

    def _measure_response(self, now: int, x: float, y: float) -> None:
        """Record the response delay of a robot at rest if the delay exceeds COMMAND_LATENCY."""
        if self._departure is None:
            return
        sent, x_before, y_before = self._departure
        if hypot(x - x_before, y - y_before) <= POSITION_TOLERANCE:
            self._last_at_departure = now
            if (now - sent) * SECONDS_PER_NS > MAX_DELAY:
                self._departure = None
            return
        self._departure = None
        # The robot was late if it was still at rest after COMMAND_LATENCY.
        if (self._last_at_departure - sent) * SECONDS_PER_NS > COMMAND_LATENCY:
            self._latency.record_response_delay(
                now, (now - sent) * SECONDS_PER_NS - COMMAND_LATENCY)

    def _destinations(self, now: int) -> list[tuple[float, float]]:
        """Return the points (m) that the robot may reach with the commands already sent."""
        _, x, y = self._positions[-1]
        extrapolated = self._extrapolate()
        points = [] if extrapolated is None else [extrapolated]
        for sent, (goal_x, goal_y) in self._goals:
            # If the last goal is recent, the robot may still be driving to the previous goal.
            if extrapolated is None and len(self._goals) == 1 and not self._is_recent(now, sent):
                continue
            distance = hypot(goal_x - x, goal_y - y)
            if distance > 0.0:
                fraction = min(self._committed_distance / distance, 1.0)
                points.append((x + fraction * (goal_x - x), y + fraction * (goal_y - y)))
        return points

    def _extrapolate(self) -> tuple[float, float] | None:
        """Return a point (m) straight ahead of a moving robot, or None for a robot at rest."""
        _, x, y = self._positions[-1]
        for _, x_before, y_before in reversed(self._positions):
            moved = hypot(x - x_before, y - y_before)
            if moved > POSITION_TOLERANCE:
                # Assume max_velocity, because irregular intervals distort the measured speed.
                scale = self._committed_distance / moved
                return (x + scale * (x - x_before), y + scale * (y - y_before))
        return None

    def _is_recent(self, now: int, sent: int) -> bool:
        """Return whether a goal sent at the time `sent` (ns) may not have taken effect yet."""
        return (now - sent) * SECONDS_PER_NS < COMMAND_LATENCY + self.excess

    def _is_rest_known(self, now: int) -> bool:
        """Return whether the positions cover enough time to detect a robot at rest."""
        return (now - self._positions[0][0]) * SECONDS_PER_NS >= REST_TIME + self.excess


def _remove_old(entries: deque, now: int, max_age: float) -> None:
    """Remove the entries older than `max_age` (s), but keep the latest of them."""
    while len(entries) > 1 and (now - entries[1][0]) * SECONDS_PER_NS > max_age:
        entries.popleft()
