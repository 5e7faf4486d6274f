# SPDX-License-Identifier: Apache-2.0
"""Configure the isolation, the excluded files and the order of the tests."""

from collections.abc import Iterator
import os
from pathlib import Path
import signal
from typing import Any

from installed import is_standin
import psutil
import pytest
from turtle_graph.client.domains import reserved_domain

pytest_plugins = ['isolation']

HERE = Path(__file__).parent


def pytest_configure(config: pytest.Config) -> None:
    if hasattr(config, 'workerinput'):
        # Linux divides processor time equally among sessions. Workers in a common session would be
        # slow, because each process that a test starts has its own session.
        os.setsid()


def pytest_keyboard_interrupt() -> None:
    """Send SIGINT to pytest's workers after Ctrl-C, because each worker has its own session."""
    if 'PYTEST_XDIST_WORKER' not in os.environ:
        for worker in psutil.Process().children():
            worker.send_signal(signal.SIGINT)


def excluded_files() -> dict[str, list[str]]:
    """Return the test files that cannot run in this environment, grouped by reason."""
    excluded = {'only for stand-ins': [
        str(file.relative_to(HERE)) for file in HERE.glob('standins/test/test_*_standin.py')
        if not is_standin(file.stem.removeprefix('test_').removesuffix('_standin'))]}
    if not is_standin('tf2_msgs'):
        excluded['only for the PyPI environment'] = ['test/test_types.py']
    return excluded


LONGEST = ('test_pages', 'test_launch_standin', 'test_rules', 'test_website',
           'test_ros2cli_standin', 'test_workspaces', 'test_recovery', 'test_turtle_arena',
           'test_referee_live', 'test_viewer_browser')
"""The slowest test files, ordered so that few live graphs run at the same time."""

EXCLUDED = excluded_files()
# The stand-in for launch contains the modules launch_test and test_runner, which are not tests.
collect_ignore = ['standins/launch', *(file for files in EXCLUDED.values() for file in files)]
# The pytest plugin of launch_testing imports every file that pytest 7 collects.
collect_ignore_glob = ['*/__init__.py']


def pytest_report_header(config: pytest.Config) -> str:
    reports = [f'{", ".join(files)} ({reason})' for reason, files in EXCLUDED.items() if files]
    return f'excluded: {"; ".join(reports) or "nothing"}'


@pytest.fixture
def domain_id(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Reserve a ROS domain that no other node uses for a test and its child processes."""
    with reserved_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain


@pytest.fixture
def live(domain_id: int) -> Iterator[Any]:
    """Provide a LiveGraph in a ROS domain that only this test uses."""
    from live_graph import LiveGraph
    with LiveGraph(domain_id) as live:
        yield live


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the linters first and then the slowest files to keep all workers busy until the end."""
    def rank(item: pytest.Item) -> int:
        if item.get_closest_marker('linter'):
            return -1  # flake8 forks, which is unsafe while DDS threads are running.
        return LONGEST.index(item.path.stem) if item.path.stem in LONGEST else len(LONGEST)

    items.sort(key=rank)
