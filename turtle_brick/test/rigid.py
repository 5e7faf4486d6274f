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
"""Rotations and frames as unit vectors, independent of the quaternions in the package."""

from math import atan2, cos, hypot, sin
from typing import NamedTuple

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def rotated(vector, axis, angle):
    """Rotate a vector by an angle (rad) about a unit vector (Rodrigues)."""
    c, s = cos(angle), sin(angle)
    along = (1.0 - c) * dot(axis, vector)
    return tuple(c * v + s * w + along * a
                 for v, w, a in zip(vector, cross(axis, vector), axis))


def axes_of(quaternion):
    """Return the axes x, y and z after a rotation by a unit quaternion (x, y, z, w)."""
    *vector, w = quaternion
    length = hypot(*vector)
    axis = [part / length for part in vector] if length else Z
    return Frame().turned(axis, 2.0 * atan2(length, w)).axes


class Frame(NamedTuple):
    """Position (m) of a frame in its parent frame, and its axes as unit vectors there."""

    position: tuple = (0.0, 0.0, 0.0)
    axes: tuple = (X, Y, Z)

    def transform_vector(self, vector):
        """Convert a vector in this frame to the parent frame."""
        return tuple(dot(vector, row) for row in zip(*self.axes))

    def transform(self, point):
        """Convert a point (m) in this frame to the parent frame."""
        return tuple(map(sum, zip(self.position, self.transform_vector(point))))

    def compose(self, inner):
        return Frame(self.transform(inner.position),
                     tuple(map(self.transform_vector, inner.axes)))

    def turned(self, axis, angle):
        """Turn this frame by an angle (rad) about a unit vector in this frame."""
        return self.compose(Frame(axes=tuple(rotated(one, axis, angle) for one in (X, Y, Z))))


def distance_to_rectangle(center, yaw, size):
    """Return the distance (m) from the origin to a rectangle with a given center and yaw (rad)."""
    x, y, _ = rotated((*center, 0.0), Z, -yaw)
    return hypot(max(abs(x) - size[0] / 2.0, 0.0), max(abs(y) - size[1] / 2.0, 0.0))
