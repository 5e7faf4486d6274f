# SPDX-License-Identifier: Apache-2.0
"""The action ReadyToTest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from launch import Action, LaunchContext


class ReadyToTest(Action):
    """Starts the tests."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._callbacks: list[Callable[[], None]] = []

    def add_callback(self, callback: Callable[[], None]) -> None:
        """Add a function that is called when the action is executed."""
        self._callbacks.append(callback)

    def execute(self, context: LaunchContext) -> None:
        for callback in self._callbacks:
            callback()
