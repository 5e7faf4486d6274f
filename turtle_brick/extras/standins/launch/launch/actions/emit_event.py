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
