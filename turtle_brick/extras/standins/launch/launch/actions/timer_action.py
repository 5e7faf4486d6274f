# SPDX-License-Identifier: Apache-2.0
"""The action TimerAction."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import Any, Union

from launch.action import Action
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

Period = Union[float, SomeSubstitutionsType]


@expose_action('timer')
class TimerAction(Action):
    """
    Executes actions after a period (s), unless the launch has begun to shut down.

    In Python: TimerAction(period=5.0, actions=[LogInfo(msg='late')])
    In XML: <timer period="5"><log message="late"/></timer>
    """

    def __init__(self, *, period: Period, actions: Iterable[LaunchDescriptionEntity],
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        if isinstance(period, int):
            raise TypeError(f'period of {type(self).__name__} is {period} of type int, but must '
                            'be a float, text or a substitution')
        self.period = (period if isinstance(period, float)
                       else normalize_to_list_of_substitutions(period))
        self.actions = list(actions)
        self._task: asyncio.Future[None] | None = None

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['period'] = parser.parse_optional(
            entity.get_attr('period', data_type=float, can_be_str=True))
        arguments['actions'] = [parser.parse_action(child) for child in entity.children]
        return cls, arguments

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.actions

    def get_asyncio_future(self) -> asyncio.Future[None] | None:
        return self._task

    def execute(self, context: LaunchContext) -> None:
        self._task = context.create_task(self._wait(
            context, context.launch_file, dict(context.launch_configurations)))

    async def _wait(self, context: LaunchContext, launch_file: str,
                    configurations: dict[str, Any]) -> None:
        """Wait, and then execute the actions with the given launch configurations."""
        period = (self.period if isinstance(self.period, float)
                  else float(perform_substitutions(context, self.period)))
        await context.pause(period)
        context.launch_file = launch_file
        later, context.launch_configurations = context.launch_configurations, configurations
        if not context.is_shutdown:
            for action in self.actions:
                action.visit(context)
        context.launch_configurations = later
