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
"""Every test in a ROS domain of its own, out of reach of other machines."""

from collections.abc import Iterator
import contextlib
from importlib.util import find_spec
import os
from pathlib import Path
import re
import tempfile

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
import pytest
from turtle_referee.graph_client.domains import reserved_domain

_session = contextlib.ExitStack()

HERE = Path(__file__).parent


def left_out() -> dict[str, list[str]]:
    """Return the files that can't be tested here, by the reason."""
    files = {reason: [] for reason in (
        'for the stand-ins in a home of wheels', 'for the libraries in a home of wheels',
        'ament_copyright is not installed', 'hypothesis is not installed')}
    stand_ins, libraries, license_checker, laws = files.values()
    stand_ins += [f'standins/{file.name}' for file in HERE.glob('standins/test_*_standin.py')
                  if not is_standin(file.stem.removeprefix('test_').removesuffix('_standin'))]
    if not is_standin('tf2_msgs'):
        libraries += ['test_mypy.py']
    if find_spec('ament_copyright') is None:
        license_checker += ['test_copyright.py']
    if find_spec('hypothesis') is None:
        laws += [str(file.relative_to(HERE)) for file in HERE.glob('**/test_*.py')
                 if re.search('^from (hypothesis|laws) import', file.read_text(), re.M)]
    return files


def is_standin(package: str) -> bool:
    """Tell whether a package is one of this workspace that stands in for the real one."""
    with contextlib.suppress(PackageNotFoundError):
        manifest = Path(get_package_share_directory(package), 'package.xml')
        return '<description>Stands in for' in manifest.read_text()
    return False


LONGEST = ('test_pages', 'test_ros2cli_standin', 'test_launch_standin', 'test_viewer_browser',
           'test_chaos', 'test_referee_live')

LEFT_OUT = left_out()
collect_ignore = [file for files in LEFT_OUT.values() for file in files]


def pytest_configure(config: pytest.Config) -> None:
    """Set what rclpy reads, before anything imports it: here, and in every child process."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.pop('ROS_LOCALHOST_ONLY', None)
    os.environ.pop('ROS_STATIC_PEERS', None)
    os.environ['ROS_DOMAIN_ID'] = str(_session.enter_context(reserved_domain()))
    if find_spec('hypothesis') is not None:
        from hypothesis import settings
        settings.register_profile('untimed', deadline=None)  # time tells of the machine
        settings.load_profile('untimed')
    os.environ['ROS_LOG_DIR'] = _session.enter_context(
        tempfile.TemporaryDirectory(prefix='turtle_brick_test_'))


def pytest_report_header(config: pytest.Config) -> str:
    """Say in one line which files are left out, and why."""
    told = [f'{", ".join(files)} ({reason})' for reason, files in LEFT_OUT.items() if files]
    return f'left out: {"; ".join(told) or "nothing"}'


def pytest_unconfigure(config: pytest.Config) -> None:
    """Give the domain back and delete the logs."""
    _session.close()


@pytest.fixture
def domain_id(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Reserve a ROS domain for the test; child processes are in it too."""
    with reserved_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the linters first, then the files that take longest: none is to be the last alone."""
    def rank(item: pytest.Item) -> int:
        if item.get_closest_marker('linter'):
            return 0  # flake8 forks, which a process full of DDS's threads should not
        return 1 if item.path.stem in LONGEST else 2

    items.sort(key=rank)
