# SPDX-License-Identifier: Apache-2.0
"""The substitution LaunchConfiguration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.substitutions.substitution_failure import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_substitution('var', least=1, most=2)
class LaunchConfiguration(Substitution):
    """The value of a launch configuration, such as a launch argument."""

    def __init__(self, variable_name: SomeSubstitutionsType, *, default: Any = None) -> None:
        """
        Store the name of the launch configuration.

        :param default: text, or any value whose text is used, such as a number
        """
        self.variable_name = normalize_to_list_of_substitutions(variable_name)
        self.default = None
        if default is not None:
            parts = default if isinstance(default, (list, tuple)) else [default]
            self.default = normalize_to_list_of_substitutions(
                [part if isinstance(part, Substitution) else str(part) for part in parts])

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        name, *default = data
        return cls, {'variable_name': name, 'default': default[0] if default else None}

    def describe(self) -> str:
        return f'LaunchConfig({describe(self.variable_name)})'

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.variable_name)
        if name in context.launch_configurations:
            return context.launch_configurations[name]
        if self.default is None:
            raise SubstitutionFailure(f"launch configuration '{name}' does not exist")
        return perform_substitutions(context, self.default)
