# SPDX-License-Identifier: Apache-2.0
"""The action AppendEnvironmentVariable."""

from __future__ import annotations

import os
from typing import Any

from launch.action import Action
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import perform_typed_substitution


@expose_action('append_env')
class AppendEnvironmentVariable(Action):
    """Appends a value to an environment variable, or puts it in front of the variable."""

    def __init__(self, name: SomeSubstitutionsType, value: SomeSubstitutionsType,
                 prepend: bool | SomeSubstitutionsType = False,
                 separator: SomeSubstitutionsType = os.pathsep, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.name = normalize_to_list_of_substitutions(name)
        self.value = normalize_to_list_of_substitutions(value)
        self.prepend = prepend
        self.separator = normalize_to_list_of_substitutions(separator)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['name'] = parser.parse_substitution(entity.get_attr('name'))
        arguments['value'] = parser.parse_substitution(entity.get_attr('value'))
        prepend = entity.get_attr('prepend', data_type=bool, optional=True, can_be_str=True)
        if prepend is not None:
            arguments['prepend'] = parser.parse_optional(prepend)
        separator = entity.get_attr('separator', optional=True)
        if separator is not None:
            arguments['separator'] = parser.parse_substitution(separator)
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        name = perform_substitutions(context, self.name)
        values = [context.environment.get(name, ''), perform_substitutions(context, self.value)]
        if perform_typed_substitution(context, self.prepend, bool):
            values.reverse()
        separator = perform_substitutions(context, self.separator)
        context.environment[name] = separator.join(value for value in values if value)
