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
Recognize a falling brick from its positions.

`FallDetector` tells a fall from other motions; `Fall` is its course, that of free fall without
drag: z - v t - g t^2 / 2.
Instants are integer nanoseconds of one clock.
"""

from collections import deque
from math import hypot, nan, sqrt
from typing import NamedTuple

from turtle_brick.core.geometry import Vector
from turtle_brick.core.time_steps import SECONDS_PER_NS


class Fall(NamedTuple):
    """A fall: where and how fast the brick is at one instant of it."""

    stamp: int
    """The instant (ns)."""
    x: float
    """Position of the brick's center in the world (m), as y and z."""
    y: float
    z: float
    speed: float
    """Speed downward (m/s)."""

    @property
    def position(self) -> Vector:
        """Position of the brick at `stamp` in the world (m)."""
        return (self.x, self.y, self.z)

    def height(self, stamp: int, gravity: float) -> float:
        """Return how high (m) the brick is at an instant (ns) if nothing stops it."""
        time = (stamp - self.stamp) * SECONDS_PER_NS
        return self.z - self.speed * time - 0.5 * gravity * time * time

    def time_to(self, height: float, gravity: float) -> float:
        """
        Return the time (s) from `stamp` until the brick is down at a height (m).

        It is negative where the brick has passed the height, NaN where it was released below it.
        """
        square = self.speed * self.speed + 2.0 * gravity * (self.z - height)
        return (sqrt(square) - self.speed) / gravity if square >= 0.0 else nan


class FallDetector:
    """
    Recognize free fall in a sequence of positions.

    Three positions straight down, whose second divided difference is the acceleration due to
    gravity, are a fall. At 250 Hz it is known after 8 ms.
    """

    TOLERANCE = 0.1
    """Largest deviation of the acceleration from that due to gravity, as a part of it."""

    STRAIGHT = 0.01
    """Largest sideways part of a fall. A slide on a slope of more than 72 degrees has the right
    acceleration, within TOLERANCE, but is not straight."""

    SIDEWAYS = 1e-4
    """Largest sideways motion (m) between two positions of a fall."""

    DEVIATION = 0.01
    """Distance (m) from the predicted course at which the fall is over."""

    def __init__(self, gravity: float) -> None:
        """Know no position yet, but the acceleration due to gravity (m/s^2)."""
        self.gravity = gravity
        self.fall: Fall | None = None
        """The present fall, until the brick leaves its course."""
        self._samples: deque[tuple[int, float, float, float]] = deque(maxlen=3)

    def observe(self, stamp: int, x: float, y: float, z: float) -> bool:
        """
        Note where the brick was in the world (m) at an instant (ns).

        :return: Whether a new fall is recognized.
        """
        samples = self._samples
        if samples:
            last, x_last, y_last, _ = samples[-1]
            if stamp == last:
                return False
            if (stamp < last or abs(x - x_last) + abs(y - y_last) > self.SIDEWAYS
                    or self.fall is not None and self._is_off_course(self.fall, stamp, z)):
                samples.clear()
                self.fall = None
        samples.append((stamp, x, y, z))
        if self.fall is not None or len(samples) < 3 or z >= samples[-2][3]:
            return False
        self.fall = self._recognize()
        return self.fall is not None

    def _is_off_course(self, fall: Fall, stamp: int, z: float) -> bool:
        """Tell whether a height (m) at an instant (ns) is not on the course of a fall."""
        return abs(fall.height(stamp, self.gravity) - z) > self.DEVIATION

    def _recognize(self) -> Fall | None:
        """Return the fall of which the samples are a part, None if they aren't."""
        (t0, x0, y0, z0), (t1, _, _, z1), (t2, x2, y2, z2) = self._samples
        if not z0 > z1 or hypot(x2 - x0, y2 - y0) > self.STRAIGHT * (z0 - z2):
            return None
        first, second = (t1 - t0) * SECONDS_PER_NS, (t2 - t1) * SECONDS_PER_NS
        speed_before, speed_after = (z0 - z1) / first, (z1 - z2) / second
        acceleration = (speed_after - speed_before) / (0.5 * (first + second))
        if not abs(acceleration - self.gravity) <= self.TOLERANCE * self.gravity:
            return None
        return Fall(t2, x2, y2, z2, speed_after + 0.5 * self.gravity * second)
