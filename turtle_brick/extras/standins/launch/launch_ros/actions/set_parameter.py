# SPDX-License-Identifier: Apache-2.0
"""The action SetParameter."""

from __future__ import annotations

from typing import Any

from launch import Action, LaunchContext, SomeSubstitutionsType
from launch.frontend import Entity, expose_action, Parser
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch_ros.utilities.evaluate_parameters import evaluate_parameter_dict


@expose_action('set_parameter')
class SetParameter(Action):
    """
    Sets a parameter of all following nodes.

    As in ROS, the end of a group does not undo this action.
    """

    def __init__(self, name: SomeSubstitutionsType, value: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.name = normalize_to_list_of_substitutions(name)
        self.value = value

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['name'] = parser.parse_substitution(entity.get_attr('name'))
        arguments['value'] = parser.parse_substitution(entity.get_attr('value'))
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        name = perform_substitutions(context, self.name)
        parameters = evaluate_parameter_dict(context, {name: self.value})
        context.launch_configurations.setdefault('global_params', []).extend(parameters.items())
