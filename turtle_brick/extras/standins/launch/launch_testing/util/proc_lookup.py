# SPDX-License-Identifier: Apache-2.0
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
        matching = known
    elif isinstance(process, str):
        matching = [action for action in known if process in action.name]
    else:
        matching = [action for action in known if action is process]
    if not matching or len(matching) > 1 and process is not None:
        names = ', '.join(action.name for action in known)
        raise NoMatchingProcessException(
            f"Found {len(matching)} processes matching name '{process}'. Procs: {names}")
    return matching
