# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
