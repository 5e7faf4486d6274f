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


"""The platform that a brick lands on, rides on and slides off; axes as in REP 103."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import atan2

from turtle_brick.core.geometry import axes, Pose, Vector

LEVEL_TOLERANCE = 1e-3
"""The largest angle (rad) of a platform that counts as level, so that a brick can land on it."""


@dataclass(frozen=True)
class Platform:
    """Where a platform is and how it is turned; what follows from that is computed once."""

    pose: Pose
    """Pose of its frame, in the center of its base, in the world."""

    @cached_property
    def axes(self) -> tuple[Vector, Vector, Vector]:
        """Return the unit vectors x, y, z of its frame in the world: y is its hinge."""
        return axes(self.pose.orientation)

    @cached_property
    def hinge_yaw(self) -> float:
        """Return the turn about z (rad) that leads to its hinge, at any tilt."""
        hinge_x, hinge_y, _ = self.axes[1]
        return atan2(-hinge_x, hinge_y)

    @property
    def is_level(self) -> bool:
        """Tell whether a brick can land on it."""
        x, y, _, _ = self.pose.orientation
        # sin^2 of half the angle between its normal and the vertical.
        return x * x + y * y < (LEVEL_TOLERANCE / 2.0) ** 2

    def point(self, u: float, v: float, w: float) -> Vector:
        """Return where in the world (m) something at u, v, w (m) of its frame is."""
        (px, py, pz), (ex, ey, ez) = self.pose.position, self.axes
        return (px + u * ex[0] + v * ey[0] + w * ez[0],
                py + u * ex[1] + v * ey[1] + w * ez[1],
                pz + u * ex[2] + v * ey[2] + w * ez[2])

    def coordinates_of(self, point: Vector) -> tuple[float, float]:
        """Return where a point of the world (m) is along its x and y (m)."""
        ex, ey, _ = self.axes
        dx, dy, dz = (a - b for a, b in zip(point, self.pose.position))
        return (dx * ex[0] + dy * ex[1] + dz * ex[2], dx * ey[0] + dy * ey[1] + dz * ey[2])
