# SPDX-License-Identifier: Apache-2.0
"""The action SetRemap."""

from __future__ import annotations

from typing import Any

from launch import Action, LaunchContext, SomeSubstitutionsType
from launch.frontend import Entity, expose_action, Parser
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_action('set_remap')
class SetRemap(Action):
    """
    Adds a remapping to all following nodes.

    As in ROS, the end of a group does not undo this action.
    """

    def __init__(self, src: SomeSubstitutionsType, dst: SomeSubstitutionsType,
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.src = normalize_to_list_of_substitutions(src)
        self.dst = normalize_to_list_of_substitutions(dst)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['src'] = parser.parse_substitution(entity.get_attr('from'))
        arguments['dst'] = parser.parse_substitution(entity.get_attr('to'))
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        rule = (perform_substitutions(context, self.src), perform_substitutions(context, self.dst))
        context.launch_configurations.setdefault('ros_remaps', []).append(rule)
