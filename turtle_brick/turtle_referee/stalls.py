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

"""A process that sees when the machine stands still, or has no processor for who wakes up."""

from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory

PROGRAM = """
import os, sys, threading, time
pause, parent, least = threading.Event(), os.getppid(), float(sys.argv[1])
last = time.monotonic()
print(0.0, 0.0, flush=True)  # it is up
while os.getppid() == parent:
    pause.wait(0.01)
    now = time.monotonic()
    if now - last - 0.01 > least:
        print(last, now, flush=True)
    last = now
"""


class StallWatch:
    """A process of its own that notes when it wakes up late."""

    def __init__(self, least: float) -> None:
        """
        Begin to watch.

        :param least: how late (s) it has to be to be noted
        """
        self._directory = TemporaryDirectory(prefix='turtle_brick_watch_')
        self._log = Path(self._directory.name, 'stalls')
        with open(self._log, 'w') as log:
            self.process = subprocess.Popen(
                [sys.executable, '-c', PROGRAM, str(least)], stdin=subprocess.DEVNULL, stdout=log,
                # A Ctrl-C is for the process that started it, which then ends this.
                start_new_session=True)

    def stalls(self, begin: float) -> list[tuple[float, float]]:
        """Return from when to when each stall was that ended after an instant (s, monotonic)."""
        lines = self._log.read_text().splitlines(True)
        spans = [line.split() for line in lines if line.endswith('\n')]
        return [(float(start), float(end)) for start, end in spans if float(end) > begin]

    def longest(self, begin: float) -> float:
        """Return how long (s) the longest stall was since an instant (s, monotonic); 0 if none."""
        return max((end - start for start, end in self.stalls(begin)), default=0.0)

    def close(self) -> None:
        """Watch no more."""
        self.process.kill()
        self.process.wait()
        self._directory.cleanup()
