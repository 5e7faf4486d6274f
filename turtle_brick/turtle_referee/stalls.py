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
"""A process that sees when the machine stands still: a virtual one may, for its host's sake."""

import sys

from turtle_referee.processes import Process

PROGRAM = """
import os, time
PAUSE, LATE = 0.01, 0.01
last, parent = time.time(), os.getppid()
while os.getppid() == parent:
    time.sleep(PAUSE)
    now = time.time()
    if now - last > PAUSE + LATE:
        print(round(last * 1e9), round(now * 1e9))
    last = now
"""


class StallWatch(Process):
    """A process of its own that says so when it wakes up late."""

    def __init__(self) -> None:
        """Begin to watch."""
        super().__init__([sys.executable, '-c', PROGRAM])

    def stalls(self) -> list[tuple[int, int]]:
        """Return from when to when (ns) the machine stood still so far."""
        lines = self.output.splitlines(True)
        spans = [line.split() for line in lines if line.endswith('\n')]
        return [(int(begin), int(end)) for begin, end in spans]
