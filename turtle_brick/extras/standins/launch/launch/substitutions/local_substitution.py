# SPDX-License-Identifier: Apache-2.0
"""The substitution LocalSubstitution."""

from __future__ import annotations

from typing import Any

from launch.launch_context import LaunchContext
from launch.substitution import Substitution


class LocalSubstitution(Substitution):
    """A local value of the launch, such as `event.reason` in an event handler."""

    def __init__(self, expression: str, description: str = '') -> None:
        self.expression = expression
        self.description = description

    def describe(self) -> str:
        return f"LocalVar('{self.expression}')"

    def perform(self, context: LaunchContext) -> str:
        value: Any = context.locals
        for name in self.expression.split('.'):
            value = getattr(value, name)
        return str(value)
