# SPDX-License-Identifier: Apache-2.0
"""The action GroupAction."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from launch.action import Action
from launch.actions.pop_environment import PopEnvironment
from launch.actions.pop_launch_configurations import PopLaunchConfigurations
from launch.actions.push_environment import PushEnvironment
from launch.actions.push_launch_configurations import PushLaunchConfigurations
from launch.actions.reset_environment import ResetEnvironment
from launch.actions.reset_launch_configurations import ResetLaunchConfigurations
from launch.actions.set_launch_configuration import SetLaunchConfiguration
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.some_substitutions_type import SomeSubstitutionsType


@expose_action('group')
class GroupAction(Action):
    """Executes actions whose launch configurations and environment end with the group."""

    def __init__(self, actions: Iterable[LaunchDescriptionEntity], *, scoped: bool = True,
                 forwarding: bool = True,
                 launch_configurations: Mapping[Any, SomeSubstitutionsType] | None = None,
                 **kwargs: Any) -> None:
        """
        Store the actions.

        :param scoped: whether launch configurations and environment are restored at the end
        :param forwarding: whether the group has the launch configurations that were set before
        :param launch_configurations: launch configurations to set in the group
        """
        super().__init__(**kwargs)
        self.actions = list(actions)
        self.scoped = scoped
        self.forwarding = forwarding
        self.launch_configurations = dict(launch_configurations or {})

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        scoped = entity.get_attr('scoped', data_type=bool, optional=True)
        if scoped is not None:
            arguments['scoped'] = scoped
        forwarding = entity.get_attr('forwarding', data_type=bool, optional=True)
        if forwarding is not None:
            arguments['forwarding'] = forwarding
        arguments['launch_configurations'] = dict(parser.parse_pairs(entity, 'keep'))
        arguments['actions'] = [parser.parse_action(child) for child in entity.children
                                if child.type_name != 'keep']
        return cls, arguments

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.actions

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        configurations: list[LaunchDescriptionEntity] = [
            SetLaunchConfiguration(name, value)
            for name, value in self.launch_configurations.items()]
        if not self.scoped:
            return [*configurations, *self.actions]
        if not self.forwarding:
            configurations = [ResetEnvironment(),
                              ResetLaunchConfigurations(self.launch_configurations)]
        return [PushLaunchConfigurations(), PushEnvironment(), *configurations, *self.actions,
                PopEnvironment(), PopLaunchConfigurations()]
