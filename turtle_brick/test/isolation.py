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
import os
import random
import signal
import socket
import tempfile

import pytest

FIRST_PORT = 32768
"""TCP port that reserves ROS domain 0, as in the domain_coordinator package of ROS 2."""

_session = contextlib.ExitStack()


def pytest_configure(config: pytest.Config) -> None:
    # A background job in a shell script ignores SIGINT, and so do its child processes.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.pop('ROS_LOCALHOST_ONLY', None)
    os.environ.pop('ROS_STATIC_PEERS', None)
    os.environ['ROS_DOMAIN_ID'] = str(_session.enter_context(unused_domain()))
    os.environ['ROS_LOG_DIR'] = _session.enter_context(
        tempfile.TemporaryDirectory(prefix='turtle_brick_test_'))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Release the ROS domain of this test process and delete its ROS logs."""
    _session.close()


@contextlib.contextmanager
def unused_domain() -> Iterator[int]:
    """Reserve a ROS domain that no other test uses."""
    for domain in random.sample(range(1, 101), 100):
        with socket.socket() as reservation:
            try:
                reservation.bind(('', FIRST_PORT + domain))
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError('other tests use all ROS domains from 1 to 100')


@pytest.fixture
def domain_id(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Reserve a ROS domain for a test and its child processes."""
    with unused_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain
