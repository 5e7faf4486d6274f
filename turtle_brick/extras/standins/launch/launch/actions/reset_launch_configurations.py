# SPDX-License-Identifier: Apache-2.0
"""The action ResetLaunchConfigurations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from launch.action import Action
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_action('reset')
class ResetLaunchConfigurations(Action):
    """Removes all launch configurations except the given ones."""

    def __init__(self, launch_configurations: Mapping[Any, SomeSubstitutionsType] | None = None,
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.launch_configurations = dict(launch_configurations or {})

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['launch_configurations'] = dict(parser.parse_pairs(entity, 'keep'))
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        kept = {}
        for name, value in self.launch_configurations.items():
            name = perform_substitutions(context, normalize_to_list_of_substitutions(name))
            kept[name] = perform_substitutions(context, normalize_to_list_of_substitutions(value))
        context.launch_configurations = kept
