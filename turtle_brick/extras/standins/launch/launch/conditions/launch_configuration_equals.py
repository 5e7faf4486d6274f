# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
