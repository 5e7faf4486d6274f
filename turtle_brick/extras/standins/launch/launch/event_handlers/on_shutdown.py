# SPDX-License-Identifier: Apache-2.0
"""The event handler OnShutdown."""

from __future__ import annotations

from launch.event_handler import EventHandler, Reaction
from launch.events.shutdown import Shutdown


class OnShutdown(EventHandler):
    """An event handler that reacts when the launch begins to shut down."""

    def __init__(self, *, on_shutdown: Reaction, handle_once: bool = False) -> None:
        super().__init__(matcher=lambda event: isinstance(event, Shutdown), entities=on_shutdown,
                         handle_once=handle_once)
