# SPDX-License-Identifier: Apache-2.0
"""The condition LaunchConfigurationNotEquals."""

from __future__ import annotations

from launch.conditions.launch_configuration_equals import LaunchConfigurationEquals
from launch.launch_context import LaunchContext


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    """A condition that is true if a launch configuration does not have a value."""

    def evaluate(self, context: LaunchContext) -> bool:
        return not super().evaluate(context)
