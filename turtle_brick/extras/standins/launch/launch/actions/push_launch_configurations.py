# SPDX-License-Identifier: Apache-2.0
"""The action PushLaunchConfigurations."""

from __future__ import annotations

from launch.action import Action
from launch.launch_context import LaunchContext


class PushLaunchConfigurations(Action):
    """Saves the launch configurations until PopLaunchConfigurations."""

    def execute(self, context: LaunchContext) -> None:
        context.saved_configurations.append(dict(context.launch_configurations))
