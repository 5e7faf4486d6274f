# SPDX-License-Identifier: Apache-2.0
"""The decorator post_shutdown_test."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

TestClass = TypeVar('TestClass', bound=type)


def post_shutdown_test() -> Callable[[TestClass], TestClass]:
    """Return a decorator for test classes that run after the launch has shut down."""
    def mark(test_class: TestClass) -> TestClass:
        setattr(test_class, 'is_post_shutdown_test', True)
        return test_class
    return mark
