# SPDX-License-Identifier: Apache-2.0
"""The event handler OnProcessExit."""

from __future__ import annotations

from launch.event_handler import Reaction
from launch.event_handlers.on_action_event_base import ActionMatcher, OnActionEventBase
from launch.events.process.process_exited import ProcessExited


class OnProcessExit(OnActionEventBase):
    """An event handler that reacts when a process has ended."""

    def __init__(self, *, target_action: ActionMatcher = None, on_exit: Reaction,
                 handle_once: bool = False) -> None:
        super().__init__(action_matcher=target_action, on_event=on_exit,
                         target_event_cls=ProcessExited, handle_once=handle_once)
