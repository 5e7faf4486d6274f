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
Track the brick with its positions.

`BrickTracker` remembers what the catcher has to know about the brick: whether it is falling,
whether it has landed on the platform, and for how long it has been still. All timestamps (ns) come
from one clock.
"""

from math import dist, inf

from turtle_brick.core.fall_detection import Fall, FallDetector
from turtle_brick.core.geometry import Vector
from turtle_brick.core.time_steps import SECONDS_PER_NS

POSITION_TOLERANCE = 1e-9
"""Maximum apparent motion (m) of an object at rest, caused by interpolation in tf2."""

HEIGHT_TOLERANCE = 0.01
"""Maximum difference (m) between the height of a brick on the platform and its resting height."""


class BrickTracker:
    """Record the positions of the brick."""

    def __init__(self, gravity: float, resting_height: float) -> None:
        """
        Create a tracker for a brick that has not been observed yet.

        :param gravity: gravitational acceleration (m/s^2)
        :param resting_height: height (m) of the center of a brick on the level platform
        """
        self.position: Vector = (inf, inf, inf)
        """Latest center (m) of the brick in the world frame, infinite before the first one."""
        self.has_landed = False
        """Whether the brick has landed on the platform and is still at its resting height."""
        self._resting_height = resting_height
        self._detector = FallDetector(gravity)
        self._is_attached = False
        self._stamp = 0
        self._last_motion = 0

    @property
    def fall(self) -> Fall | None:
        """Get the current fall, or None if the brick is not falling."""
        return self._detector.fall

    @property
    def is_falling_to_platform(self) -> bool:
        """Return whether the brick is falling and has not passed the platform yet."""
        return (self.fall is not None
                and self.position[2] > self._resting_height - HEIGHT_TOLERANCE)

    @property
    def still_for(self) -> float:
        """Get the time (s) for which the brick has not moved."""
        return (self._stamp - self._last_motion) * SECONDS_PER_NS

    def observe(self, stamp: int, position: Vector, is_attached: bool = False) -> None:
        """
        Record a position of the brick.

        :param stamp: timestamp (ns) of the position
        :param position: center (m) of the brick in the world frame
        :param is_attached: whether the platform is the parent frame of the brick
        """
        fall, height_before = self.fall, self.position[2]
        self._detector.observe(stamp, position)
        # A brick that was above the platform has landed if its fall ends where the platform is.
        has_fallen = (fall is not None and self.fall is None
                      and height_before > self._resting_height - HEIGHT_TOLERANCE
                      and fall.height(stamp, self._detector.gravity)
                      < self._resting_height + HEIGHT_TOLERANCE)
        # The arena attaches a brick that rides. Only `place` detaches it at its resting height.
        was_detached = self._is_attached and not is_attached
        self.has_landed = (
            (is_attached or has_fallen or (self.has_landed and not was_detached))
            and abs(position[2] - self._resting_height) <= HEIGHT_TOLERANCE)
        if (stamp < self._stamp or is_attached != self._is_attached
                or dist(position, self.position) > POSITION_TOLERANCE):
            self._last_motion = stamp
            self.position = position
        self._stamp, self._is_attached = stamp, is_attached
