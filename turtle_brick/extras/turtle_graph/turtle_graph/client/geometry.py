# SPDX-License-Identifier: Apache-2.0
"""Define the arena size and numpy functions for poses (m) and angles (rad)."""

from collections.abc import Iterable, Sequence
from math import atan2, cos, hypot, sin
from typing import Any, NamedTuple

import numpy
from numpy.typing import NDArray

Vector = tuple[float, float, float]
Array = NDArray[numpy.float64]

ARENA_SIZE = 499.0 / 45.0
"""Side length (m) of the arena (499 turtlesim pixels at 45 pixels per meter)."""
CENTER = (ARENA_SIZE / 2.0, ARENA_SIZE / 2.0)
"""Center (m) of the arena, where turtlesim places the first turtle."""
UPRIGHT: Array = numpy.eye(3)
"""Rotation matrix of an unrotated frame."""


class Pose(NamedTuple):
    """Pose of a child frame in its parent frame."""

    position: Array  # Position (m) of the origin.
    axes: Array  # Rotation matrix (columns: unit vectors of the x, y and z axes).

    def transform(self, points: Any) -> Array:
        """Transform points (one per row) from the child frame to the parent frame."""
        return self.position + points @ self.axes.T

    def locate(self, points: Any) -> Array:
        """Transform points (one per row) from the parent frame to the child frame."""
        return (points - self.position) @ self.axes

    def compose(self, inner: 'Pose') -> 'Pose':
        """Transform a pose from the child frame to the parent frame."""
        return Pose(self.transform(inner.position), self.axes @ inner.axes)

    @property
    def upright(self) -> Array:
        """Return the unit vector of the child frame's z axis in the parent frame."""
        return self.axes[:, 2]


def pose(position: Sequence[float], quaternion: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Pose:
    """Return the pose for a position (m) and a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    return Pose(numpy.array(position, float), numpy.array((
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))))


def turn(axis: Iterable[float], angle: float) -> Array:
    """Return the matrix of a rotation by an angle (rad) about a unit vector."""
    x, y, z = (sin(angle / 2.0) * component for component in axis)
    return pose((0.0, 0.0, 0.0), (x, y, z, cos(angle / 2.0))).axes


def angle_between(a: Array, b: Array) -> float:
    """Return the angle (rad) between two vectors of approximately equal length."""
    return 2.0 * atan2(hypot(*(a - b)), hypot(*(a + b)))


def inclination(frame: Pose) -> float:
    """Return the angle (rad) between the z axis of a frame and the vertical."""
    return angle_between(frame.upright, UPRIGHT[2])


def distance_to_rectangle(center: Iterable[float], yaw: float, size: Sequence[float]) -> float:
    """Return the distance (m) from the origin to a rectangle with a given center and yaw (rad)."""
    x, y = center
    along = abs(x * cos(yaw) + y * sin(yaw)) - size[0] / 2.0
    across = abs(y * cos(yaw) - x * sin(yaw)) - size[1] / 2.0
    return hypot(max(along, 0.0), max(across, 0.0))
