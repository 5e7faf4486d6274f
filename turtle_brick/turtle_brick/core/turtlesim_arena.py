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

"""The arena of turtlesim: its size, its time step, and the poses of the turtles in it."""

from ctypes import c_float
from typing import NamedTuple


def float32(value: float) -> float:
    """Return the float32 nearest to a value, or infinity if the value is out of range."""
    return c_float(value).value


TICK = 0.001 * 16
"""Interval (s) between the poses of a turtle, which is also turtlesim's time step."""

ARENA_SIZE = float32(499 / 45)
"""Width and height (m) of the arena, which has 499 x 499 pixels. A pixel is 1/45 m wide."""

ARENA_CENTER = float32(ARENA_SIZE / 2)
"""x and y coordinates (m) of the arena's center."""


def nearest_in_arena(x: float, y: float) -> tuple[float, float]:
    """Return the point (m, world frame) inside the arena that is nearest to (x, y)."""
    return (0.0 if x < 0.0 else ARENA_SIZE if x > ARENA_SIZE else x,
            0.0 if y < 0.0 else ARENA_SIZE if y > ARENA_SIZE else y)


class TurtlePose(NamedTuple):
    """A pose published by turtlesim. Every number is a float32."""

    x: float
    """Distance (m) from the left wall to the turtle."""
    y: float
    """Distance (m) from the lower wall to the turtle."""
    theta: float
    """Heading (rad) in [-pi, pi), counterclockwise from +x."""
    linear_velocity: float
    """Commanded speed (m/s), which is never negative."""
    angular_velocity: float
    """Commanded turn rate (rad/s), counterclockwise."""
