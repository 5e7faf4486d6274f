# SPDX-License-Identifier: Apache-2.0
"""The event handler OnProcessStart."""

from __future__ import annotations

from launch.event_handler import Reaction
from launch.event_handlers.on_action_event_base import ActionMatcher, OnActionEventBase
from launch.events.process.process_started import ProcessStarted


class OnProcessStart(OnActionEventBase):
    """An event handler that reacts when a process has started."""

    def __init__(self, *, target_action: ActionMatcher = None, on_start: Reaction,
                 handle_once: bool = False) -> None:
        super().__init__(action_matcher=target_action, on_event=on_start,
                         target_event_cls=ProcessStarted, handle_once=handle_once)
