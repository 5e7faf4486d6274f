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
