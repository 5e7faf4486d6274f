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
Vectors, rotations, poses and colors as plain tuples.

Units and axes follow REP 103 (SI units, right-handed frames, z up, yaw counterclockwise).
Quaternions have unit length and the order (x, y, z, w). A pose maps a point p in its own frame to
rotate(orientation, p) + position in the parent frame.
"""

from math import cos, sin
from typing import NamedTuple

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

Color = tuple[float, float, float, float]
"""Color as red, green, blue and opacity, each from 0 to 1."""

IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)

MAX_COORDINATE = 1e9
"""Maximum valid coordinate (m), which keeps all products of coordinates finite."""


class Pose(NamedTuple):
    """Position (m) and orientation (unit quaternion) of a frame in its parent frame."""

    position: Vector
    orientation: Quaternion

    def transform(self, point: Vector) -> Vector:
        """Transform a point (m) from this frame to the parent frame."""
        x, y, z = rotate(self.orientation, point)
        return (x + self.position[0], y + self.position[1], z + self.position[2])


class Pose2D(NamedTuple):
    """Position (m) and heading (rad) of a frame in the xy plane of its parent frame."""

    x: float
    y: float
    yaw: float

    def compose(self, other: 'Pose2D') -> 'Pose2D':
        """Transform the pose `other` from this frame to the parent frame."""
        c, s = cos(self.yaw), sin(self.yaw)
        return Pose2D(self.x + c * other.x - s * other.y,
                      self.y + s * other.x + c * other.y,
                      self.yaw + other.yaw)

    def inverse(self) -> 'Pose2D':
        """Return the pose of the parent frame in this frame."""
        c, s = cos(self.yaw), sin(self.yaw)
        return Pose2D(-c * self.x - s * self.y, s * self.x - c * self.y, -self.yaw)


def from_yaw(yaw: float) -> Quaternion:
    """Return the rotation by `yaw` (rad) about the z axis."""
    return (0.0, 0.0, sin(yaw / 2.0), cos(yaw / 2.0))


def from_pitch(pitch: float) -> Quaternion:
    """Return the rotation by `pitch` (rad) about the y axis."""
    return (0.0, sin(pitch / 2.0), 0.0, cos(pitch / 2.0))


def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the rotation by q followed by the rotation by p (Hamilton product p q)."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
            pw * qw - px * qx - py * qy - pz * qz)


def axes(q: Quaternion) -> tuple[Vector, Vector, Vector]:
    """Return the unit vectors of a frame with orientation q, expressed in the parent frame."""
    x, y, z, w = q
    return ((1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
            (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
            (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)))


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Transform the vector v from a frame with orientation q to the parent frame."""
    ex, ey, ez = axes(q)
    return (v[0] * ex[0] + v[1] * ey[0] + v[2] * ez[0],
            v[0] * ex[1] + v[1] * ey[1] + v[2] * ez[1],
            v[0] * ex[2] + v[1] * ey[2] + v[2] * ez[2])
