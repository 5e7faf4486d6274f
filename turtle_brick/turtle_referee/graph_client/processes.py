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
"""Run programs in separate processes, read their output, and end them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
import os
import re
import signal
import subprocess
import threading

END_TIME = 15.0
"""Timeout (s) for the end of a process after SIGINT."""

DEATH = re.compile(r'^\[ERROR\] \[((\S+)-\d+)\]: process has died .*exit code (-?\d+),', re.M)
"""The message of ros2 launch about a process that failed: its label, name and exit status."""

TRACEBACK = re.compile(r'^Traceback .*\n(?:(?: .*)?\n)*(.+)', re.M)
"""A Python traceback and the last line, which contains the error."""


def crashes(output: str) -> list[str]:
    """Return each failed process in the output of ros2 launch, with its error."""
    found = []
    for label, name, status in DEATH.findall(output):
        lines = ''.join(f'{line.removeprefix(f"[{label}] ")}\n' for line in output.splitlines()
                        if line.startswith(f'[{label}] '))
        errors = TRACEBACK.findall(lines) or [f'exit status {status}']
        found.append(f'{name} crashed: {errors[-1]}')
    return list(dict.fromkeys(found))


class Process:
    """
    A running program with its standard output and standard error.

        with Process(['ros2', 'run', 'turtle_brick', 'arena']) as arena:
            arena.wait_for_output('hovers', 10.0)
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] = {},
                 listener: Callable[[str], object] | None = None) -> None:
        """
        Start the program.

        :param environment: variables to add to the environment of the calling process
        :param listener: function that a separate thread calls with each line of output
        """
        self.command = list(command)
        self._listener = listener
        self._output_changed = threading.Condition()
        self._bytes = b''
        self._closed = False  # True after the program has closed its output
        # Without a display, turtlesim draws its window into memory.
        display = {} if os.environ.get('DISPLAY') else {'QT_QPA_PLATFORM': 'offscreen'}
        self._popen = subprocess.Popen(
            self.command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            # A Ctrl-C in the terminal must not reach the program before this process.
            start_new_session=True,
            env={**os.environ, 'PYTHONUNBUFFERED': '1', **display, **environment})
        self._reader = threading.Thread(target=self._read, name='output', daemon=True)
        self._reader.start()

    def __enter__(self) -> 'Process':
        """Return the process itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        close_all([self])

    def _read(self) -> None:
        assert self._popen.stdout is not None
        line = b''
        # A program may print a part of a line and wait, so chunks are read instead of lines.
        while chunk := os.read(self._popen.stdout.fileno(), 65536):
            with self._output_changed:
                self._bytes += chunk
                self._output_changed.notify_all()
            *lines, line = (line + chunk).split(b'\n')
            if self._listener is not None:
                for complete in lines:
                    self._listener(f'{complete.decode(errors="replace")}\n')
        with self._output_changed:
            self._closed = True
            self._output_changed.notify_all()

    @property
    def output(self) -> str:
        """Return all output so far."""
        with self._output_changed:
            return self._bytes.decode(errors='replace')

    @property
    def pid(self) -> int:
        """Return the process ID."""
        return self._popen.pid

    @property
    def status(self) -> int | None:
        """Return the exit status, or None while the process is running."""
        return self._popen.poll()

    @property
    def running(self) -> bool:
        """Return whether the process is still running."""
        return self.status is None

    def exit_message(self) -> str:
        """Return the exit status and the last lines of output; '' while the process is running."""
        if self.running:
            return ''
        self._reader.join(1.0)
        lines = ' / '.join(self.output.strip().splitlines()[-3:])
        return f'{self.command[0]} has ended with status {self.status}: {lines or "no output"}'

    def send(self, number: int) -> None:
        """Send a signal and do not wait for its effect."""
        self._popen.send_signal(number)

    def wait_for_output(self, pattern: str, timeout: float) -> re.Match[str]:
        """
        Wait until a regular expression matches the output; return the match.

        :param timeout: time limit (s)
        :raises TimeoutError: nothing matched in time, or before the process ended
        """
        with self._output_changed:
            self._output_changed.wait_for(
                lambda: self._closed or re.search(pattern, self.output), timeout)
            if match := re.search(pattern, self.output):
                return match
            raise TimeoutError(
                f'{self.command} {"ended" if self._closed else f"ran {timeout:g} s"} without '
                f'printing {pattern!r}; it printed:\n{self.output}')

    def wait(self, timeout: float) -> int:
        """Wait until the process ends; return its status, or raise TimeoutError."""
        try:
            status = self._popen.wait(timeout)
        except subprocess.TimeoutExpired:
            raise TimeoutError(f'{self.command} did not end within {timeout:g} s; it printed:\n'
                               f'{self.output}') from None
        self._reader.join(1.0)
        return status

    def stop(self, number: int = signal.SIGINT, timeout: float = END_TIME) -> int:
        """Send a signal and wait until the process ends; return its status."""
        if self.running:
            self.send(number)
        return self.wait(timeout)

    def kill(self) -> None:
        """Kill the process and its children at once."""
        with suppress(ProcessLookupError):
            os.killpg(self._popen.pid, signal.SIGKILL)
        self._popen.wait()
        self._reader.join(1.0)
        if self._popen.stdout is not None:
            self._popen.stdout.close()


def close_all(processes: Iterable[Process]) -> None:
    """Send SIGINT to all processes, wait for their end, and kill the remaining ones."""
    processes = list(processes)
    for process in processes:
        if process.running:
            process.send(signal.SIGINT)
    for process in processes:
        with suppress(TimeoutError):
            process.wait(END_TIME)
        process.kill()
