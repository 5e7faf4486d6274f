# SPDX-License-Identifier: Apache-2.0
"""Run programs in separate processes, read their output, and stop them."""

import codecs
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
import os
from pathlib import Path
import re
import signal
import subprocess
import threading

import psutil
from turtle_graph.client.children import adopt_orphans, end_with_parent

END_TIME = 15.0
"""Timeout (s) for a process to exit after SIGINT."""
KILL_TIME = 5.0
"""Timeout (s) for processes to exit after SIGKILL."""
CONTROL = re.compile(r'\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*|[^\n])'
                     r'|[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]')
"""Pattern for a terminal's escape sequences and for all other control characters."""
SOURCE = re.compile(r'\[(\S+-\d+|ERROR)\] ')
"""Pattern for the beginning of a line from a node or of an error message from ros2 launch."""
MAX_SOURCES, MAX_SIZE, MAX_LINE = 50, 200_000, 100_000
"""Maximum numbers of sources of output, of characters stored for each one, and per line."""


def printable(text: str) -> str:
    """Return text without the escape sequences and control characters that change a terminal."""
    return CONTROL.sub('', text)


class Output:
    """
    The end of a program's output, for each node that ros2 launch started and for its errors.

    A node that prints in an endless loop therefore removes only its own older lines.
    """

    def __init__(self) -> None:
        self._lines: dict[str, deque[tuple[int, str]]] = {'': deque()}  # With line numbers.
        self._sizes = {'': 0}
        self._count = 0
        self._rest = ''  # The beginning of an incomplete line.

    def add(self, text: str) -> list[str]:
        """Store printed text, and return the lines that it completes."""
        *complete, self._rest = (self._rest + text).split('\n')
        lines = [f'{printable(line)}\n' for line in complete]
        if len(self._rest) > MAX_LINE:
            lines.append(printable(self._rest))
            self._rest = ''
        for line in lines:
            self._store(line)
        return lines

    def _store(self, line: str) -> None:
        match = SOURCE.match(line)
        source = match[1] if match else ''
        if source not in self._lines:
            if len(self._lines) == MAX_SOURCES:
                source = ''
            self._lines.setdefault(source, deque())
            self._sizes.setdefault(source, 0)
        self._lines[source].append((self._count, line))
        self._sizes[source] += len(line)
        self._count += 1
        while self._sizes[source] > MAX_SIZE:
            self._sizes[source] -= len(self._lines[source].popleft()[1])

    def __str__(self) -> str:
        lines = sorted(line for lines in self._lines.values() for line in lines)
        return ''.join([*(line for _, line in lines), printable(self._rest)])


class Process(AbstractContextManager['Process']):
    """A context manager that runs a program and reads its standard output and standard error."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] = {},
                 listener: Callable[[str], object] | None = None,
                 directory: Path | None = None) -> None:
        """Start a program with extra environment variables. Pass its output to `listener`."""
        self.command = list(command)
        self._listener = listener
        self._output_changed = threading.Condition()
        self._output = Output()
        self._closed = False
        # Without a display, turtlesim renders its window off-screen.
        display = {} if os.environ.get('DISPLAY') else {'QT_QPA_PLATFORM': 'offscreen'}
        # All programs that this program starts, and no others, inherit this variable.
        self._mark = f'STARTED_BY_{os.getpid()}_{id(self)}'
        # In a new session, the program does not receive SIGINT when Ctrl-C is pressed.
        self._popen = subprocess.Popen(
            self.command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, start_new_session=True, cwd=directory,
            preexec_fn=end_with_parent,
            env={**os.environ, 'PYTHONUNBUFFERED': '1', **display, **environment, self._mark: '1'})
        self.pid = self._popen.pid
        self._reader = threading.Thread(target=self._read, name='output', daemon=True)
        self._reader.start()

    def __exit__(self, *_: object) -> None:
        close_all([self])

    def _read(self) -> None:
        assert self._popen.stdout is not None
        decoder = codecs.getincrementaldecoder('utf-8')(errors='replace')
        # Chunks are read instead of lines because a program may print an incomplete line and wait.
        while chunk := os.read(self._popen.stdout.fileno(), 65536):
            with self._output_changed:
                lines = self._output.add(decoder.decode(chunk))
                self._output_changed.notify_all()
            if self._listener is not None:
                for line in lines:
                    self._listener(line)
        with self._output_changed:
            self._closed = True
            self._output_changed.notify_all()

    @property
    def output(self) -> str:
        """Return the output so far, without control characters and without very old lines."""
        with self._output_changed:
            return str(self._output)

    @property
    def running(self) -> bool:
        """Return whether the process is still running."""
        return self._popen.poll() is None

    def exit_message(self, count: int = 3) -> str:
        """Return the exit status and the last `count` output lines except [INFO] messages."""
        self._reader.join(1.0)
        lines = [line.strip() for line in self.output.splitlines()
                 if line[:7] not in ('', '[INFO] ')]
        return (f'{Path(self.command[0]).name} exited with status {self._popen.returncode}: '
                f'{" / ".join(lines[-count:]) or "no output"}')

    def send(self, number: int) -> None:
        """Send a signal to the process unless the process has exited."""
        self._popen.send_signal(number)

    def wait_for_output(self, pattern: str, timeout: float) -> re.Match[str]:
        """Wait for output that matches a pattern, or raise TimeoutError after the timeout (s)."""
        with self._output_changed:
            self._output_changed.wait_for(
                lambda: self._closed or re.search(pattern, self.output), timeout)
            if match := re.search(pattern, self.output):
                return match
            event = 'exited' if self._closed else f'ran {timeout:g} s'
            raise TimeoutError(f'{self.command} {event} without printing {pattern!r}; '
                               f'it printed:\n{self.output}')

    def wait(self, timeout: float) -> int:
        """Wait until the process exits and return the exit status, or raise TimeoutError."""
        try:
            status = self._popen.wait(timeout)
        except subprocess.TimeoutExpired:
            raise TimeoutError(f'{self.command} did not exit within {timeout:g} s; it printed:\n'
                               f'{self.output}') from None
        self._reader.join(1.0)
        return status

    def stop(self, number: int = signal.SIGINT, timeout: float = END_TIME) -> int:
        """Send a signal to the process, wait until it exits, and return the exit status."""
        self.send(number)
        return self.wait(timeout)

    def family(self) -> list[psutil.Process]:
        """Return the process and all processes that it has started, directly or indirectly."""
        family = []
        for process in psutil.process_iter():
            with suppress(psutil.Error, ProcessLookupError):
                # A program with an empty environment has no mark, but is in the same session.
                if self._mark in process.environ() or os.getsid(process.pid) == self.pid:
                    family.append(process)
        return family

    def kill(self) -> None:
        """Kill the process and all processes that it has started immediately."""
        for process in self.family():
            with suppress(psutil.Error):
                process.kill()
        self._popen.wait()
        self._reader.join(1.0)
        if self._popen.stdout is not None:
            self._popen.stdout.close()


def close_all(processes: Sequence[Process]) -> None:
    """Send SIGINT to the given processes, wait for them to exit, and kill those still running."""
    try:
        for process in processes:
            process.send(signal.SIGINT)
        for process in processes:
            with suppress(TimeoutError):
                process.wait(END_TIME)
    finally:
        for process in processes:
            process.kill()


@contextmanager
def no_descendants() -> Iterator[None]:
    """Kill, at the end, all processes that this program has started, directly or indirectly."""
    # Even a process that has left its session, and whose parent has ended, is found then.
    adopt_orphans()
    try:
        yield
    finally:
        while running := psutil.Process().children(recursive=True):
            for process in running:
                with suppress(psutil.Error):
                    process.kill()
            if psutil.wait_procs(running, KILL_TIME)[1]:
                break
