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
Track the state of the robot from its transforms and the catcher's commands.

turtlesim executes commands with a delay, so a robot that has just received a goal still moves as
before. `RobotTracker` therefore judges the robot's motion only when the last goal is older than
the command latency. All timestamps (ns) come from the same clock.
"""

from math import hypot, inf
from typing import NamedTuple

from turtle_brick.core.brick_tracking import POSITION_TOLERANCE
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS

REST_TIME = 0.07
"""Time (s) without motion after which the robot is considered to be at rest. REST_TIME exceeds
four turtlesim ticks."""

GOAL_TOLERANCE = 0.02
"""Maximum distance (m) from the goal at which a robot at rest counts as having arrived."""

MIN_PROGRESS = 0.95
"""Minimum ratio of a robot's progress toward its goal to its motion, which is then at most 18
degrees off course."""


class RobotState(NamedTuple):
    """State of the robot in the world frame."""

    x: float
    """x coordinate (m) of the platform's center."""
    y: float
    is_at_rest: bool = True
    """Whether the robot is at rest and no recent goal can still move it."""
    is_level: bool = True
    """Whether the platform is level and no recent command can still tilt it."""
    is_off_course: bool = False
    """Whether the robot rests or drives elsewhere although no recent goal can still move it."""

    def distance_to(self, point: tuple[float, ...]) -> float:
        """Return the horizontal distance (m) from the robot to a point in the world frame."""
        return hypot(point[0] - self.x, point[1] - self.y)


class ResponseTimer:
    """Measure the time from a goal to the first motion of a robot at rest."""

    def __init__(self, limit: float) -> None:
        """Create a timer that reports response times above a limit (s)."""
        self.late_time = 0.0
        """Last response time (s) that exceeded the limit, or 0."""
        self._limit = limit
        self._start: int | None = None

    def start(self, now: int | None) -> None:
        """Start the timer at the publication of a goal (ns), or cancel the measurement."""
        self._start = now

    def stop(self, still: int, moved: int) -> None:
        """Stop the timer when a robot that was still at rest at `still` (ns) has `moved` (ns)."""
        start, self._start = self._start, None
        if start is not None and (still - start) * SECONDS_PER_NS > self._limit:
            self.late_time = (moved - start) * SECONDS_PER_NS


class RobotTracker:
    """Record the transforms of the platform, and the goals and tilt commands of the catcher."""

    def __init__(self, command_latency: float) -> None:
        """Create a tracker for a robot that responds to a command within a given time (s)."""
        self.state: RobotState | None = None
        """Latest state of the robot, or None if the robot is unavailable."""
        self.platform: Platform | None = None
        """Latest platform, or None if the robot is unavailable."""
        self.goal: tuple[float, float] | None = None
        """Last goal (m) in the world frame."""
        self.response = ResponseTimer(command_latency)
        self._latency = command_latency
        self._stamp = 0
        self._last_motion = 0
        self._goal_time = self._tilt_time = -inf
        """Times (ns) of the last goal and of the last tilt command other than 0 rad."""

    def observe(self, stamp: int, platform: Platform | None) -> None:
        """Record the platform's pose at a time (ns), or None if the robot is unavailable."""
        self.platform = platform
        if platform is None:
            self.state = None
            self.response.start(None)
            return
        x, y, _ = platform.pose.position
        before, after = self.state or RobotState(x, y), RobotState(x, y)
        motion = before.distance_to(after)
        if motion > POSITION_TOLERANCE:
            self.response.stop(self._stamp, stamp)
        if motion > POSITION_TOLERANCE or self.state is None:
            self._last_motion = stamp
        self._stamp = stamp
        is_settled = self._time_since(self._goal_time) >= self._latency
        is_at_rest = is_settled and self._time_since(self._last_motion) >= REST_TIME
        self.state = after._replace(
            is_at_rest=is_at_rest,
            is_level=platform.is_level and self._time_since(self._tilt_time) >= self._latency,
            is_off_course=is_settled and self._is_off_course(before, after, is_at_rest))

    def _is_off_course(self, before: RobotState, after: RobotState, is_at_rest: bool) -> bool:
        """Return whether the robot is not at its goal, and rests or has moved elsewhere."""
        if self.goal is None or after.distance_to(self.goal) <= GOAL_TOLERANCE:
            return False
        motion = before.distance_to(after)
        progress = before.distance_to(self.goal) - after.distance_to(self.goal)
        return is_at_rest or (motion > POSITION_TOLERANCE and progress < MIN_PROGRESS * motion)

    def record_goal(self, now: int, goal: tuple[float, float]) -> None:
        """Record a goal (m, in the world frame) published at `now` (ns)."""
        if goal != self.goal:
            starts_moving = (self.state is not None and self.state.is_at_rest
                             and self.state.distance_to(goal) > GOAL_TOLERANCE)
            self.response.start(now if starts_moving else None)
        self.goal, self._goal_time = goal, now

    def record_tilt(self, now: int, angle: float) -> None:
        """Record a tilt command (rad) published at `now` (ns)."""
        if angle != 0.0:
            self._tilt_time = now

    def _time_since(self, time: float) -> float:
        return (self._stamp - time) * SECONDS_PER_NS
