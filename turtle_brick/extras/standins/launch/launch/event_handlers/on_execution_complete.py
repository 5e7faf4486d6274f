# SPDX-License-Identifier: Apache-2.0
"""The event handler OnExecutionComplete."""

from __future__ import annotations

from launch.event_handler import Reaction
from launch.event_handlers.on_action_event_base import ActionMatcher, OnActionEventBase
from launch.events.execution_complete import ExecutionComplete


class OnExecutionComplete(OnActionEventBase):
    """An event handler that reacts when an action has ended."""

    def __init__(self, *, target_action: ActionMatcher = None, on_completion: Reaction,
                 handle_once: bool = False) -> None:
        super().__init__(action_matcher=target_action, on_event=on_completion,
                         target_event_cls=ExecutionComplete, handle_once=handle_once)
