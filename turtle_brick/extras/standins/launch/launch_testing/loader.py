# SPDX-License-Identifier: Apache-2.0
"""The tests in a module."""

from __future__ import annotations

import functools
import inspect
from types import ModuleType
from typing import Any
import unittest

from launch import LaunchDescription


class TestRun:
    """The test description and the test cases in a module."""

    __test__ = False  # pytest does not collect this class.

    def __init__(self, module: ModuleType) -> None:
        self.test_description_function = module.generate_test_description
        self.pre_shutdown_tests = unittest.TestSuite()
        self.post_shutdown_tests = unittest.TestSuite()
        for suite in unittest.defaultTestLoader.loadTestsFromModule(module):
            for test in suite:  # type: ignore[union-attr]
                is_later = getattr(test, 'is_post_shutdown_test', False)
                (self.post_shutdown_tests if is_later else self.pre_shutdown_tests).addTest(test)
        self.all_tests: list[Any] = [*self.pre_shutdown_tests, *self.post_shutdown_tests]

    def normalized_test_description(self) -> tuple[LaunchDescription, dict[str, Any]]:
        """Return the launch description and the named processes for the tests."""
        names = list(inspect.signature(self.test_description_function).parameters)
        if names:
            raise Exception(
                f"generate_test_description has unexpected extra argument '{names[0]}'")
        description = self.test_description_function()
        return description if isinstance(description, tuple) else (description, {})

    def bind(self, arguments: dict[str, Any]) -> None:
        """Give all tests the arguments as attributes, and as arguments if they ask for them."""
        for test in self.all_tests:
            method = getattr(test, test._testMethodName)
            wanted = {name: arguments[name] for name in inspect.signature(method).parameters
                      if name in arguments}
            for name, value in arguments.items():
                setattr(test, name, value)
            bound = functools.wraps(method)(functools.partial(method, **wanted))
            setattr(test, test._testMethodName, bound)
