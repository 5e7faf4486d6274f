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
"""Where frames and things are, on numpy: lengths in m, angles in rad."""

from collections.abc import Iterable, Sequence
from math import atan2, cos, hypot, sin
from typing import Any, NamedTuple

import numpy
from numpy.typing import NDArray

Vector = tuple[float, float, float]
Array = NDArray[numpy.float64]

UPRIGHT: Array = numpy.eye(3)


class Pose(NamedTuple):
    """Where a frame is in another."""

    position: Array  # of its origin
    axes: Array  # its unit vectors x, y and z: the columns of a rotation matrix

    def transform(self, points: Any) -> Array:
        """Return a point of this frame, or a row for each of several, in the other frame."""
        return self.position + points @ self.axes.T

    def locate(self, points: Any) -> Array:
        """Return a point of the other frame, or a row for each of several, in this frame."""
        return (points - self.position) @ self.axes

    def compose(self, inner: 'Pose') -> 'Pose':
        """Return where a frame is in the other frame that is given in this one."""
        return Pose(self.transform(inner.position), self.axes @ inner.axes)

    @property
    def upright(self) -> Array:
        """Return its z axis."""
        return self.axes[:, 2]


def pose(position: Sequence[float], quaternion: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Pose:
    """Return a pose from a position and a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    return Pose(numpy.array(position, float), numpy.array((
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))))


def turn(axis: Iterable[float], angle: float) -> Array:
    """Return the rotation by an angle about a unit vector."""
    x, y, z = (sin(angle / 2.0) * part for part in axis)
    return pose((0.0, 0.0, 0.0), (x, y, z, cos(angle / 2.0))).axes


def blend(a: Pose, b: Pose, part: float) -> Pose:
    """Return a pose between two that are close to each other; part is from 0 to 1."""
    return Pose(*(p + part * (q - p) for p, q in zip(a, b)))


def between(a: Array, b: Array) -> float:
    """Return the angle between two vectors of about the same length."""
    return 2.0 * atan2(hypot(*(a - b)), hypot(*(a + b)))


def inclination(frame: Pose) -> float:
    """Return the angle between a frame's z axis and the vertical."""
    return between(frame.upright, UPRIGHT[2])


def distance_to_rectangle(center: Iterable[float], yaw: float, size: Sequence[float]) -> float:
    """Return how far a plane's origin is from a rectangle of a length (along yaw) and a width."""
    x, y = center
    along = abs(x * cos(yaw) + y * sin(yaw)) - size[0] / 2.0
    across = abs(y * cos(yaw) - x * sin(yaw)) - size[1] / 2.0
    return hypot(max(along, 0.0), max(across, 0.0))
