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

"""What the robot does about the brick, in words, as far as the topics tell. Pure."""

from math import hypot

from turtle_brick.core.tilting_platform import LEVEL_TOLERANCE
from turtle_brick.physics import Phase


class Account:
    """What the robot does about the brick, as far as the topics tell."""

    UNDER = 0.05
    """How far (m) from the point below the brick a goal may be to count as catching it."""

    def __init__(self) -> None:
        """Begin with nothing known."""
        self.phase: Phase | None = None
        """What the brick does, None if that is unknown."""
        self.unreachable = False
        """Whether the brick was declared unreachable in its present or last fall."""
        self._goal: tuple[float, float] | None = None
        self._tilt = 0.0
        self._pursued = False

    def see_phase(self, phase: Phase | None) -> None:
        """Note what the brick does; None if that is unknown."""
        if phase is not self.phase:
            self.phase = phase
            self._goal = None
            if phase in (Phase.FALLING, Phase.HOVERING):
                self.unreachable = False
                self._pursued = False

    def see_goal(self, x: float, y: float, brick: tuple[float, float] | None) -> None:
        """Note that the robot is sent to a point of the world (m), and where the brick is."""
        self._goal = (x, y)
        if self.phase is Phase.FALLING and brick is not None:
            self._pursued = hypot(x - brick[0], y - brick[1]) <= self.UNDER

    def see_tilt(self, angle: float) -> None:
        """Note the angle (rad) that the platform is set to."""
        self._tilt = angle

    def see_unreachable(self) -> None:
        """Note that the brick is declared unreachable."""
        self.unreachable = True

    def sentence(self) -> str:
        """Return what the robot does, in words."""
        tilted = abs(self._tilt) > LEVEL_TOLERANCE
        if self.phase is Phase.FALLING:
            if self.unreachable:
                return 'Unreachable'
            return 'Reachable: driving under the brick' if self._pursued else 'The brick falls'
        if self.phase is Phase.RIDING:
            if tilted:
                return 'Tipping the brick off'
            if self._goal is not None:
                return 'Caught: carrying it to ({:.2f}, {:.2f})'.format(*self._goal)
            return 'Caught'
        if self.phase is Phase.GROUNDED and self.unreachable:
            return 'Unreachable: it fell to the ground'
        if self.phase is Phase.GROUNDED and self._pursued:
            return 'Missed: it fell to the ground'
        if tilted:
            return 'Tipped off' if self.phase is Phase.FLOATING else 'Platform tilted'
        return 'Waiting for a brick to fall'
