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

"""The status of the current catch as text for the page. Pure."""


class CatchStatus:
    """
    The status of the current catch, derived from the topics of arena and catcher.

    Messages on different topics arrive in any order. A decision can arrive before the brick is
    reported as falling, so it stays valid until a brick hovers or rides.
    """

    def __init__(self) -> None:
        """Start without known states."""
        self.brick_state = ''
        self.catcher_state = ''
        self._decision = ''
        self._reason = ''

    def on_brick_state(self, state: str) -> None:
        """Record the state of the brick."""
        self.brick_state = state
        if state in ('hovering', 'riding'):
            self._decision = self._reason = ''

    def on_decision(self, text: str) -> None:
        """Record a decision of the catcher: 'reachable: …' or 'unreachable: …'."""
        self._decision, _, self._reason = text.partition(': ')

    @property
    def is_unreachable(self) -> bool:
        """Return whether a brick that is falling or on the ground was declared unreachable."""
        return self._decision == 'unreachable' and self.brick_state in ('falling', 'grounded')

    @property
    def text(self) -> str:
        """Return the status as one line of text."""
        match self.brick_state, self._decision:
            case 'falling', 'reachable':
                return 'Reachable: driving under the brick'
            case 'falling', 'unreachable':
                return f'Unreachable: {self._reason}'
            case 'falling', _:
                return 'The brick is falling'
            case 'grounded', 'reachable':
                return 'Missed: the brick fell to the ground'
            case 'grounded', 'unreachable':
                return f'The unreachable brick fell to the ground: {self._reason}'
            case 'riding', _ if self.catcher_state in ('carrying', 'tilting'):
                return f'Caught: {self.catcher_state}'
            case 'riding', _:
                return 'Caught'
        return 'Waiting for a brick to fall'
