# SPDX-License-Identifier: Apache-2.0
"""The pytest plugin, which runs a module with a launch test as one test."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from launch_testing.loader import TestRun
from launch_testing.test_runner import LaunchTestRunner
import pytest

MARKS = ('launch_test', 'rostest')
"""Marks of the function generate_test_description."""


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marks."""
    for mark in MARKS:
        config.addinivalue_line('markers', f'{mark}: the function describes what to launch')


def pytest_pycollect_makemodule(module_path: Path, parent: Any) -> Any:
    """Collect a module as one test if generate_test_description has a launch test mark."""
    if not any(mark.encode() in module_path.read_bytes() for mark in MARKS):
        return None
    module = pytest.Module.from_parent(parent, path=module_path)
    try:
        function = getattr(module.obj, 'generate_test_description', None)
    except (Exception, pytest.skip.Exception):
        return module  # pytest reports the import error when it collects the module.
    if any(mark.name in MARKS for mark in getattr(function, 'pytestmark', ())):
        return LaunchTestModule.from_parent(parent, path=module_path)
    return module


class LaunchTestModule(pytest.Module):
    """A module that pytest collects as a single launch test."""

    def collect(self) -> Any:
        """Return the only test."""
        return [LaunchTestItem.from_parent(self, name=self.path.stem)]


class LaunchTestItem(pytest.Item):
    """A pytest item that runs the launch test in a file."""

    def runtest(self) -> None:
        """Run the launch test, and fail if one of its tests fails."""
        assert isinstance(self.parent, LaunchTestModule)
        failures = LaunchTestRunner(TestRun(self.parent.obj), {}).run()
        if failures:
            summary = '\n'.join(f'{name} failed' for name, _ in failures)
            details = '\n\n'.join(f'{"=" * 70}\nFAIL: {name}\n{"-" * 70}\n{text}'
                                  for name, text in failures)
            pytest.fail(f'{summary}\n{details}', pytrace=False)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return the place of the test in reports."""
        return self.path, 0, f'launch tests: {self.name}'
