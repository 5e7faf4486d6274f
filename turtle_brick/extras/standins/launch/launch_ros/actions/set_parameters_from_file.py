# SPDX-License-Identifier: Apache-2.0
"""The action SetParametersFromFile."""

from __future__ import annotations

from typing import Any

from launch import Action, LaunchContext, SomeSubstitutionsType
from launch.frontend import Entity, expose_action, Parser
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_action('set_parameters_from_file')
class SetParametersFromFile(Action):
    """
    Passes a parameter file to all following nodes.

    As in ROS, the end of a group does not undo this action.
    """

    def __init__(self, filename: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.filename = normalize_to_list_of_substitutions(filename)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['filename'] = parser.parse_substitution(entity.get_attr('filename'))
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        path = perform_substitutions(context, self.filename)
        context.launch_configurations.setdefault('global_params', []).append(path)
