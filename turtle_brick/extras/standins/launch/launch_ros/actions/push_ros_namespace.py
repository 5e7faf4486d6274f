# SPDX-License-Identifier: Apache-2.0
"""The action PushROSNamespace."""

from __future__ import annotations

from typing import Any

from launch import Action, LaunchContext, SomeSubstitutionsType
from launch.frontend import Entity, expose_action, Parser
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch_ros.utilities.namespace_utils import prefix_namespace


@expose_action('push_ros_namespace')
@expose_action('push-ros-namespace')
class PushROSNamespace(Action):
    """Puts the following nodes in the group into a namespace."""

    def __init__(self, namespace: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.namespace = normalize_to_list_of_substitutions(namespace)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['namespace'] = parser.parse_substitution(entity.get_attr('namespace'))
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        configurations = context.launch_configurations
        configurations['ros_namespace'] = prefix_namespace(
            configurations.get('ros_namespace'), perform_substitutions(context, self.namespace))


PushRosNamespace = PushROSNamespace
