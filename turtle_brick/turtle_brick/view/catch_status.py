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

"""The status of the current catch, in the words of the page. Pure."""

from turtle_brick.physics import Phase


class CatchStatus:
    """
    The status of the current catch, derived from three topics.

    Messages on different topics arrive in any order. A decision can arrive before the brick is
    reported as falling, so it stays valid until a brick hovers or rides.
    """

    def __init__(self) -> None:
        """Start with no known state."""
        self.phase: Phase | None = None
        """The phase of the brick, None if unknown."""
        self._catcher_state = ''
        self._decision = ''
        self._reason = ''

    def on_phase(self, phase: Phase | None) -> None:
        """Record the phase of the brick; None if it is unknown."""
        self.phase = phase
        if phase in (Phase.HOVERING, Phase.RIDING):
            self._decision = self._reason = ''

    def on_catcher_state(self, state: str) -> None:
        """Record the state of the catcher."""
        self._catcher_state = state

    def on_decision(self, text: str) -> None:
        """Record a decision of the catcher: 'reachable: …' or 'unreachable: …'."""
        self._decision, _, self._reason = text.partition(': ')

    @property
    def is_unreachable(self) -> bool:
        """Whether the brick that is falling, or fell, was declared unreachable."""
        return (self._decision == 'unreachable'
                and self.phase in (Phase.FALLING, Phase.GROUNDED))

    @property
    def text(self) -> str:
        """The status as one line of text."""
        is_reachable = self._decision == 'reachable'
        if self.phase is Phase.FALLING:
            if self.is_unreachable:
                return f'Unreachable: {self._reason}'
            return 'Reachable: driving under the brick' if is_reachable else 'The brick is falling'
        if self.phase is Phase.GROUNDED:
            if self.is_unreachable:
                return f'The unreachable brick fell to the ground: {self._reason}'
            if is_reachable:
                return 'Missed: the brick fell to the ground'
        if self.phase is Phase.RIDING:
            if self._catcher_state in ('carrying', 'tilting'):
                return f'Caught: {self._catcher_state}'
            return 'Caught'
        return 'Waiting for a brick to fall'
