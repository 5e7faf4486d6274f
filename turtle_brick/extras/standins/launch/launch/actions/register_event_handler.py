# SPDX-License-Identifier: Apache-2.0
"""The action RegisterEventHandler."""

from __future__ import annotations

from typing import Any

from launch.action import Action
from launch.event_handler import BaseEventHandler
from launch.launch_context import LaunchContext


class RegisterEventHandler(Action):
    """Registers an event handler."""

    def __init__(self, event_handler: BaseEventHandler, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.event_handler = event_handler

    def execute(self, context: LaunchContext) -> None:
        context.register_event_handler(self.event_handler)
