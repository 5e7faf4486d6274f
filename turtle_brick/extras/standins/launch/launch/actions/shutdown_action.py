# SPDX-License-Identifier: Apache-2.0
"""The action Shutdown."""

from __future__ import annotations

from typing import Any

from launch import events
from launch.action import Action
from launch.events.process.process_exited import ProcessExited
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.logging import get_logger
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_action('shutdown')
class Shutdown(Action):
    """Ends the launch and all of its processes."""

    def __init__(self, *, reason: SomeSubstitutionsType = 'reason not given',
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.reason = normalize_to_list_of_substitutions(reason)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        reason = entity.get_attr('reason', optional=True)
        if reason is not None:
            arguments['reason'] = parser.parse_substitution(reason)
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        event = context.locals.event
        if isinstance(event, ProcessExited):
            get_logger('launch').info(f'process[{event.process_name}] was required: shutting down '
                                      'launched system')
        context.shutdown(events.Shutdown(reason=perform_substitutions(context, self.reason)))
