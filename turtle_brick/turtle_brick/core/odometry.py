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

The wheel rolls without slipping: it turns by path / radius, at speed / radius. The path is the one
that the turtle really travels, rather than the integral of the speed, because that is exact where
a wall stops the turtle and where poses are lost; a teleport is no path.
"""

from math import atan2, hypot, pi

from turtle_brick.core.geometry import Pose2D
from turtle_brick.core.turtlesim_kinematics import TICK, TurtlePose

MIN_MOTION = 1e-5
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
        self.wheel_velocity = 0.0
        """How fast the wheel rolls (rad/s)."""
        self.stem_angle = 0.0
        """Direction of the last motion, or of a command at rest, in base_link (rad)."""
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

    def steer(self, velocity: tuple[float, float]) -> None:
        """Turn the stem of a robot at rest along a commanded velocity (m/s in base_link)."""
        if self.wheel_velocity == 0.0 and velocity != (0.0, 0.0):
            self.stem_angle = wrapped(atan2(velocity[1], velocity[0]))

    def _roll(self, last: TurtlePose, now: float, pose: TurtlePose) -> None:
        """Turn wheel and stem by the motion since the last pose, unless it was a jump."""
        self.wheel_velocity = 0.0
        dx, dy = pose.x - last.x, pose.y - last.y
        path = hypot(dx, dy)
        # A pose comes with the speed that led to it. What is farther than that speed allows, over
        # all ticks since the last pose, is a teleport or another turtlesim.
        ticks = max(1.0, (now - self._last_time) / TICK + 0.5)
        if path <= MIN_MOTION or path > ticks * TICK * pose.linear_velocity + MIN_MOTION:
            return
        self.wheel_angle += path / self.wheel_radius
        # Over several ticks the path is longer than TICK tells; at a wall it is shorter.
        self.wheel_velocity = min(path / TICK, pose.linear_velocity) / self.wheel_radius
        self.stem_angle = wrapped(atan2(dy, dx) - pose.theta)


def wrapped(angle: float) -> float:
    """Return an angle (rad) in [-pi, pi)."""
    return (angle + pi) % (2.0 * pi) - pi
