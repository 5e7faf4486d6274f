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
Compute the wheel odometry from the poses published by turtlesim. The frames follow REP 105.

The wheel rolls without slipping, so its angle is the integral of the velocity along the stem's
direction, divided by the wheel radius. The integral is the sum of the displacements between
consecutive poses, so it is correct even if the turtle hits a wall or a pose message is lost. A
teleport does not turn the wheel.
"""

from math import cos, hypot, sin

from turtle_brick.core.geometry import Pose2D
from turtle_brick.core.turtlesim_arena import TICK, TurtlePose

MIN_MOTION = 1e-5
"""Minimum distance (m) between two poses that cannot be a float32 rounding error."""


class Odometer:
    """Compute the pose of the robot in the odom frame and the angle of the wheel."""

    def __init__(self, wheel_radius: float) -> None:
        """Create an odometer for a wheel with a given radius (m)."""
        self.wheel_radius = wheel_radius
        self.origin: Pose2D | None = None
        """First pose of the turtle, which is the pose of the odom frame in the world frame."""
        self.pose: Pose2D | None = None
        """Pose of base_link in the odom frame."""
        self.wheel_angle = 0.0
        """Angle (rad) of the wheel, including full turns."""
        self._last: TurtlePose | None = None
        self._last_time = 0.0
        self._world_to_odom = Pose2D(0.0, 0.0, 0.0)

    def observe(self, now: float, pose: TurtlePose, stem_angle: float) -> None:
        """Update the odometry with the turtle's pose and stem angle (rad) at `now` (s)."""
        world_pose = Pose2D(pose.x, pose.y, pose.theta)
        if self._last is None:
            self.origin = world_pose
            self._world_to_odom = world_pose.inverse()
        else:
            self._roll(self._last, now, pose, stem_angle)
        self.pose = self._world_to_odom.compose(world_pose)
        self._last, self._last_time = pose, now

    def _roll(self, last: TurtlePose, now: float, pose: TurtlePose, stem_angle: float) -> None:
        dx, dy = pose.x - last.x, pose.y - last.y
        path, direction = hypot(dx, dy), pose.theta + stem_angle
        # The turtle teleported if its path is too long for the reported speeds and elapsed time.
        longest = max(TICK, now - self._last_time + 0.5 * TICK) * max(
            last.linear_velocity, pose.linear_velocity)
        if MIN_MOTION < path <= longest + MIN_MOTION:
            self.wheel_angle += (dx * cos(direction) + dy * sin(direction)) / self.wheel_radius
