# SPDX-License-Identifier: Apache-2.0
"""The base class of conditions."""

from __future__ import annotations

from collections.abc import Callable

from launch.launch_context import LaunchContext


class Condition:
    """A condition that calls a function to decide whether an action is executed."""

    def __init__(self, *, predicate: Callable[[LaunchContext], bool]) -> None:
        self.predicate = predicate

    def evaluate(self, context: LaunchContext) -> bool:
        """Return whether the condition is true."""
        return self.predicate(context)
