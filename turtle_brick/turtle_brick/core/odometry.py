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
Odometry of a robot on one wheel, from the poses of turtlesim's turtle; frames as in REP 105.

The wheel rolls without slipping (path = radius * angle) along the path that the turtle really
travels: not while a wall stops it, and not when it is teleported.
"""

from math import atan2, hypot, pi

from turtle_brick.core.geometry import Pose2D
from turtle_brick.core.turtlesim_kinematics import TICK, TurtlePose

RESOLUTION = 1e-5
"""Motion (m) below which a float32 coordinate does not tell a direction."""


class Odometer:
    """Keep the pose in the odom frame, the wheel's angle and the stem's direction."""

    def __init__(self, wheel_radius: float) -> None:
        """Wait for the first pose, where the odom frame will be; the radius is in m."""
        self.wheel_radius = wheel_radius
        self.origin: Pose2D | None = None
        """Pose of the odom frame in the world: the first pose."""
        self.pose: Pose2D | None = None
        """Pose of base_link in the odom frame."""
        self.wheel_angle = 0.0
        """How far the wheel has rolled forward (rad), whole turns included."""
        self.stem_angle = 0.0
        """Direction of the last motion relative to base_link (rad), in [-pi, pi)."""
        self._last: TurtlePose | None = None
        self._last_time = 0.0
        self._world_to_odom = Pose2D(0.0, 0.0, 0.0)

    def observe(self, now: float, pose: TurtlePose) -> None:
        """Note a pose of the turtle, with its commanded speed, that arrives now (s)."""
        here = Pose2D(pose.x, pose.y, pose.theta)
        last = self._last
        if last is None:
            self.origin = here
            self._world_to_odom = here.inverse()
        else:
            self._roll(last, now, pose)
        self.pose = self._world_to_odom.compose(here)
        self._last, self._last_time = pose, now

    def _roll(self, last: TurtlePose, now: float, pose: TurtlePose) -> None:
        """Turn wheel and stem by the motion since the last pose, unless it was a jump."""
        dx, dy = pose.x - last.x, pose.y - last.y
        path = hypot(dx, dy)
        # A pose comes with the speed that led to it. What is farther than that speed allows, over
        # all ticks since the last pose, is a teleport or another turtlesim.
        ticks = max(1.0, (now - self._last_time) / TICK + 0.5)
        if path <= RESOLUTION or path > ticks * TICK * pose.linear_velocity + RESOLUTION:
            return
        self.wheel_angle += path / self.wheel_radius
        angle = atan2(dy, dx) - pose.theta
        self.stem_angle = (angle + pi) % (2.0 * pi) - pi
