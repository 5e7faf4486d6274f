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
Where the scene is seen from, so that what matters is in the picture. Pure.

A camera keeps the direction of its view. Of all places from which it has some points in the
picture it takes the nearest; while it needs no other place it stays where it is.
"""

from collections.abc import Sequence
from math import tan
from typing import NamedTuple

import numpy
from turtle_brick.core.geometry import Vector
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE

FIELD_OF_VIEW = 0.75
"""Vertical angle (rad) of all cameras."""

ROOM = 0.7
"""What is to be seen around each point (m)."""

UPRIGHT = 0.8
"""In a picture narrower than this, in its heights, the panel may cover the lower part."""

FREE = 0.4
"""The share of its height that is free then: viser's panel takes up to 60 % of a narrow page."""

STEEPER = (0.0, 0.0, 0.8)
"""What is taken then from the direction of a view, so that one looks down on what is up there."""

NEARER = 1.0 / 60.0
"""How much of the way to where it could be the camera goes nearer from one picture to the next; it
goes back at once."""


class View(NamedTuple):
    """From which side one looks."""

    direction: Vector
    """Of the view; not straight down, where no side of the picture is up."""
    sights: Sequence[Vector] = ()
    """What it has in its picture (m), whatever else there is; if nothing, it is told what."""

    def camera(self, points: Sequence[Vector], aspect: float, before: Vector | None = None
               ) -> tuple[Vector, Vector]:
        """
        Return where the camera is (m) that has points in its picture, and what it looks at.

        :param points: in the world (m), at least one
        :param aspect: the picture's width in its heights
        :param before: where the camera was (m), None if it may be anywhere
        """
        is_upright = aspect < UPRIGHT
        forward = numpy.subtract(self.direction, STEEPER if is_upright else 0.0)
        forward /= numpy.linalg.norm(forward)
        right = numpy.cross(forward, (0.0, 0.0, 1.0))
        right /= numpy.linalg.norm(right)
        axes = numpy.array((right, numpy.cross(right, forward), forward))
        places = axes @ numpy.transpose(points)
        depths = places[2]
        high = tan(FIELD_OF_VIEW / 2.0)
        low = high * (1.0 - 2.0 * FREE) if is_upright else -high
        slopes = ((-aspect * high, aspect * high), (low, high))
        # Seen from depth f, a point at depth d is in the picture if place - c, of an axis across,
        # is from low * (d - f) to high * (d - f). So c, of the camera, has these bounds at f = 0:
        bounds = [((across - high * depths).max() + ROOM, (across - low * depths).min() - ROOM)
                  for across, (low, high) in zip(places, slopes)]
        depth = min((most - least) / (high - low)
                    for (least, most), (low, high) in zip(bounds, slopes))
        past = None if before is None else axes @ before
        if past is not None and past[2] < depth:
            depth = past[2] + NEARER * (depth - past[2])
        bounds = [(least + high * depth, most + low * depth)
                  for (least, most), (low, high) in zip(bounds, slopes)]
        centers = numpy.mean(bounds, axis=1) if past is None else [
            min(max(place, least), most) for place, (least, most) in zip(past, bounds)]
        position = axes.T @ (*centers, depth)
        target = position + (depths.mean() - depth) * axes[2]
        return tuple(position), tuple(target)


NEAR = View((1.0, 2.0, -0.5))
"""From aside, a little from above."""

ABOVE = View((0.0, 1e-3, -1.0), [
    (x, y, 0.0) for x in (0.0, ARENA_SIZE) for y in (0.0, ARENA_SIZE)])
"""Like turtlesim's window."""


def ground_under(origin: Vector, direction: Vector) -> tuple[float, float] | None:
    """Return where a ray (m) meets the plane z = 0, None where it does not."""
    if direction[2] * origin[2] >= 0.0:
        return None
    length = -origin[2] / direction[2]
    return origin[0] + length * direction[0], origin[1] + length * direction[1]
