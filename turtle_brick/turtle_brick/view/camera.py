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
Camera positions from which given points are visible. Pure.

A view has a fixed direction. Its camera takes the nearest position from which all points are in
the picture, and does not move while they stay there.
"""

from collections.abc import Sequence
from math import tan
from typing import NamedTuple

import numpy
from turtle_brick.core.geometry import Vector
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE

FIELD_OF_VIEW = 0.75
"""Vertical field of view (rad) of all cameras."""

MARGIN = 0.7
"""Margin (m) around each point, which must also be visible."""

NARROW_ASPECT = 0.8
"""Aspect ratio (width / height) below which the panel covers the lower part of the picture."""

FREE_FRACTION = 0.4
"""Fraction of the height above viser's panel in a narrow picture; the panel covers up to 60 %."""

NARROW_CORRECTION = (0.0, 0.0, -0.8)
"""Vector added to the view direction in a narrow picture, to look down more steeply."""

ZOOM_FRACTION = 1.0 / 60.0
"""Fraction of the remaining distance by which a camera zooms in per picture. It zooms out at
once."""


class View(NamedTuple):
    """A camera direction with optional points to look at."""

    direction: Vector
    """Direction of the view in the world frame. It must not be vertical."""
    fixed_points: Sequence[Vector] = ()
    """Points (m) to keep in the picture. If there are none, the camera follows moving objects."""

    def camera_pose(self, points: Sequence[Vector], aspect: float,
                    previous: Vector | None = None) -> tuple[Vector, Vector]:
        """
        Return the position (m) of the camera and the point (m) at which it looks.

        :param points: the points (m) in the world frame to keep in the picture, at least one
        :param aspect: width of the picture divided by its height
        :param previous: previous position of the camera (m), or None for a new view
        """
        is_narrow = aspect < NARROW_ASPECT
        axes = _camera_axes(
            numpy.add(self.direction, NARROW_CORRECTION) if is_narrow else self.direction)
        coordinates = axes @ numpy.transpose(points)
        depths = coordinates[2]
        top = tan(FIELD_OF_VIEW / 2.0)
        bottom = top * (1.0 - 2.0 * FREE_FRACTION) if is_narrow else -top
        slopes = ((-aspect * top, aspect * top), (bottom, top))
        # A camera at c and depth f shows a point at p and depth d if p - c lies between
        # low * (d - f) and high * (d - f), on both axes of the picture. For f = 0, c lies between:
        bounds = [(max(across - high * depths) + MARGIN, min(across - low * depths) - MARGIN)
                  for across, (low, high) in zip(coordinates, slopes)]
        depth = min((upper - lower) / (high - low)
                    for (lower, upper), (low, high) in zip(bounds, slopes))
        before = None if previous is None else axes @ previous
        if before is not None and before[2] < depth:
            depth = before[2] + ZOOM_FRACTION * (depth - before[2])
        bounds = [(lower + high * depth, upper + low * depth)
                  for (lower, upper), (low, high) in zip(bounds, slopes)]
        if before is None:
            across = [(lower + upper) / 2.0 for lower, upper in bounds]
        else:
            across = [min(max(coordinate, lower), upper)
                      for coordinate, (lower, upper) in zip(before, bounds)]
        position = axes.T @ (*across, depth)
        target = position + (depths.mean() - depth) * axes[2]
        return tuple(position), tuple(target)


NEAR_VIEW = View((1.0, 2.0, -0.5))
"""The robot and the brick from the side, slightly from above."""

TOP_VIEW = View((0.0, 1e-3, -1.0), [
    (x, y, 0.0) for x in (0.0, ARENA_SIZE) for y in (0.0, ARENA_SIZE)])
"""The whole arena from above, as in the window of turtlesim."""


def ground_point(origin: Vector, direction: Vector) -> tuple[float, float] | None:
    """Return x and y (m) of the point where a ray meets the ground, or None."""
    if direction[2] * origin[2] >= 0.0:
        return None
    length = -origin[2] / direction[2]
    return origin[0] + length * direction[0], origin[1] + length * direction[1]


def _camera_axes(direction: Vector | numpy.ndarray) -> numpy.ndarray:
    """Return the unit vectors right, up and forward of a camera with a direction, as rows."""
    forward = numpy.divide(direction, numpy.linalg.norm(direction))
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right /= numpy.linalg.norm(right)
    return numpy.array((right, numpy.cross(right, forward), forward))
