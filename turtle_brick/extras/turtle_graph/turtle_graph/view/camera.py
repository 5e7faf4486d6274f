# SPDX-License-Identifier: Apache-2.0

"""
Compute camera positions from which given points are visible.

This module does not depend on ROS. Each view has a fixed direction. The camera moves only as far
as necessary to keep all points visible, and slowly moves closer when possible.
"""

from collections.abc import Sequence
from functools import cache
from math import tan
from typing import NamedTuple

import numpy
from turtle_graph.client.geometry import ARENA_SIZE, Vector

FIELD_OF_VIEW = 0.75
"""Vertical field of view (rad) of all cameras."""

MARGIN = 0.7
"""Margin (m) that remains visible around each point."""

NARROW_ASPECT = 0.8
"""Aspect ratio (width / height) below which the panel covers the lower part of the picture."""

FREE_FRACTION = 0.4
"""Fraction of a narrow picture, measured from the top, that the panel never covers."""

NARROW_CORRECTION = (0.0, 0.0, -0.8)
"""Vector added to the view direction in narrow pictures so that the camera looks down steeply."""

ZOOM_FRACTION = 1.0 / 40.0
"""Fraction of the remaining distance that a camera covers in one update as it moves closer."""


class View(NamedTuple):
    """A camera direction, and the points that must stay in view."""

    direction: Vector
    """View direction (not vertical) in the world frame."""
    fixed_points: Sequence[Vector] = ()
    """Points (m) in the arena to keep visible."""
    follows: bool = True
    """Whether the camera also keeps the robot and the brick visible."""

    def camera_pose(self, points: Sequence[Vector], aspect: float,
                    previous: Vector | None = None) -> tuple[Vector, Vector]:
        """
        Return the position (m) of the camera and the point (m) at the center of its picture.

        :param points: one or more points (m) in the world frame to keep in the picture
        :param aspect: width of the picture divided by its height
        :param previous: previous position (m) of the camera, or None for a new view
        """
        is_narrow = aspect < NARROW_ASPECT
        axes = _camera_axes(self.direction, is_narrow)
        coordinates = axes @ numpy.transpose(points)
        depths = coordinates[2]
        top = tan(FIELD_OF_VIEW / 2.0)
        bottom = top * (1.0 - 2.0 * FREE_FRACTION) if is_narrow else -top
        slopes = ((-aspect * top, aspect * top), (bottom, top))
        # On each picture axis, a camera (coordinate c, depth f) shows a point (coordinate p,
        # depth d) if low * (d - f) < p - c < high * (d - f). The bounds below limit c for f = 0.
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


CORNERS = [(x, y, 0.0) for x in (0.0, ARENA_SIZE) for y in (0.0, ARENA_SIZE)]
"""Corners (m) of the arena."""

ARENA_VIEW = View((-3.0, 16.0, -7.0), CORNERS)
"""View of the whole arena, the robot and the brick, from the same direction as on the website."""

NEAR_VIEW = View((1.0, 2.0, -0.5))
"""View of the robot and the brick from the side and from slightly above."""

TOP_VIEW = View((0.0, 1e-3, -1.0), CORNERS, follows=False)
"""View of the whole arena from above, as in the turtlesim window."""


def ground_point(origin: Vector, direction: Vector) -> tuple[float, float] | None:
    """Return x and y (m) of the point where a ray hits the ground, or None if the ray misses."""
    if direction[2] * origin[2] >= 0.0:
        return None
    length = -origin[2] / direction[2]
    return origin[0] + length * direction[0], origin[1] + length * direction[1]


@cache
def _camera_axes(direction: Vector, is_narrow: bool) -> numpy.ndarray:
    """Return a matrix whose rows are the right, up and forward unit vectors of a camera."""
    forward = numpy.add(direction, NARROW_CORRECTION if is_narrow else (0.0, 0.0, 0.0))
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right /= numpy.linalg.norm(right)
    return numpy.array((right, numpy.cross(right, forward), forward))
