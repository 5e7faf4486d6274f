# SPDX-License-Identifier: Apache-2.0
"""The action ResetEnvironment."""

from __future__ import annotations

from launch.action import Action
from launch.frontend import expose_action
from launch.launch_context import LaunchContext


@expose_action('reset_env')
class ResetEnvironment(Action):
    """Restores the environment variables with which the launch began."""

    def execute(self, context: LaunchContext) -> None:
        context.set_environment(context.initial_environment)
