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
"""
A program in a process of its own: read what it prints, signal it, end it and what it started.

    with Process(['ros2', 'run', 'turtle_brick', 'arena']) as arena:
        arena.wait_for_output('hovers', 10.0)
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
import os
import re
import signal
import subprocess
import threading

END_TIME = 15.0  # how long (s) a process may take to end when it is asked to
LAST_LINES = 3  # how many lines of what it said last tell why a process has ended


class Process:
    """A program that runs, with what it prints: standard error too."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] = {},
                 listener: Callable[[str], object] | None = None) -> None:
        """
        Start it.

        :param environment: further variables, besides those of this process
        :param listener: called with each line that it prints, in a thread of its own
        """
        self.command = list(command)
        self._listener = listener
        self._printed = threading.Condition()
        self._bytes = b''
        self._silent = False  # whether it prints no more
        # Without a display, turtlesim draws its window into memory.
        display = {} if os.environ.get('DISPLAY') else {'QT_QPA_PLATFORM': 'offscreen'}
        self._popen = subprocess.Popen(
            self.command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            # A Ctrl-C is for the process that started it, which then ends this one in order.
            start_new_session=True,
            env={**os.environ, 'PYTHONUNBUFFERED': '1', **display, **environment})
        self._reader = threading.Thread(target=self._read, name='output', daemon=True)
        self._reader.start()

    def __enter__(self) -> 'Process':
        """Return the process itself; on leaving it, it ends."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        self.close()

    def _read(self) -> None:
        assert self._popen.stdout is not None
        line = b''
        # Not line by line: some print the begin of one, and wait.
        while chunk := os.read(self._popen.stdout.fileno(), 65536):
            with self._printed:
                self._bytes += chunk
                self._printed.notify_all()
            *lines, line = (line + chunk).split(b'\n')
            if self._listener is not None:
                for one in lines:
                    self._listener(f'{one.decode(errors="replace")}\n')
        with self._printed:
            self._silent = True
            self._printed.notify_all()

    @property
    def output(self) -> str:
        """Return what it has printed so far."""
        with self._printed:
            return self._bytes.decode(errors='replace')

    @property
    def pid(self) -> int:
        """Return the number of the process."""
        return self._popen.pid

    @property
    def status(self) -> int | None:
        """Return its exit status, None while it runs."""
        return self._popen.poll()

    @property
    def running(self) -> bool:
        """Return whether it has not ended yet."""
        return self.status is None

    def exit_message(self) -> str:
        """Say how it has ended and what it said last; nothing while it runs."""
        if self.running:
            return ''
        self._reader.join(1.0)
        said = ' / '.join(self.output.strip().splitlines()[-LAST_LINES:])
        return f'{self.command[0]} has ended with status {self.status}: {said or "no word"}'

    def send(self, number: int) -> None:
        """Send it a signal, and wait for nothing."""
        self._popen.send_signal(number)

    def wait_for_output(self, pattern: str, timeout: float) -> re.Match[str]:
        """
        Wait until it has printed what a regular expression finds; return the match.

        :raises TimeoutError: it did not within a time (s), or ended without
        """
        with self._printed:
            self._printed.wait_for(
                lambda: self._silent or re.search(pattern, self.output), timeout)
            if found := re.search(pattern, self.output):
                return found
            raise TimeoutError(
                f'{self.command} {"ended" if self._silent else f"ran {timeout:g} s"} without '
                f'printing {pattern!r}; it printed:\n{self.output}')

    def wait(self, timeout: float) -> int:
        """Wait until it ends by itself and return its status; TimeoutError after a time (s)."""
        try:
            status = self._popen.wait(timeout)
        except subprocess.TimeoutExpired:
            raise TimeoutError(f'{self.command} did not end within {timeout:g} s; it printed:\n'
                               f'{self.output}') from None
        self._reader.join(1.0)
        return status

    def stop(self, number: int = signal.SIGINT, timeout: float = END_TIME) -> int:
        """Request it to end by a signal and return its status; TimeoutError after a time (s)."""
        if self.running:
            self.send(number)
        return self.wait(timeout)

    def kill(self) -> None:
        """End it and what it has started, at once."""
        with suppress(ProcessLookupError):
            os.killpg(self._popen.pid, signal.SIGKILL)
        self._popen.wait()
        self._reader.join(1.0)
        if self._popen.stdout is not None:
            self._popen.stdout.close()

    def close(self, timeout: float = END_TIME) -> None:
        """End it in order if it does so within a time (s), and leave nothing behind."""
        close_all([self], timeout)


def close_all(processes: Iterable[Process], timeout: float = END_TIME) -> None:
    """End several processes, which are all asked before the first is waited for."""
    processes = list(processes)
    for process in processes:
        if process.running:
            process.send(signal.SIGINT)
    for process in processes:
        with suppress(TimeoutError):
            process.wait(timeout)
        process.kill()
