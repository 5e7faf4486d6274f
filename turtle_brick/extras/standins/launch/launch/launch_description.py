# SPDX-License-Identifier: Apache-2.0
"""The launch description."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, TYPE_CHECKING

from launch.launch_description_entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from launch.actions.declare_launch_argument import DeclareLaunchArgument
    from launch.launch_context import LaunchContext


class Declaration(NamedTuple):
    """The declaration of a launch argument."""

    argument: DeclareLaunchArgument
    required: bool
    """Whether the launch fails if the argument is not given."""
    is_conditional: bool
    """Whether the declaration or the action that contains it has a condition, as in `-s`."""


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
        return [declared.argument for declared in self.get_first_declarations()]

    def get_first_declarations(self) -> list[Declaration]:
        """Return the first declaration of each argument."""
        first: dict[str, Declaration] = {}
        for declared in self.get_declarations():
            first.setdefault(declared.argument.name, declared)
        return list(first.values())

    def get_declarations(self) -> list[Declaration]:
        """Return all declarations of arguments."""
        return _declarations(self, (), False)


def _declarations(entity: LaunchDescriptionEntity, given: Sequence[str],
                  conditional: bool) -> list[Declaration]:
    """
    Return the declarations of arguments in an entity.

    :param given: names of the arguments that an include passes on
    :param conditional: whether the entity is executed under a condition
    """
    from launch.actions.declare_launch_argument import DeclareLaunchArgument
    from launch.actions.include_launch_description import IncludeLaunchDescription
    from launch.actions.timer_action import TimerAction

    declarations: list[Declaration] = []
    is_delayed = entity.condition is not None or isinstance(entity, TimerAction)
    for child in entity.get_sub_entities():
        is_conditional = conditional or child.condition is not None
        if isinstance(child, DeclareLaunchArgument):
            required = (child.default_value is None and not is_conditional
                        and child.name not in given)
            declarations.append(
                Declaration(child, required, is_delayed or child.condition is not None))
            continue
        names = (child.get_argument_names() if isinstance(child, IncludeLaunchDescription) else [])
        declarations += _declarations(child, (*given, *names), is_conditional)
    return declarations
