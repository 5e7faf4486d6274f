# SPDX-License-Identifier: Apache-2.0
"""
Define the arena size, poses, and functions for vectors (m) and rotations.

Quaternions have unit length and the order (x, y, z, w), as in ROS. All angles are in rad.
"""

from collections.abc import Iterable, Sequence
from math import atan2, cos, hypot, sin
from typing import Any, NamedTuple

import numpy
from numpy.typing import NDArray

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Array = NDArray[numpy.float64]

ARENA_SIZE = 499.0 / 45.0
"""Side length (m) of the arena (499 turtlesim pixels at 45 pixels per meter)."""
CENTER = (ARENA_SIZE / 2.0, ARENA_SIZE / 2.0)
"""Center (m) of the arena, where turtlesim places the first turtle."""
X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)
"""Unit vectors of the x, y and z axes."""
IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)
"""The rotation of an unrotated frame."""


class Pose(NamedTuple):
    """Position (m) and orientation (unit quaternion) of a child frame in its parent frame."""

    position: Vector
    orientation: Quaternion = IDENTITY

    @property
    def axes(self) -> Array:
        """Return the rotation matrix (columns: unit vectors of the child's x, y and z axes)."""
        x, y, z, w = self.orientation
        return numpy.array((
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))))

    @property
    def upright(self) -> Array:
        """Return the unit vector of the child frame's z axis in the parent frame."""
        return self.axes[:, 2]

    def transform(self, points: Any) -> Array:
        """Transform points (one per row) from the child frame to the parent frame."""
        return self.position + points @ self.axes.T

    def locate(self, points: Any) -> Array:
        """Transform points (one per row) from the parent frame to the child frame."""
        return numpy.subtract(points, self.position) @ self.axes

    def compose(self, inner: 'Pose') -> 'Pose':
        """Transform a pose from the child frame to the parent frame."""
        x, y, z = rotate(self.orientation, inner.position)
        return Pose((self.position[0] + x, self.position[1] + y, self.position[2] + z),
                    multiply(self.orientation, inner.orientation))


ORIGIN = Pose((0.0, 0.0, 0.0))
"""Pose at the origin of a frame, without rotation."""


def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the rotation by q followed by the rotation by p (Hamilton product p q)."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
            pw * qw - px * qx - py * qy - pz * qz)


def rotate(quaternion: Quaternion, vector: Vector) -> Vector:
    """Return a vector rotated by a unit quaternion."""
    x, y, z, w = quaternion
    vx, vy, vz = vector
    # Rodrigues' rotation formula: v + w t + (x, y, z) × t, where t = 2 (x, y, z) × v
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return (vx + w * tx + y * tz - z * ty,
            vy + w * ty + z * tx - x * tz,
            vz + w * tz + x * ty - y * tx)


def normalize(quaternion: Quaternion) -> Quaternion:
    """Return a quaternion scaled to unit length. Like rviz2, read zero as no rotation."""
    length = hypot(*quaternion)
    x, y, z, w = quaternion
    return (x / length, y / length, z / length, w / length) if length else IDENTITY


def turn(axis: Iterable[float], angle: float) -> Quaternion:
    """Return the rotation by an angle (rad) about a unit vector."""
    x, y, z = (sin(angle / 2.0) * component for component in axis)
    return (x, y, z, cos(angle / 2.0))


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by three angles (rad) about the fixed x, y and z axes (REP 103)."""
    return multiply(turn(Z, yaw), multiply(turn(Y, pitch), turn(X, roll)))


def interpolate(start: Pose, end: Pose, fraction: float) -> Pose:
    """Interpolate between two poses at a given fraction (0 to 1)."""
    x, y, z = (a + fraction * (b - a) for a, b in zip(start.position, end.position))
    # Quaternions with opposite signs represent the same rotation.
    alike = sum(a * b for a, b in zip(start.orientation, end.orientation))
    sign = -1.0 if alike < 0.0 else 1.0
    qx, qy, qz, qw = (a + fraction * (sign * b - a)
                      for a, b in zip(start.orientation, end.orientation))
    return Pose((x, y, z), normalize((qx, qy, qz, qw)))


def angle_between(a: Array, b: Array) -> float:
    """Return the angle (rad) between two vectors of approximately equal length."""
    return 2.0 * atan2(hypot(*(a - b)), hypot(*(a + b)))


def inclination(frame: Pose) -> float:
    """Return the angle (rad) between the z axis of a frame and the vertical."""
    return angle_between(frame.upright, numpy.array(Z))


def distance_to_rectangle(center: Iterable[float], yaw: float, size: Sequence[float]) -> float:
    """Return the distance (m) from the origin to a rectangle with a given center and yaw (rad)."""
    x, y = center
    along = abs(x * cos(yaw) + y * sin(yaw)) - size[0] / 2.0
    across = abs(y * cos(yaw) - x * sin(yaw)) - size[1] / 2.0
    return hypot(max(along, 0.0), max(across, 0.0))
