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
"""Isolate the tests, choose them, and provide nodes for them."""

from collections.abc import Iterator
from importlib.util import find_spec
import os
from pathlib import Path
import subprocess
from typing import Any

import pytest

pytest_plugins = ['isolation']

LAWS = [] if find_spec('hypothesis') else sorted(Path(__file__).parent.glob('*/test_*_laws.py'))
"""Files with laws, the tests with random input, if they cannot run."""

# A skip at the top of a file would also skip all other files, because launch_testing imports the
# files before pytest does.
collect_ignore = LAWS


def pytest_report_header(config: pytest.Config) -> str:
    names = ', '.join(file.name for file in LAWS)
    return f'left out, because hypothesis is not installed: {names}' if LAWS else ''


@pytest.fixture
def live(domain_id: int) -> Iterator[Any]:
    """Provide LiveNodes in a ROS domain that only this test uses."""
    from live_nodes import LiveNodes
    with LiveNodes(domain_id) as live:
        yield live


@pytest.fixture
def turtlesim(domain_id: int) -> Iterator[None]:
    """Run a holonomic turtlesim without a window in the ROS domain of a test."""
    from ament_index_python.packages import get_package_prefix
    program = Path(get_package_prefix('turtlesim'), 'lib', 'turtlesim', 'turtlesim_node')
    with subprocess.Popen([program, '--ros-args', '-p', 'holonomic:=true'],
                          env={**os.environ, 'QT_QPA_PLATFORM': 'offscreen'}) as process:
        yield
        process.terminate()
