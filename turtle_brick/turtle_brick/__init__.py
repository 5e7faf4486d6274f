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
A turtlesim robot that catches a brick dropped from the sky.

The imports of its executables take up to a second. A Ctrl-C meanwhile ends them at once: raised in
the midst of an import, a KeyboardInterrupt prints a long traceback, or gets lost. Until this is
imported, their first line does so, which setup.py writes. What comes while Python itself starts
still prints a traceback.
"""

import os
from pathlib import Path
import signal
import sys
from types import FrameType


def _on_interrupt(number: int, frame: FrameType | None) -> None:
    """End the process if it imports a module, with nothing to tidy up yet; else interrupt it."""
    while frame is not None:
        if frame.f_code.co_filename == '<frozen importlib._bootstrap>':
            os._exit(0)
        frame = frame.f_back
    raise KeyboardInterrupt


if (Path(sys.argv[0]).parent.name == __name__  # as in lib/turtle_brick/arena
        and signal.getsignal(signal.SIGINT) != signal.SIG_IGN):  # as in a worker of sweep
    signal.signal(signal.SIGINT, _on_interrupt)
