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
    Ctrl-C and SIGTERM raise KeyboardInterrupt, but not inside `with held():`.

    Only the first one counts: Ctrl-C under `ros2 launch` is two signals, one from the terminal and
    one from launch, and the second must not disturb the clean-up.
    """

    NUMBERS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        """Change nothing yet."""
        self.came = False
        """Whether a signal has come."""
        self._held = 0
        self._put_off = False

    def take_over(self) -> None:
        """Handle the signals from now on."""
        for number in self.NUMBERS:
            signal.signal(number, self._on_signal)

    def ignore(self) -> None:
        """Ignore the signals from now on, until the process has ended."""
        for number in self.NUMBERS:
            signal.signal(number, signal.SIG_IGN)

    def held(self) -> 'Interrupts':
        """Return a context that puts a signal off until it is left."""
        return self

    def __enter__(self) -> None:
        """Put signals off from now on."""
        self._held += 1

    def __exit__(self, error: type | None, *_: object) -> None:
        """Raise what was put off, unless another error is being raised."""
        self._held -= 1
        if self._put_off and not self._held and error is None:
            self._put_off = False
            raise KeyboardInterrupt

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.came:
            return
        self.came = True
        if not self._held:
            raise KeyboardInterrupt
        self._put_off = True


INTERRUPTS = Interrupts()
"""Those of this process: signals belong to the process, not to a part of it."""
