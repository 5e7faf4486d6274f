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
