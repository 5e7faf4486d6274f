# SPDX-License-Identifier: Apache-2.0
"""The action DeclareLaunchArgument."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, List

from launch.action import Action
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.logging import get_logger
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_action('arg')
class DeclareLaunchArgument(Action):
    """
    Declares a launch argument.

    In Python: DeclareLaunchArgument('side', default_value='left', choices=['left', 'right'])
    In XML: <arg name="side" default="left"><choice value="left"/><choice value="right"/></arg>
    """

    def __init__(self, name: str, *, default_value: SomeSubstitutionsType | None = None,
                 description: str | None = None, choices: Iterable[str] | None = None,
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.name = name
        self.default_value = (None if default_value is None
                              else normalize_to_list_of_substitutions(default_value))
        self.choices = None if choices is None else list(choices)
        if description and self.choices:
            description = f'{description.rstrip(".")}. Valid choices are: {self.choices}'
        elif self.choices:
            description = f'One of: {self.choices}'
        self.description = description or 'no description given'

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['name'] = parser.escape_characters(entity.get_attr('name'))
        default_value = entity.get_attr('default', optional=True)
        if default_value is not None:
            arguments['default_value'] = parser.parse_substitution(default_value)
        description = entity.get_attr('description', optional=True)
        if description is not None:
            arguments['description'] = parser.escape_characters(description)
        choices = entity.get_attr('choice', data_type=List[Entity], optional=True)
        if choices is not None:
            arguments['choices'] = []
            for choice in choices:
                value = parser.escape_characters(choice.get_attr('value'))
                arguments['choices'].append(value)
                choice.assert_entity_completely_parsed()
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        configurations = context.launch_configurations
        if self.name not in configurations:
            if self.default_value is None:
                raise self._error(f'Required launch argument "{self.name}" was not provided.')
            configurations[self.name] = perform_substitutions(context, self.default_value)
        value = configurations[self.name]
        if self.choices and value not in self.choices:
            raise self._error(f'Argument "{self.name}" provided value "{value}" is not valid. '
                              f'Valid options are: {self.choices}')

    def _error(self, message: str) -> RuntimeError:
        """Log a message, and return an error with this message."""
        get_logger('launch.actions.declare_launch_argument').error(message)
        return RuntimeError(message)
