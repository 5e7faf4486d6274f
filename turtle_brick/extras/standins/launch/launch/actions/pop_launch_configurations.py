# SPDX-License-Identifier: Apache-2.0
"""The action PopLaunchConfigurations."""

from __future__ import annotations

from launch.action import Action
from launch.launch_context import LaunchContext


class PopLaunchConfigurations(Action):
    """Restores the launch configurations that PushLaunchConfigurations has saved."""

    def execute(self, context: LaunchContext) -> None:
        context.launch_configurations = context.saved_configurations.pop()
