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
    """
    What the robot does about the brick, as far as the topics tell.

    Messages of different topics come in any order: a verdict may come before the brick is said to
    fall. So it stands until the next brick hovers, or this one is caught.
    """

    UNDER = 0.05
    """How far (m) from the point below the brick a goal may be to count as catching it."""

    def __init__(self) -> None:
        """Begin with nothing known."""
        self.phase: Phase | None = None
        """What the brick does, None if that is unknown."""
        self._unreachable = False
        self._reason = ''
        self._pursued = False
        self._goal: tuple[float, float] | None = None
        self._tilt = 0.0
        self._tipped = False

    def see_phase(self, phase: Phase | None) -> None:
        """Note what the brick does; None if that is unknown."""
        if phase is self.phase:
            return
        self.phase = phase
        if phase in (Phase.HOVERING, Phase.RIDING):
            self._unreachable = self._pursued = False
            self._reason = ''
        if phase not in (Phase.FALLING, Phase.RIDING):
            self._goal = None
        self._tipped = phase is Phase.FLOATING and self._is_tilted()

    def see_goal(self, x: float, y: float, brick: tuple[float, float] | None) -> None:
        """Note that the robot is sent to a point of the world (m), and where the brick is."""
        under = brick is not None and hypot(x - brick[0], y - brick[1]) <= self.UNDER
        if self.phase is Phase.RIDING or not under:
            self._goal = (x, y)
        elif self.phase is not Phase.GROUNDED:
            self._pursued = True

    def see_tilt(self, angle: float) -> None:
        """Note the angle (rad) that the platform is set to."""
        self._tilt = angle
        self._tipped = self._tipped and self._is_tilted()

    def see_unreachable(self) -> None:
        """Note that the brick is declared unreachable."""
        self._unreachable = True

    def see_state(self, state: str) -> None:
        """Note what the catcher does, in its own words."""
        word, _, reason = state.partition(': ')
        if word == 'unreachable':
            self._unreachable, self._reason = True, reason
        elif word == 'approaching':
            self._unreachable, self._pursued = False, True

    @property
    def alarm(self) -> bool:
        """Whether the brick that falls, or has fallen, was declared unreachable."""
        return self._unreachable and self.phase in (Phase.FALLING, Phase.GROUNDED)

    def sentence(self) -> str:
        """Return what the robot does, in words."""
        if self.alarm:
            fallen = ', it fell to the ground' if self.phase is Phase.GROUNDED else ''
            return f'Unreachable{fallen}{": " if self._reason else ""}{self._reason}'
        if self.phase is Phase.FALLING:
            return 'Reachable: driving under the brick' if self._pursued else 'The brick falls'
        if self.phase is Phase.RIDING:
            if self._is_tilted():
                return 'Tipping the brick off'
            if self._goal is not None:
                return 'Caught: carrying it to ({:.2f}, {:.2f})'.format(*self._goal)
            return 'Caught'
        if self.phase is Phase.GROUNDED and self._pursued:
            return 'Missed: it fell to the ground'
        if self._tipped:
            return 'Tipped off'
        return 'Platform tilted' if self._is_tilted() else 'Waiting for a brick to fall'

    def _is_tilted(self) -> bool:
        """Tell whether the platform is set to another angle than level."""
        return abs(self._tilt) > LEVEL_TOLERANCE
