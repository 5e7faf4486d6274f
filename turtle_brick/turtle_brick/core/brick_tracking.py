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
Track the motion of the brick from a sequence of positions.

`Fall` describes a free fall without drag, and `FallDetector` distinguishes a fall from other
motions. `BrickTracker` also records whether the brick has landed on the platform, and measures the
time since the brick last moved. All timestamps (ns) come from the same clock.
"""

from collections import deque
from math import dist, hypot, inf, nan, sqrt
from typing import NamedTuple

from turtle_brick.core.geometry import Vector
from turtle_brick.core.time_steps import NS_PER_SECOND, SECONDS_PER_NS

POSITION_TOLERANCE = 1e-9
"""Maximum position error (m) caused by interpolation in tf2."""

RESTING_TOLERANCE = 0.01
"""Maximum deviation (m) of a brick on the platform from its resting height."""


class Fall(NamedTuple):
    """Position and speed of a falling brick at a given time."""

    stamp: int
    """Time (ns)."""
    position: Vector
    """Position (m) of the brick's center in the world frame."""
    speed: float
    """Downward speed (m/s)."""

    def height(self, stamp: int, gravity: float) -> float:
        """Return the predicted z coordinate (m) of the brick's center at a given time (ns)."""
        time = (stamp - self.stamp) * SECONDS_PER_NS
        return self.position[2] - self.speed * time - 0.5 * gravity * time * time

    def release_time(self, gravity: float) -> int:
        """Return the estimated time (ns) at which the brick was released."""
        return self.stamp - round(self.speed / gravity * NS_PER_SECOND)

    def time_to(self, height: float, gravity: float) -> float:
        """
        Return the time (s) from `stamp` until the brick reaches a given height (m).

        The time is negative if the brick has already passed this height, and NaN if the fall began
        below this height.
        """
        square = self.speed * self.speed + 2.0 * gravity * (self.position[2] - height)
        return nan if square < 0.0 else (sqrt(square) - self.speed) / gravity


class FallDetector:
    """
    Detect free fall in a sequence of positions.

    A fall is detected when three consecutive positions lie on a vertical line and the acceleration
    computed from them matches gravity. At 250 positions per second, detection takes at most 12 ms
    from the release. The fall ends when a position deviates from the predicted course.
    """

    ACCELERATION_TOLERANCE = 0.1
    """Maximum relative deviation of a brick's measured acceleration from gravity during a fall."""

    SIDEWAYS_FRACTION = 0.01
    """Maximum ratio of sideways motion to vertical motion in a fall. This limit excludes slides on
    slopes steeper than 72 degrees, which ACCELERATION_TOLERANCE does not exclude."""

    SIDEWAYS_TOLERANCE = 1e-4
    """Maximum sideways motion (m) between two consecutive positions in a fall."""

    COURSE_TOLERANCE = 0.01
    """Maximum deviation (m) of a falling brick from its predicted height."""

    def __init__(self, gravity: float) -> None:
        """Create a fall detector for a given gravitational acceleration (m/s^2)."""
        self.gravity = gravity
        self.fall: Fall | None = None
        """Current fall, or None if the brick is not falling."""
        self._samples: deque[tuple[int, float, float, float]] = deque(maxlen=3)

    def observe(self, stamp: int, position: Vector) -> None:
        """Record a position (m) and its time (ns, newer than the last one), and update `fall`."""
        x, y, z = position
        samples = self._samples
        if samples:
            _, last_x, last_y, _ = samples[-1]
            sideways = abs(x - last_x) + abs(y - last_y)
            off_course = 0.0 if self.fall is None else (
                abs(self.fall.height(stamp, self.gravity) - z))
            if sideways > self.SIDEWAYS_TOLERANCE or off_course > self.COURSE_TOLERANCE:
                samples.clear()
                self.fall = None
        samples.append((stamp, x, y, z))
        if self.fall is None and len(samples) == 3 and z < samples[-2][3]:
            self.fall = self._detect()

    def _detect(self) -> Fall | None:
        (t0, x0, y0, z0), (t1, _, _, z1), (t2, x2, y2, z2) = self._samples
        if z0 <= z1 or hypot(x2 - x0, y2 - y0) > self.SIDEWAYS_FRACTION * (z0 - z2):
            return None
        first, second = (t1 - t0) * SECONDS_PER_NS, (t2 - t1) * SECONDS_PER_NS
        speed_before, speed_after = (z0 - z1) / first, (z1 - z2) / second
        acceleration = (speed_after - speed_before) / (0.5 * (first + second))
        if abs(acceleration - self.gravity) > self.ACCELERATION_TOLERANCE * self.gravity:
            return None
        return Fall(t2, (x2, y2, z2), speed_after + 0.5 * self.gravity * second)


class BrickTracker:
    """Record the positions of the brick, and detect its falls and landings."""

    def __init__(self, gravity: float, resting_height: float) -> None:
        """
        Create a tracker for a brick that has not been observed yet.

        :param gravity: gravitational acceleration (m/s^2)
        :param resting_height: height (m) of the center of a brick on the level platform
        """
        self.position: Vector = (inf, inf, inf)
        """Latest position (m) of the brick's center in the world frame, initially infinite."""
        self.has_landed = False
        """Whether the brick has landed on the platform and is still there."""
        self._resting_height = resting_height
        self._detector = FallDetector(gravity)
        self._is_attached = False
        self._stamp = -1
        self._last_motion = 0

    @property
    def fall(self) -> Fall | None:
        """Get the current fall, or None if the brick is not falling."""
        return self._detector.fall

    @property
    def is_falling_to_platform(self) -> bool:
        """Return whether the brick is falling and still higher than on the platform."""
        return (self.fall is not None
                and self.position[2] > self._resting_height - RESTING_TOLERANCE)

    @property
    def still_for(self) -> float:
        """Get the time (s) since the brick last moved."""
        return (self._stamp - self._last_motion) * SECONDS_PER_NS

    def observe(self, stamp: int, position: Vector, is_attached: bool = False) -> None:
        """
        Record a position of the brick, unless it is not newer than the last one.

        :param stamp: timestamp (ns) of the position
        :param position: position (m) of the brick's center in the world frame
        :param is_attached: whether the platform is the parent frame of the brick
        """
        if stamp <= self._stamp:
            return
        fall = self.fall
        self._detector.observe(stamp, position)
        is_at_rest = abs(position[2] - self._resting_height) <= RESTING_TOLERANCE
        has_just_landed = is_at_rest and self._has_ended_on_platform(fall, stamp, self.position)
        # A brick that stops being a child of the platform has left it.
        stays = is_at_rest and self.has_landed and not self._is_attached
        self.has_landed = is_attached or has_just_landed or stays
        if (is_attached != self._is_attached
                or dist(position, self.position) > POSITION_TOLERANCE):
            self._last_motion = stamp
            self.position = position
        self._stamp, self._is_attached = stamp, is_attached

    def _has_ended_on_platform(self, fall: Fall | None, stamp: int, previous: Vector) -> bool:
        """
        Return whether a fall that was in progress ended on the platform before `stamp` (ns).

        :param previous: position (m) of the brick before `stamp`
        """
        return (fall is not None and self.fall is None
                and previous[2] > self._resting_height - RESTING_TOLERANCE
                and fall.height(stamp, self._detector.gravity)
                < self._resting_height + RESTING_TOLERANCE)
