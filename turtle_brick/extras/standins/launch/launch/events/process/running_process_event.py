# SPDX-License-Identifier: Apache-2.0
"""The base class of the events of a process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from launch.event import Event

if TYPE_CHECKING:
    from launch.actions.execute_local import ExecuteLocal


class RunningProcessEvent(Event):
    """Something that a process has done."""

    def __init__(self, *, action: ExecuteLocal, name: str, cmd: list[str], cwd: str | None,
                 env: Mapping[str, str], pid: int) -> None:
        self.action = action
        self.process_name = name
        self.cmd = cmd
        self.cwd = cwd
        self.env = env
        self.pid = pid
