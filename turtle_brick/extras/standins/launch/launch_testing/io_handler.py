# SPDX-License-Identifier: Apache-2.0
"""The output of processes, which tests receive as `proc_output`."""

from __future__ import annotations

from collections.abc import Iterator
import re
import threading
from typing import Union

from launch.actions import ExecuteLocal
from launch.events.process import ProcessIO, ProcessStarted
from launch_testing.util.proc_lookup import (
    NoMatchingProcessException, Process, resolveProcesses)

Expected = Union[str, 're.Pattern[str]']
"""A text, or a pattern that matches the text."""


class IoHandler:
    """The output of all processes."""

    def __init__(self) -> None:
        self._outputs: dict[ExecuteLocal, list[ProcessIO]] = {}

    def track(self, event: ProcessStarted) -> None:
        """Add a process."""
        self._outputs.setdefault(event.action, [])

    def append(self, event: ProcessIO) -> None:
        """Store the output of a process."""
        self._outputs[event.action].append(event)

    def __iter__(self) -> Iterator[ProcessIO]:
        return iter([event for events in self._outputs.values() for event in events])

    def processes(self) -> list[ExecuteLocal]:
        """Return the actions that have started processes."""
        return list(self._outputs)

    def process_names(self) -> list[str]:
        """Return the names of all processes."""
        return [action.name for action in self.processes()]

    def __getitem__(self, key: Process) -> list[ProcessIO]:
        (action,) = resolveProcesses(self, process=key)
        return list(self._outputs[action])

    def text(self, action: ExecuteLocal) -> str:
        """Return the output of a process on stdout and stderr."""
        data = b''.join(event.text for event in self._outputs[action])
        return data.decode(errors='replace')

    def has_written(self, expected: Expected, process: Process | None, stream: str) -> bool:
        """Return whether the output of a process on a stream contains a text."""
        pattern = expected if isinstance(expected, re.Pattern) else re.compile(re.escape(expected))
        for action in resolveProcesses(self, process=process):
            data = b''.join(event.text for event in self._outputs[action]
                            if (event.from_stdout if stream == 'stdout' else event.from_stderr))
            if pattern.search(data.decode(errors='replace')):
                return True
        return False


class ActiveIoHandler(IoHandler):
    """The output of all processes while the launch is running."""

    def __init__(self) -> None:
        super().__init__()
        self._changed = threading.Condition()

    def append(self, event: ProcessIO) -> None:
        with self._changed:
            super().append(event)
            self._changed.notify_all()

    def assertWaitFor(self, expected_output: Expected, process: Process | None = None,
                      timeout: float = 10, stream: str = 'stderr') -> None:
        """Assert that a process writes a text within a timeout (s)."""
        def is_written() -> bool:
            try:
                return self.has_written(expected_output, process, stream)
            except NoMatchingProcessException:
                return False

        with self._changed:
            assert self._changed.wait_for(is_written, timeout), (
                f"Timed out waiting for output '{expected_output}'")
