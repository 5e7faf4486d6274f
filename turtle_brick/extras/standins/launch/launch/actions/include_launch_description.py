# SPDX-License-Identifier: Apache-2.0
"""The action IncludeLaunchDescription."""

from __future__ import annotations

from collections.abc import Iterable
import os
from typing import Any

from launch.action import Action
from launch.actions.set_launch_configuration import SetLaunchConfiguration
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.launch_description_source import LaunchDescriptionSource
from launch.launch_description_sources.any_launch_description_source import (
    AnyLaunchDescriptionSource)
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitutions.text_substitution import TextSubstitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_action('include')
class IncludeLaunchDescription(Action):
    """
    Executes another launch file.

    In Python: IncludeLaunchDescription('other.launch.py', launch_arguments=[('side', 'left')])
    In XML: <include file="other.launch.xml"><arg name="side" value="left"/></include>
    """

    def __init__(self, launch_description_source: LaunchDescriptionSource | SomeSubstitutionsType,
                 *, launch_arguments: Iterable[tuple[SomeSubstitutionsType, Any]] | None = None,
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        if not isinstance(launch_description_source, LaunchDescriptionSource):
            launch_description_source = AnyLaunchDescriptionSource(launch_description_source)
        self.launch_description_source = launch_description_source
        self.launch_arguments = list(launch_arguments or ())

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['launch_description_source'] = parser.parse_substitution(
            entity.get_attr('file'))
        arguments['launch_arguments'] = [
            *parser.parse_pairs(entity, 'arg'), *parser.parse_pairs(entity, 'let')]
        return cls, arguments

    def get_argument_names(self) -> list[str]:
        """Return the names of the given launch arguments, as far as they are plain text."""
        return [''.join(part.text for part in normalize_to_list_of_substitutions(name)
                        if isinstance(part, TextSubstitution))
                for name, _ in self.launch_arguments]

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        description = self.launch_description_source.try_get_launch_description_without_context()
        return [] if description is None else [description]

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        description = self.launch_description_source.get_launch_description(context)
        context.launch_file = os.path.abspath(self.launch_description_source.location)
        names = [perform_substitutions(context, normalize_to_list_of_substitutions(name))
                 for name, _ in self.launch_arguments]
        for argument, required, _ in description.get_declarations():
            if required and argument.name not in names:
                raise RuntimeError(
                    f"'{context.launch_file}' requires the launch argument '{argument.name}' "
                    f"({argument.description}), but the arguments are: {', '.join(names)}")
        return [*(SetLaunchConfiguration(name, value) for name, value in self.launch_arguments),
                description]
