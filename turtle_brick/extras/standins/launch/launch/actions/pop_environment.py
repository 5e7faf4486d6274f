# SPDX-License-Identifier: Apache-2.0
"""The action PopEnvironment."""

from __future__ import annotations

from launch.action import Action
from launch.launch_context import LaunchContext


class PopEnvironment(Action):
    """Restores the environment variables that PushEnvironment has saved."""

    def execute(self, context: LaunchContext) -> None:
        context.set_environment(context.saved_environments.pop())
