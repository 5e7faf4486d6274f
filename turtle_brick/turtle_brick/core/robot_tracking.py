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

turtlesim executes commands with a delay, so a robot that has just received a goal still appears to
be at rest. `RobotTracker` therefore considers the robot to be at rest only when the last goal is
older than the command latency. All timestamps (ns) come from the same clock.
"""

from math import hypot, inf
from typing import NamedTuple

from turtle_brick.core.brick_tracking import POSITION_TOLERANCE
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS

REST_TIME = 0.07
"""Time (s) without motion after which the robot is considered to be at rest. REST_TIME exceeds
four turtlesim ticks."""

MIN_GOAL_DISTANCE = 0.05
"""Distance (m) from the goal beyond which a robot at rest is expected to start moving."""


class RobotState(NamedTuple):
    """State of the robot in the world frame."""

    x: float
    """x coordinate (m) of the platform's center."""
    y: float
    is_at_rest: bool = True
    """Whether the robot is at rest and no recent goal can still move it."""
    is_level: bool = True
    """Whether the platform is level and no recent command can still tilt it."""

    def distance_to(self, point: tuple[float, ...]) -> float:
        """Return the horizontal distance (m) from the robot to a point in the world frame."""
        return hypot(point[0] - self.x, point[1] - self.y)


class RobotTracker:
    """Record the transforms of the platform, and the goals and tilt commands of the catcher."""

    def __init__(self, command_latency: float) -> None:
        """Create a tracker for a robot that responds to a command within a given time (s)."""
        self.state: RobotState | None = None
        """Latest state of the robot, or None if the robot is unavailable."""
        self.platform: Platform | None = None
        """Latest platform, or None if the robot is unavailable."""
        self.late_response_time = 0.0
        """Last response time (s) that exceeded the command latency, or 0."""
        self._latency = command_latency
        self._stamp = 0
        self._last_motion = 0
        self._goal: tuple[float, float] | None = None
        self._goal_time = self._tilt_time = -inf
        """Times (ns) of the last goal and of the last tilt command other than 0 rad."""
        self._awaited_goal_time: int | None = None
        """Publication time (ns) of a goal to which the robot has not responded yet, or None."""

    def observe(self, stamp: int, platform: Platform | None) -> None:
        """Record the platform's pose at a time (ns), or None if the robot is unavailable."""
        self.platform = platform
        if platform is None:
            self.state = self._awaited_goal_time = None
            return
        x, y, _ = platform.pose.position
        if self.state is None:
            self._last_motion = stamp
        elif self.state.distance_to((x, y)) > POSITION_TOLERANCE:
            self._last_motion = stamp
            self._measure_response(self._stamp, stamp)
        self._stamp = stamp
        self.state = RobotState(
            x, y, is_at_rest=(self._time_since(self._last_motion) >= REST_TIME
                              and self._time_since(self._goal_time) >= self._latency),
            is_level=platform.is_level and self._time_since(self._tilt_time) >= self._latency)

    def record_goal(self, now: int, goal: tuple[float, float]) -> None:
        """Record a goal (m, in the world frame) published at `now` (ns)."""
        if (goal != self._goal and self.state is not None and self.state.is_at_rest
                and self.state.distance_to(goal) > MIN_GOAL_DISTANCE):
            self._awaited_goal_time = now
        self._goal, self._goal_time = goal, now

    def record_tilt(self, now: int, angle: float) -> None:
        """Record a tilt command (rad) published at `now` (ns)."""
        if angle != 0.0:
            self._tilt_time = now

    def _time_since(self, time: float) -> float:
        return (self._stamp - time) * SECONDS_PER_NS

    def _measure_response(self, still: int, moved: int) -> None:
        goal_time, self._awaited_goal_time = self._awaited_goal_time, None
        if goal_time is not None and (still - goal_time) * SECONDS_PER_NS > self._latency:
            self.late_response_time = (moved - goal_time) * SECONDS_PER_NS
