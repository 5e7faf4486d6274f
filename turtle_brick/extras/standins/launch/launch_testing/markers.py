# SPDX-License-Identifier: Apache-2.0
"""Decorators for test descriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

Description = TypeVar('Description', bound=Callable[..., Any])


def keep_alive(test_description: Description) -> Description:
    """Mark a test description so that its launch continues after all processes have ended."""
    setattr(test_description, 'keep_alive', True)
    return test_description
