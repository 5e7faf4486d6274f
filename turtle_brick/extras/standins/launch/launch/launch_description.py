# SPDX-License-Identifier: Apache-2.0
"""The launch description."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from launch.launch_description_entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from launch.actions.declare_launch_argument import DeclareLaunchArgument
    from launch.launch_context import LaunchContext


class LaunchDescription(LaunchDescriptionEntity):
    """A list of entities, usually actions, that a launch executes in order."""

    def __init__(self, initial_entities: Iterable[LaunchDescriptionEntity] = ()) -> None:
        self.entities = list(initial_entities)

    def add_action(self, action: LaunchDescriptionEntity) -> None:
        """Append an action."""
        self.entities.append(action)

    def add_entity(self, entity: LaunchDescriptionEntity) -> None:
        """Append an entity."""
        self.entities.append(entity)

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        return self.entities

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.entities

    def get_launch_arguments(self) -> list[DeclareLaunchArgument]:
        """Return the declared arguments of this description and of those that it includes."""
        arguments: dict[str, DeclareLaunchArgument] = {}
        for argument, _ in self.get_launch_arguments_and_requirements():
            arguments.setdefault(argument.name, argument)
        return list(arguments.values())

    def get_launch_arguments_and_requirements(self) -> list[tuple[DeclareLaunchArgument, bool]]:
        """Return each declared argument, and whether the launch fails if it is not given."""
        return _declared_arguments(self, (), False)


def _declared_arguments(entity: LaunchDescriptionEntity, given: Sequence[str],
                        conditional: bool) -> list[tuple[DeclareLaunchArgument, bool]]:
    """
    Return the declared arguments in an entity, and whether they are required.

    :param given: names of the arguments that an include passes on
    :param conditional: whether the entity is executed under a condition
    """
    from launch.actions.declare_launch_argument import DeclareLaunchArgument
    from launch.actions.include_launch_description import IncludeLaunchDescription

    found: list[tuple[DeclareLaunchArgument, bool]] = []
    for child in entity.get_sub_entities():
        is_conditional = conditional or child.condition is not None
        if isinstance(child, DeclareLaunchArgument):
            required = (child.default_value is None and not is_conditional
                        and child.name not in given)
            found.append((child, required))
            continue
        names = (child.get_argument_names() if isinstance(child, IncludeLaunchDescription) else [])
        found += _declared_arguments(child, (*given, *names), is_conditional)
    return found
