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
the machine. A process of its own watches for that, and Linux counts how long a test was ready to
run while others had the processors. A live test that fails while the machine stood still, or that
waited for much of its time, has measured nothing: it is reported as skipped, with how long that
was, and never run again.
"""

from pathlib import Path
from time import monotonic

import pytest
from turtle_referee.stalls import StallWatch

STALL = 0.05
"""How late (s) the watching process wakes up when the machine stands still: even beside two busy
loops it is in time within a few milliseconds."""

WAITING = 0.25
"""The part of its time for which a test of a graph in its own process may wait for a processor: a
catch is promised where each gets its turn within about 10 ms, and a graph acts every 4 ms. A wait
of less than STALL spoils nothing, however short the test."""

OWN_GRAPH = ('nodes', 'tools', 'view')
"""The directories of the tests that spin a graph themselves; others ask what processes did."""

PURE = 'core'
"""The directory of the tests that know no time but their own: no stall excuses them, and no
linter."""


def waited():
    """Return how long (s) this thread was ready to run so far, and had no processor."""
    try:
        return int(Path('/proc/thread-self/schedstat').read_text().split()[1]) * 1e-9
    except (OSError, IndexError):  # Linux may be built without it.
        return 0.0


class Steadiness:
    """The part of pytest that says of a failed test that the machine has spoiled it."""

    def __init__(self):
        """Begin to watch."""
        self.watch = StallWatch(STALL)
        self.begin = self.waited = 0.0

    def pytest_runtest_setup(self, item):
        """Take note of when a test begins."""
        self.begin, self.waited = monotonic(), waited()

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self, item, call):
        """Skip what has failed while the machine stood still."""
        report = (yield).get_result()
        room = item.path.parent.name
        if not report.failed or room == PURE or item.get_closest_marker('linter'):
            return
        reason = self.reason(room)
        if reason:
            path, line, _ = item.location
            what = call.excinfo.exconly().splitlines()[0]
            report.outcome = 'skipped'
            report.longrepr = (
                path, line, f'Skipped: {item.name} has failed ({what:.160}), while {reason}')

    def reason(self, room):
        """Say what the machine has kept from a test in a directory, nothing if it has not."""
        longest = self.watch.longest(self.begin)
        if longest:
            return f'the machine stood still for {longest:.2f} s'
        lasted, missing = monotonic() - self.begin, waited() - self.waited
        if room in OWN_GRAPH and missing > max(STALL, WAITING * lasted):
            return f'it waited for a processor for {missing:.2f} of {lasted:.2f} s'
        return ''

    def pytest_unconfigure(self):
        """Watch no more."""
        self.watch.close()
