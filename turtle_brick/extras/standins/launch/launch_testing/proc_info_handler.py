# SPDX-License-Identifier: Apache-2.0
"""The starts and exit codes of processes, which tests receive as `proc_info`."""

from __future__ import annotations

from collections.abc import Iterator
import threading

from launch.actions import ExecuteLocal
from launch.events.process import ProcessExited, RunningProcessEvent
from launch_testing.util.proc_lookup import (
    NoMatchingProcessException, Process, resolveProcesses)


class ProcInfoHandler:
    """The latest start or end of each process."""

    def __init__(self) -> None:
        self._events: dict[ExecuteLocal, RunningProcessEvent] = {}

    def append(self, event: RunningProcessEvent) -> None:
        """Store the start or end of a process."""
        self._events[event.action] = event

    def __iter__(self) -> Iterator[RunningProcessEvent]:
        return iter(list(self._events.values()))

    def processes(self) -> list[ExecuteLocal]:
        """Return the actions that have started processes."""
        return list(self._events)

    def process_names(self) -> list[str]:
        """Return the names of all processes."""
        return [action.name for action in self.processes()]

    def __getitem__(self, key: Process) -> RunningProcessEvent:
        (action,) = resolveProcesses(self, process=key)
        return self._events[action]

    def exit_code(self, action: ExecuteLocal) -> int | None:
        """Return the exit code of a process, or None if it is running."""
        event = self._events[action]
        return event.returncode if isinstance(event, ProcessExited) else None


class ActiveProcInfoHandler(ProcInfoHandler):
    """The latest start or end of each process while the launch is running."""

    def __init__(self) -> None:
        super().__init__()
        self._changed = threading.Condition()

    def append(self, event: RunningProcessEvent) -> None:
        with self._changed:
            super().append(event)
            self._changed.notify_all()

    def _has_started(self, process: Process) -> bool:
        try:
            return bool(resolveProcesses(self, process=process))
        except NoMatchingProcessException:
            return False

    def _has_ended(self, process: Process) -> bool:
        return self._has_started(process) and isinstance(self[process], ProcessExited)

    def assertWaitForStartup(self, process: Process, timeout: float = 10) -> None:
        """Assert that a process starts within a timeout (s)."""
        with self._changed:
            assert self._changed.wait_for(lambda: self._has_started(process), timeout), (
                f'Timed out waiting for process {process} to start')

    def assertWaitForShutdown(self, process: Process, timeout: float = 10) -> None:
        """Assert that a process ends within a timeout (s)."""
        with self._changed:
            assert self._changed.wait_for(lambda: self._has_ended(process), timeout), (
                f'Timed out waiting for process {process} to end')
