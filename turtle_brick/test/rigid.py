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
"""Rotations and frames as matrices, independent of the quaternions in the package."""

from math import cos, hypot, sin
from typing import NamedTuple

import numpy


def cross_matrix(vector):
    """Return the matrix whose product with another vector is the cross product."""
    x, y, z = vector
    return numpy.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def turn(axis, angle):
    """Return the matrix of a rotation by an angle (rad) about a unit vector (Rodrigues)."""
    cross = cross_matrix(axis)
    return numpy.eye(3) + sin(angle) * cross + (1.0 - cos(angle)) * cross @ cross


def matrix_of(quaternion):
    """Return the rotation matrix of a unit quaternion (x, y, z, w)."""
    cross = cross_matrix(quaternion[:3])
    return numpy.eye(3) + 2.0 * quaternion[3] * cross + 2.0 * cross @ cross


class Frame(NamedTuple):
    """Position (m) and rotation matrix of a frame in its parent frame."""

    position: tuple
    axes: numpy.ndarray

    def transform(self, point):
        return numpy.add(self.position, self.axes @ point)

    def compose(self, inner):
        return Frame(self.transform(inner.position), self.axes @ inner.axes)


def distance_to_rectangle(center, yaw, size):
    """Return the distance (m) from the origin to a rectangle with a given center and yaw (rad)."""
    corner = numpy.abs(turn((0.0, 0.0, 1.0), -yaw)[:2, :2] @ center) - numpy.array(size) / 2.0
    return hypot(*numpy.maximum(corner, 0.0))
