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
Machines that stand still: a virtual one may, for seconds, whenever its host is busy with others.

What a test of the live graph says then, of rates or of a brick that is caught in time, it says of
the machine. A process of its own watches for that. A test that fails while the machine stood
still is run again once the machine keeps its pace; one that fails without that has failed.
"""

from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
from threading import Event
from time import monotonic

from _pytest.runner import runtestprotocol
import pytest

STALL = 0.05
"""How late (s) the watching process wakes up when the machine stands still: even beside two busy
loops it is in time within a few milliseconds."""

ATTEMPTS = 5
"""How often a test may be run."""

QUIET = 3.0
"""How long (s) the machine has to keep its pace before a test is run again."""

PATIENCE = 60.0
"""How long (s) that is waited for."""

PROGRAM = f"""
import os, sys, threading, time
pause, parent, last = threading.Event(), os.getppid(), time.monotonic()
print(0.0, 0.0, flush=True)  # it is up
while os.getppid() == parent:
    pause.wait(0.01)
    now = time.monotonic()
    if now - last > {STALL}:
        print(last, now, flush=True)
    last = now
"""


class Watch:
    """A process that sees when the machine stands still."""

    def __init__(self):
        """Begin to watch."""
        self._directory = TemporaryDirectory(prefix='turtle_brick_watch_')
        self._log = Path(self._directory.name, 'stalls')
        with open(self._log, 'w') as log:
            self.process = subprocess.Popen(
                [sys.executable, '-c', PROGRAM], stdin=subprocess.DEVNULL, stdout=log,
                # A Ctrl-C is for pytest, which then ends this.
                start_new_session=True)

    def stalls(self, begin):
        """Return how long (s) each stall was that ended after an instant (s, monotonic)."""
        lines = self._log.read_text().splitlines(True)
        spans = (map(float, line.split()) for line in lines if line.endswith('\n'))
        return [end - start for start, end in spans if end > begin]

    def wait_for_quiet(self):
        """Wait until the machine keeps its pace, but not forever."""
        deadline = monotonic() + PATIENCE
        while monotonic() < deadline and self.stalls(monotonic() - QUIET):
            Event().wait(0.1)

    def close(self):
        """Watch no more."""
        self.process.kill()
        self.process.wait()
        self._directory.cleanup()


class Steadiness:
    """The part of pytest that runs a test again which the machine has spoiled."""

    def __init__(self):
        """Begin to watch."""
        self.watch = Watch()
        self.repeated = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        """Run a test, more than once if need be; what counts is the last time."""
        if not isinstance(item, pytest.Function):
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        repeated = []
        for attempt in range(ATTEMPTS):
            begin = monotonic()
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            stalls = self.watch.stalls(begin)
            if attempt == ATTEMPTS - 1 or not stalls or not any(
                    report.failed for report in reports):
                break
            repeated.append(f'{item.nodeid}: run again, since the machine stood still for '
                            f'{max(stalls):.2f} s while it failed')
            self.watch.wait_for_quiet()
            item._initrequest()
        reports[-1].user_properties += [('repeated', text) for text in repeated]
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def pytest_runtest_logreport(self, report):
        """Take note of what was run again, here or in another process."""
        self.repeated += [text for name, text in report.user_properties if name == 'repeated']

    def pytest_terminal_summary(self, terminalreporter):
        """Say which tests were run again."""
        for line in self.repeated:
            terminalreporter.line(line)

    def pytest_unconfigure(self):
        """Watch no more."""
        self.watch.close()
