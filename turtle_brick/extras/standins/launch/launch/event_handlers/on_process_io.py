# SPDX-License-Identifier: Apache-2.0
"""The event handler OnProcessIO."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from launch.event import Event
from launch.event_handler import to_entities
from launch.event_handlers.on_action_event_base import ActionMatcher, OnActionEventBase
from launch.events.process.process_io import ProcessIO
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity

OnOutput = Callable[[ProcessIO], Any]
"""A function that may return entities."""


class OnProcessIO(OnActionEventBase):
    """An event handler that passes the output of a process to functions."""

    def __init__(self, *, target_action: ActionMatcher = None, on_stdin: OnOutput | None = None,
                 on_stdout: OnOutput | None = None, on_stderr: OnOutput | None = None,
                 handle_once: bool = False) -> None:
        super().__init__(action_matcher=target_action, on_event=None, target_event_cls=ProcessIO,
                         handle_once=handle_once)
        self.on_stdin = on_stdin
        self.on_stdout = on_stdout
        self.on_stderr = on_stderr

    def handle(self, event: Event, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        assert isinstance(event, ProcessIO)
        reaction: Any = self.on_stdout if event.from_stdout else self.on_stderr
        return to_entities(None if reaction is None else reaction(event))
