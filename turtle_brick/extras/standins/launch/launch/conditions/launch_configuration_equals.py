# SPDX-License-Identifier: Apache-2.0
"""The condition LaunchConfigurationEquals."""

from __future__ import annotations

from launch.condition import Condition
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


class LaunchConfigurationEquals(Condition):
    """A condition that is true if a launch configuration has a value (None means unset)."""

    def __init__(self, launch_configuration_name: str,
                 expected_value: SomeSubstitutionsType | None) -> None:
        super().__init__(predicate=self._is_equal)
        self.name = launch_configuration_name
        self.expected_value = (None if expected_value is None
                               else normalize_to_list_of_substitutions(expected_value))

    def _is_equal(self, context: LaunchContext) -> bool:
        expected = (None if self.expected_value is None
                    else perform_substitutions(context, self.expected_value))
        return context.launch_configurations.get(self.name) == expected
