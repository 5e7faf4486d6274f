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
