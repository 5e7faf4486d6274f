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

from turtle_brick.physics import Phase


class Account:
    """
    What the robot does about the brick, as far as the topics tell.

    Messages of different topics come in any order: a verdict may come before the brick is said to
    fall. So it stands until the next brick hovers, or this one is caught.
    """

    def __init__(self) -> None:
        """Begin with nothing known."""
        self.phase: Phase | None = None
        """What the brick does, None if that is unknown."""
        self._state = ''
        self._unreachable = False
        self._reason = ''
        self._pursued = False

    def see_phase(self, phase: Phase | None) -> None:
        """Note what the brick does; None if that is unknown."""
        if phase in (Phase.HOVERING, Phase.RIDING):
            self._unreachable = self._pursued = False
            self._reason = ''
        self.phase = phase

    def see_unreachable(self) -> None:
        """Note that the brick is declared unreachable."""
        self._unreachable = True

    def see_state(self, text: str) -> None:
        """Note what the catcher does, in its own words, which not every catcher publishes."""
        self._state, _, reason = text.partition(': ')
        if self._state == 'unreachable':
            self._unreachable, self._reason = True, reason
        elif self._state == 'approaching':
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
            return f'Caught: {self._state}' if self._state in ('carrying', 'tilting') else 'Caught'
        if self.phase is Phase.GROUNDED and self._pursued:
            return 'Missed: it fell to the ground'
        return 'Waiting for a brick to fall'
