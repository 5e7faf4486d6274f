# SPDX-License-Identifier: Apache-2.0
"""The base class of event handlers for the events of an action."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Union

from launch.action import Action
from launch.event import Event
from launch.event_handler import EventHandler, Reaction
from launch.events.execution_complete import ExecutionComplete
from launch.events.process.running_process_event import RunningProcessEvent

ActionMatcher = Union[Action, Callable[[Any], bool], None]
"""An action, a function that returns whether it matches an action, or None for all actions."""


class OnActionEventBase(EventHandler):
    """An event handler for one kind of events of an action."""

    def __init__(self, *, action_matcher: ActionMatcher, on_event: Reaction | None,
                 target_event_cls: type[ExecutionComplete] | type[RunningProcessEvent],
                 handle_once: bool = False) -> None:
        if not (action_matcher is None or isinstance(action_matcher, Action)
                or callable(action_matcher)):
            raise TypeError(f'target_action of {type(self).__name__} is {action_matcher!r}, but '
                            'must be an action or a function')
        super().__init__(matcher=self._is_target, entities=on_event, handle_once=handle_once)
        self.action_matcher = action_matcher
        self.target_event_cls = target_event_cls

    def _is_target(self, event: Event) -> bool:
        if not isinstance(event, self.target_event_cls):
            return False
        if self.action_matcher is None or self.action_matcher is event.action:
            return True
        return callable(self.action_matcher) and self.action_matcher(event.action)
