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
"""The search for processes."""

from __future__ import annotations

from typing import Protocol, Union

from launch.actions import ExecuteLocal

Process = Union[ExecuteLocal, str]
"""The action that starts a process, or a part of the name of the process."""


class NoMatchingProcessException(Exception):
    """Raised when no process, or more than one process, matches a name."""


class ProcessHandler(Protocol):
    """An object that knows the processes of a launch."""

    def processes(self) -> list[ExecuteLocal]:
        """Return the actions that have started processes."""
        ...


def resolveProcesses(info_obj: ProcessHandler, *,
                     process: Process | None = None) -> list[ExecuteLocal]:
    """
    Return the actions of the processes that match (by default, of all processes).

    :raises NoMatchingProcessException: if not exactly one process matches a given one
    """
    known = info_obj.processes()
    if process is None:
        found = known
    elif isinstance(process, str):
        found = [action for action in known if process in action.name]
    else:
        found = [action for action in known if action is process]
    if not found or len(found) > 1 and process is not None:
        names = ', '.join(action.name for action in known)
        raise NoMatchingProcessException(
            f"Found {len(found)} processes matching name '{process}'. Procs: {names}")
    return found
