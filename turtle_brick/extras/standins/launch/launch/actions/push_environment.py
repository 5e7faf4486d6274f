# SPDX-License-Identifier: Apache-2.0
"""The action PushEnvironment."""

from __future__ import annotations

from launch.action import Action
from launch.launch_context import LaunchContext


class PushEnvironment(Action):
    """Saves the environment variables until PopEnvironment."""

    def execute(self, context: LaunchContext) -> None:
        context.saved_environments.append(dict(context.environment))
