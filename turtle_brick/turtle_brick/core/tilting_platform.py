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

"""Pose and shape of the platform that carries the brick. The axes follow REP 103."""

from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, sin

from turtle_brick.core.geometry import axes, Pose, Vector

LEVEL_TOLERANCE = 1e-3
"""Maximum inclination (rad) at which the platform counts as level."""


@dataclass(frozen=True)
class PlatformShape:
    """Shape of the platform. Positions (m) are relative to the center of the platform's top."""

    reach: float
    """Distance (m) from the center within which a brick lands in every direction."""

    def contains(self, x: float, y: float) -> bool:
        """Return whether a brick with its center at x, y is on the platform."""
        return hypot(x, y) <= self.reach

    def is_clear_of(self, x: float, y: float, yaw: float, length: float, width: float) -> bool:
        """Return whether a brick at x, y with a given yaw (rad) and size (m) has slid off."""
        c, s = cos(yaw), sin(yaw)
        # Distances from the center to the brick along the brick's own axes
        along = max(abs(c * x + s * y) - length / 2.0, 0.0)
        across = max(abs(-s * x + c * y) - width / 2.0, 0.0)
        return hypot(along, across) > self.reach


@dataclass(frozen=True)
class Platform:
    """Pose, axes, heading and inclination of the platform."""

    pose: Pose
    """Pose of the platform frame (origin: center of the platform's bottom) in the world frame."""

    @cached_property
    def axes(self) -> tuple[Vector, Vector, Vector]:
        """Return the platform's axes as unit vectors in the world frame. The hinge is along y."""
        return axes(self.pose.orientation)

    @cached_property
    def hinge_yaw(self) -> float:
        """Return the yaw (rad) of the platform's hinge. This yaw does not depend on the tilt."""
        hinge_x, hinge_y, _ = self.axes[1]
        return atan2(-hinge_x, hinge_y)

    @property
    def is_level(self) -> bool:
        """Whether the platform is level. A brick can land only on a level platform."""
        x, y, _, _ = self.pose.orientation
        # In a unit quaternion, x^2 + y^2 is the squared sine of half the inclination.
        return x * x + y * y < (LEVEL_TOLERANCE / 2.0) ** 2

    def coordinates_of(self, point: Vector) -> tuple[float, float]:
        """Convert a point (m) in the world frame to x and y (m) in the platform frame."""
        ex, ey, _ = self.axes
        dx, dy, dz = (a - b for a, b in zip(point, self.pose.position))
        return (dx * ex[0] + dy * ex[1] + dz * ex[2], dx * ey[0] + dy * ey[1] + dz * ey[2])
