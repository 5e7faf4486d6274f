# SPDX-License-Identifier: Apache-2.0
"""The action EmitEvent."""

from __future__ import annotations

from typing import Any

from launch.action import Action
from launch.event import Event
from launch.events.shutdown import Shutdown
from launch.launch_context import LaunchContext


class EmitEvent(Action):
    """Emits an event, such as launch.events.Shutdown."""

    def __init__(self, *, event: Event, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.event = event

    def execute(self, context: LaunchContext) -> None:
        if isinstance(self.event, Shutdown):
            context.shutdown(self.event)
        else:
            context.emit_event_sync(self.event)
