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

"""Ctrl-C and SIGTERM as a KeyboardInterrupt that comes only where it does no harm. No ROS."""

import signal
from types import FrameType


class Interrupts:
    """
    Ctrl-C and SIGTERM raise KeyboardInterrupt, but not in the middle of what can't bear it.

    Only the first one counts: a terminal's Ctrl-C under `ros2 launch` is two signals, one from
    the terminal and one from launch, and the second must not disturb the clean-up.
    """

    NUMBERS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        """Change nothing yet."""
        self._held = 0
        self._came = False
        self._put_off = False

    def take_over(self) -> None:
        """Handle the signals from now on."""
        for number in self.NUMBERS:
            signal.signal(number, self._on_signal)

    def ignore(self) -> None:
        """Let no signal disturb the rest of the process, the interpreter's own end included."""
        for number in self.NUMBERS:
            signal.signal(number, signal.SIG_IGN)

    def held(self) -> 'Interrupts':
        """Return a context that puts off what comes meanwhile to its end."""
        return self

    def __enter__(self) -> None:
        """Put off what comes from now on."""
        self._held += 1

    def __exit__(self, error: type | None, *_: object) -> None:
        """Raise what was put off, unless an error is on its way, which matters more."""
        self._held -= 1
        if self._put_off and not self._held and error is None:
            self._put_off = False
            raise KeyboardInterrupt

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._came:
            return
        self._came = True
        if not self._held:
            raise KeyboardInterrupt
        self._put_off = True


INTERRUPTS = Interrupts()
"""Those of this process: signals belong to the process, not to a part of it."""
