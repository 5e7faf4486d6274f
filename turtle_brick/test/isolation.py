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
"""Isolate the tests from other ROS programs and from each other."""

from collections.abc import Iterator
import contextlib
from importlib.util import find_spec
import os
import signal
import tempfile

import pytest

_session = contextlib.ExitStack()


def pytest_configure(config: pytest.Config) -> None:
    if hasattr(config, 'workerinput'):
        # Linux divides processor time equally among sessions. Workers in a common session would be
        # slow, because each process that a test starts has its own session.
        os.setsid()
    # A background job in a shell script ignores SIGINT, and so do its child processes.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.pop('ROS_LOCALHOST_ONLY', None)
    os.environ.pop('ROS_STATIC_PEERS', None)
    if find_spec('domain_coordinator') is not None:  # The tests of pure modules run without ROS.
        os.environ['ROS_DOMAIN_ID'] = str(_session.enter_context(unused_domain()))
    os.environ['ROS_LOG_DIR'] = _session.enter_context(
        tempfile.TemporaryDirectory(prefix='turtle_brick_test_'))


def pytest_keyboard_interrupt() -> None:
    """Send SIGINT to pytest's workers after Ctrl-C, because each worker has its own session."""
    if 'PYTEST_XDIST_WORKER' not in os.environ and find_spec('psutil') is not None:
        import psutil
        for worker in psutil.Process().children():
            worker.send_signal(signal.SIGINT)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Release the ROS domain of this test process and delete its ROS logs."""
    _session.close()


@contextlib.contextmanager
def unused_domain() -> Iterator[int]:
    """Reserve a ROS domain that no other test uses."""
    from domain_coordinator import domain_id
    with domain_id() as domain:
        yield domain


@pytest.fixture
def domain_id(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Reserve a ROS domain for a test and its child processes."""
    with unused_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain
