# SPDX-License-Identifier: Apache-2.0
"""The launch context."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, MutableMapping, Sequence
from contextlib import suppress
import os
import signal
from types import SimpleNamespace
from typing import Any, TYPE_CHECKING

from launch.events.execution_complete import ExecutionComplete

if TYPE_CHECKING:
    from launch.actions.execute_local import ExecuteLocal
    from launch.event import Event
    from launch.event_handler import BaseEventHandler
    from launch.events.shutdown import Shutdown
    from launch.launch_description_entity import LaunchDescriptionEntity
    from launch.substitution import Substitution


class LaunchContext:
    """The state of a launch: launch configurations, environment variables and processes."""

    def __init__(self, *, argv: Sequence[str] | None = None,
                 noninteractive: bool = False) -> None:
        self.argv = list(argv or ())
        self.noninteractive = noninteractive
        self.launch_configurations: dict[str, Any] = {}
        self.environment: MutableMapping[str, str] = os.environ
        self.initial_environment = dict(os.environ)
        self.launch_file = ''
        self.locals = SimpleNamespace(event=None)
        self.saved_configurations: list[dict[str, Any]] = []
        self.saved_environments: list[dict[str, str]] = []
        self.shutting_down = asyncio.Event()
        self.tasks: list[asyncio.Future[Any]] = []
        self.processes: list[ExecuteLocal] = []
        self.process_count = 0
        self.event_handlers: list[BaseEventHandler] = []
        """Event handlers, the latest first."""
        self.signal = signal.SIGINT
        """First signal that is sent to end a process."""

    def perform_substitution(self, substitution: Substitution) -> str:
        """Return the text of a substitution."""
        return substitution.perform(self)

    def set_environment(self, environment: dict[str, str]) -> None:
        """Replace all environment variables of this process by the given ones."""
        self.environment.clear()
        self.environment.update(environment)

    @property
    def is_shutdown(self) -> bool:
        """Return whether the launch has begun to shut down."""
        return self.shutting_down.is_set()

    def create_task(self, coroutine: Coroutine[Any, Any, Any]) -> asyncio.Future[Any]:
        """Start a task that must end before the launch can end."""
        task = asyncio.ensure_future(coroutine)
        self.tasks.append(task)
        return task

    def register_event_handler(self, event_handler: BaseEventHandler) -> None:
        """Add an event handler, which handles events before all earlier ones."""
        self.event_handlers.insert(0, event_handler)

    def unregister_event_handler(self, event_handler: BaseEventHandler) -> None:
        """Remove an event handler."""
        self.event_handlers.remove(event_handler)

    def emit_event_sync(self, event: Event) -> None:
        """Pass an event to all matching handlers, and execute the entities that they return."""
        for handler in list(self.event_handlers):
            if not handler.matches(event):
                continue
            if handler.handle_once:
                self.unregister_event_handler(handler)
            outer_event, self.locals.event = self.locals.event, event
            for entity in handler.handle(event, self):
                entity.visit(self)
            self.locals.event = outer_event

    async def emit_event(self, event: Event, after: asyncio.Future[Any] | None = None) -> None:
        """Emit an event, optionally after a future is done."""
        if after is not None:
            await asyncio.wait([after])
        self.emit_event_sync(event)

    def announce_completion(self, entity: LaunchDescriptionEntity) -> None:
        """Emit the event ExecutionComplete when an entity has ended."""
        event = ExecutionComplete(action=entity)
        if any(handler.matches(event) for handler in self.event_handlers):
            self.create_task(self.emit_event(event, entity.get_asyncio_future()))

    async def pause(self, seconds: float) -> None:
        """Wait for a duration (s) or until the launch begins to shut down."""
        with suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self.shutting_down.wait(), seconds)

    def shutdown(self, event: Shutdown) -> None:
        """Begin to shut down, and end all processes."""
        if not self.is_shutdown:
            self.shutting_down.set()
            self.create_task(self.emit_event(event))
        for process in self.processes:
            process.end(self.signal)
