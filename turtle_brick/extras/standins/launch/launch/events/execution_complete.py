# SPDX-License-Identifier: Apache-2.0
"""The event ExecutionComplete."""

from __future__ import annotations

from launch.event import Event
from launch.launch_description_entity import LaunchDescriptionEntity


class ExecutionComplete(Event):
    """The execution of an action has ended."""

    def __init__(self, *, action: LaunchDescriptionEntity) -> None:
        self.action = action
