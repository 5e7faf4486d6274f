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
The recent transforms of one frame, by time; without ROS.

A transform is a tuple (parent, x, y, z, qx, qy, qz, qw): a point p of the frame is at
q p q* + (x, y, z) in its parent. Times are integers in ns.
"""

from bisect import bisect_right
from math import acos, sin, sqrt
from typing import Any

Rotation = tuple[float, float, float, float]
Entry = tuple[Any, float, float, float, float, float, float, float]

# How many expired transforms may pile up before they are really removed.
_COMPACTION = 512


class NoDataError(Exception):
    """The cache has no transform for a time; the text says why."""


def display_time(time: int) -> str:
    """Write a time in s as tf2 does."""
    seconds, nanoseconds = divmod(time, 1_000_000_000)
    return f'{seconds + 1e-9 * nanoseconds:.6f}'


def canonical(x: float, y: float, z: float, w: float) -> Rotation:
    """
    Choose the length and the sign of a quaternion as tf2 does, by way of a rotation matrix.

    :return: The unit quaternion of the same rotation with a positive w, if that exceeds 1/2, or
        else with a positive largest component of x, y and z.
    """
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    square = xx + yy + zz + ww
    if 4.0 * ww > square:
        sign = w
    elif xx < yy:
        sign = z if yy < zz else y
    else:
        sign = z if xx < zz else x
    if square == 1.0:
        return (x, y, z, w) if sign > 0.0 else (-x, -y, -z, -w)
    scale = 1.0 / sqrt(square) if sign > 0.0 else -1.0 / sqrt(square)
    return (x * scale, y * scale, z * scale, w * scale)


def interpolate(one: Entry, two: Entry, ratio: float) -> Entry:
    """Return the transform between two, on a straight line and by the shortest rotation."""
    parent, x1, y1, z1, qx1, qy1, qz1, qw1 = one
    _, x2, y2, z2, qx2, qy2, qz2, qw2 = two
    rest = 1.0 - ratio
    x = rest * x1 + ratio * x2
    y = rest * y1 + ratio * y2
    z = rest * z1 + ratio * z2
    cosine = qx1 * qx2 + qy1 * qy2 + qz1 * qz2 + qw1 * qw2
    half_angle = acos(min(1.0, abs(cosine)))
    if half_angle == 0.0:
        return (parent, x, y, z, qx1, qy1, qz1, qw1)
    a = sin(rest * half_angle) / sin(half_angle)
    b = sin(ratio * half_angle) / sin(half_angle)
    if cosine < 0.0:
        b = -b
    return (parent, x, y, z,
            a * qx1 + b * qx2, a * qy1 + b * qy2, a * qz1 + b * qz2, a * qw1 + b * qw2)


class StaticCache:
    """The one transform of a frame that does not move."""

    latest_time = oldest_time = 0
    length = 1

    def insert(self, _time: int, entry: Entry) -> bool:
        """Set the transform."""
        self._entry = entry
        return True

    def get(self, _time: int) -> Entry:
        """Return the transform, which holds at any time."""
        return self._entry

    def latest(self) -> tuple[int, Any]:
        """Return zero, a time that limits no common time, and the parent."""
        return 0, self._entry[0]

    def clear(self) -> None:
        """Keep the transform: what is static stays."""


class TimeCache:
    """The transforms of a moving frame, as far back as the cache's length."""

    def __init__(self, max_age: int) -> None:
        """Make an empty cache that goes so far back from its latest transform."""
        self._max_age = max_age
        # Both in the order of time, and valid from start on: what has expired before it is
        # removed many at a time, which costs a list nothing in the long run.
        self._times: list[int] = []
        self._entries: list[Entry] = []
        self._start = 0

    @property
    def length(self) -> int:
        """Return the number of transforms."""
        return len(self._times) - self._start

    @property
    def latest_time(self) -> int:
        """Return the time of the latest transform; zero if there is none."""
        return self._times[-1] if self._times else 0

    @property
    def oldest_time(self) -> int:
        """Return the time of the oldest transform; zero if there is none."""
        return self._times[self._start] if self._times else 0

    def latest(self) -> tuple[int, Any]:
        """Return the latest time and the parent then; zero and None if there is none."""
        return (self._times[-1], self._entries[-1][0]) if self._times else (0, None)

    def clear(self) -> None:
        """Forget everything."""
        self._times.clear()
        self._entries.clear()
        self._start = 0

    def insert(self, time: int, entry: Entry) -> bool:
        """Add a transform, unless it is there already; return whether it is recent enough."""
        times = self._times
        if times:
            oldest_allowed = times[-1] - self._max_age
            # As in tf2, what the previous transform made too old goes before a new one is added.
            self._expire(oldest_allowed)
            if time < oldest_allowed:
                return False
        index = bisect_right(times, time, self._start)
        same = index
        while same > self._start and times[same - 1] == time:
            same -= 1
            if self._entries[same] == entry:
                return True
        times.insert(index, time)
        self._entries.insert(index, entry)
        return True

    def _expire(self, oldest_allowed: int) -> None:
        start = self._start
        while self._times[start] < oldest_allowed:
            start += 1
        if start >= _COMPACTION:
            del self._times[:start], self._entries[:start]
            start = 0
        self._start = start

    def get(self, time: int) -> Entry:
        """
        Return the transform at a time, interpolated where it lies between two.

        :raises NoDataError: The time is not covered by the cache.
        """
        times = self._times
        if not times:
            raise NoDataError('')
        oldest, latest = times[self._start], times[-1]
        if time == latest:
            return self._entries[-1]
        if self.length == 1:
            raise NoDataError(f'Lookup would require extrapolation at time {display_time(time)}, '
                              f'but only time {display_time(oldest)} is in the buffer')
        if time > latest:
            raise NoDataError(
                'Lookup would require extrapolation into the future.  Requested time '
                f'{display_time(time)} but the latest data is at time {display_time(latest)}')
        if time < oldest:
            raise NoDataError(
                'Lookup would require extrapolation into the past.  Requested time '
                f'{display_time(time)} but the earliest data is at time {display_time(oldest)}')
        if time == oldest:
            return self._entries[self._start]
        index = bisect_right(times, time, self._start)
        one, two = self._entries[index - 1:index + 1]
        if one[0] is not two[0]:
            return one
        earlier = times[index - 1]
        return interpolate(one, two, (time - earlier) / (times[index] - earlier))
