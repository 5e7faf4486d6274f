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
"""Live tests that the machine has spoiled are skipped, and no others."""

import os
from pathlib import Path
import signal
import subprocess
import sys
from threading import Event
from time import monotonic

import pytest
from steadiness import STALL
from turtle_referee.stalls import StallWatch

CONFTEST = """
from time import monotonic

import steadiness
from steadiness import Steadiness

steadiness.monotonic = lambda: {speed} * monotonic()
steadiness.waited = lambda: {waiting} * steadiness.monotonic()

class Spoiled(Steadiness):
    def __init__(self):
        super().__init__()
        self.watch.stalls = lambda begin: {stalls}

def pytest_configure(config):
    config.pluginmanager.register(Spoiled())
"""

TESTS = """
import pytest

{marks}
def test_it_fails():
    assert False

def test_it_passes():
    pass
"""


CROWDED = """
import os, subprocess, sys, time
from steadiness import waited
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
other = subprocess.Popen([sys.executable, '-c', 'while True: pass'])
try:
    begin, used, before = time.monotonic(), time.thread_time(), waited()
    while time.monotonic() < begin + 1.0:
        pass
    print(waited() - before, time.monotonic() - begin - time.thread_time() + used)
finally:
    other.kill()
"""


@pytest.fixture
def watch():
    """Watch the machine."""
    watch = StallWatch(STALL)
    yield watch
    watch.close()


def test_a_machine_that_stands_still_is_seen(watch):
    """To the watching process a stop of its own is no different."""
    deadline = monotonic() + 30.0
    while not watch.stalls(-1.0) and monotonic() < deadline:
        Event().wait(0.01)
    begin = monotonic()
    watch.process.send_signal(signal.SIGSTOP)
    os.waitpid(watch.process.pid, os.WUNTRACED)
    Event().wait(0.3)
    watch.process.send_signal(signal.SIGCONT)
    while not watch.stalls(begin) and monotonic() < deadline:
        Event().wait(0.01)
    assert watch.longest(begin) >= 0.25
    assert watch.stalls(monotonic() + 1.0) == []


def test_waiting_for_a_processor_is_counted():
    """Beside a busy loop on the same processor: what was not computing has waited."""
    waited, lacking = map(float, subprocess.run(
        [sys.executable, '-c', CROWDED], stdout=subprocess.PIPE, text=True, check=True,
        cwd=Path(__file__).parents[1]).stdout.split())
    if not Path('/proc/thread-self/schedstat').exists():
        pytest.skip('this Linux does not count it')
    assert lacking > 0.1
    assert waited == pytest.approx(lacking, rel=0.3)


@pytest.mark.parametrize('directory, marks, stalls, waiting, speed, outcome', [
    ('nodes', '', '[(2.0, 2.1), (3.0, 3.4)]', 0.0, 1e3, '1 passed, 1 skipped'),
    ('nodes', '', '[]', 0.3, 1e3, '1 passed, 1 skipped'),
    ('nodes', '', '[]', 0.2, 1e3, '1 failed, 1 passed'),
    ('nodes', '', '[]', 0.3, 1e-3, '1 failed, 1 passed'),
    ('home', '', '[(3.0, 3.4)]', 0.3, 1e3, '1 passed, 1 skipped'),
    ('home', '', '[]', 0.3, 1e3, '1 failed, 1 passed'),
    ('nodes', '@pytest.mark.linter', '[(3.0, 3.4)]', 0.3, 1e3, '1 failed, 1 passed'),
    ('core', '', '[(3.0, 3.4)]', 0.3, 1e3, '1 failed, 1 passed')])
def test_what_is_spoiled(tmp_path, directory, marks, stalls, waiting, speed, outcome):
    """Neither a wait that is a small part of the test's time, nor one that is short."""
    (tmp_path / 'conftest.py').write_text(CONFTEST.format(
        stalls=stalls, waiting=waiting, speed=speed))
    place = tmp_path / directory
    place.mkdir()
    (place / 'test_them.py').write_text(TESTS.format(marks=marks))
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-rs', '-p', 'no:cacheprovider', str(place)],
        env={**os.environ, 'PYTEST_ADDOPTS': '', 'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1',
             'PYTHONPATH': os.pathsep.join(
                 [str(Path(__file__).parents[1]), *filter(None, sys.path)])},
        stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    assert outcome in done.stdout
    said = 'while it waited for' if stalls == '[]' else 'while the machine stood still for 0.40 s'
    failed = 'test_it_fails has failed (AssertionError: assert False), while '
    assert (failed in done.stdout) == ('skipped' in outcome)
    assert (said in done.stdout) == ('skipped' in outcome)
