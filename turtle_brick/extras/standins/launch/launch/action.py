# SPDX-License-Identifier: Apache-2.0
"""The base class of actions."""

from __future__ import annotations

from typing import Any, TYPE_CHECKING

from launch.condition import Condition
from launch.conditions.if_condition import IfCondition
from launch.conditions.unless_condition import UnlessCondition
from launch.launch_description_entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from launch.frontend.entity import Entity
    from launch.frontend.parser import Parser


class Action(LaunchDescriptionEntity):
    """
    The base class of all actions, which override the method `execute`.

    Actions pass unknown arguments to this class, which reports them.
    """

    def __init__(self, *, condition: Condition | None = None, **unknown: Any) -> None:
        if unknown:
            names = ', '.join(map(repr, unknown))
            raise TypeError(
                f'{type(self).__name__} has no argument {names} in the stand-in for launch')
        self.condition = condition

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        """Return a class and its arguments for an entity in an XML or YAML launch file."""
        if_value = entity.get_attr('if', optional=True)
        unless_value = entity.get_attr('unless', optional=True)
        if if_value is not None and unless_value is not None:
            raise RuntimeError(f"'{entity.type_name}' has both attributes 'if' and 'unless', but "
                               'only one of them is allowed')
        if if_value is not None:
            return cls, {'condition': IfCondition(parser.parse_substitution(if_value))}
        if unless_value is not None:
            return cls, {'condition': UnlessCondition(parser.parse_substitution(unless_value))}
        return cls, {}
