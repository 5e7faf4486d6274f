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

"""Where a camera sees a point: of the page in the browser, and of rviz2."""

import numpy
from turtle_brick.core.geometry import Vector


def seen_from(position: Vector, look_at: Vector, field_of_view: float, point: Vector
              ) -> tuple[float, float]:
    """
    Return how far right of and above the middle of the picture a point is, in its heights.

    :param position: of the camera (m)
    :param look_at: the point (m) in the picture's middle
    :param field_of_view: the camera's vertical angle (rad)
    :param point: in front of the camera (m)
    """
    forward = numpy.subtract(look_at, position)
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right /= numpy.linalg.norm(right)
    ray = numpy.subtract(point, position)
    depth = ray @ forward
    assert depth > 0.0
    height = 2.0 * numpy.tan(field_of_view / 2.0) * depth
    return ray @ right / height, ray @ numpy.cross(right, forward) / height
