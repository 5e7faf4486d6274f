# SPDX-License-Identifier: Apache-2.0
"""Assertions about the output of processes."""

from __future__ import annotations

from launch_testing.io_handler import Expected, IoHandler
from launch_testing.util.proc_lookup import Process, resolveProcesses


def assertInStream(proc_output: IoHandler, expected_output: Expected, process: Process | None,
                   *, stream: str = 'stderr') -> None:
    """Assert that a process has written text, or text that matches a pattern, to a stream."""
    names = ', '.join(action.name for action in resolveProcesses(proc_output, process=process))
    assert proc_output.has_written(expected_output, process, stream), (
        f"Did not find '{expected_output}' in output for any of the matching processes: {names}")


def assertInStdout(proc_output: IoHandler, expected_output: Expected,
                   process: Process | None) -> None:
    """Assert that a process has written text, or text that matches a pattern, to stdout."""
    assertInStream(proc_output, expected_output, process, stream='stdout')


def assertInStderr(proc_output: IoHandler, expected_output: Expected,
                   process: Process | None) -> None:
    """Assert that a process has written text, or text that matches a pattern, to stderr."""
    assertInStream(proc_output, expected_output, process, stream='stderr')
