# SPDX-License-Identifier: Apache-2.0
"""Replay `ros2` and other commands recorded with the real ROS 2 programs."""

from contextlib import contextmanager, suppress
import gc
from importlib import import_module
import io
import json
from multiprocessing import get_context
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import threading
from time import monotonic
from types import SimpleNamespace

DATA = Path(__file__).parent / 'data' / 'ros2'

TIMEOUT = 120.0
"""Default timeout (s) for the output of a command."""

POLL_TIME = 0.1
"""Maximum time (s) between two checks of a condition."""

PROGRAMS = {'ros2': 'ros2cli.cli', 'launch_test': 'launch_testing.launch_test'}
"""Module of each program that can run in a forked process."""

FORKS = get_context('forkserver')
"""Multiprocessing context that forks from a process with preloaded modules. A command takes 0.2 s
in a forked process, but 0.6 s in a new process."""
FORKS.set_forkserver_preload([
    *PROGRAMS.values(), 'launch_xml', 'launch_yaml', 'numpy', 'rclpy.action', 'ros2cli.messages',
    'ros2cli.node.direct', 'ros2param.api', 'ros2topic.api.measure'])

_fork_lock = threading.Lock()
"""Lock for forking a process and for reading an exit status."""


def records(*files):
    return {record['name']: record for file in files
            for record in json.loads((DATA / f'{file}.json').read_text())['records']}


def write_files(directory):
    for name, file in json.loads((DATA / 'files.json').read_text()).items():
        path = directory / name
        path.parent.mkdir(parents=True, exist_ok=True)
        text = file['text']
        if name.startswith('probe/'):  # Without site-packages, a program starts twice as fast.
            text = text.replace('env python3\n', 'env -S python3 -S\n')
        path.write_text(text)
        path.chmod(0o755 if file.get('executable') else 0o644)


def with_paths(words, files):
    return [word.replace('$FILES', str(files)).replace('$PROBE', f'{files}/probe')
            for word in words]


def run_in_fork(words, environment, directory, *pipes):
    """Run a program in this forked process, with pipes for stdin, stdout and stderr."""
    os.setsid()
    for number, pipe in enumerate(pipes):
        os.dup2(pipe.fileno(), number)
        pipe.close()
    sys.stdin = open(0)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(directory)
    sys.argv[:] = words
    try:
        status = import_module(PROGRAMS[words[0]]).main()
    except SystemExit as end:
        status = end.code
    except BaseException:  # noqa: B902 -- Python prints any exception at its end
        sys.excepthook(*sys.exc_info())
        status = 1
    gc.collect()  # Destroy the nodes, because a forked process exits without cleanup.
    sys.exit(status)


class Command:
    """A running command in its own process group."""

    def __init__(self, words, environment, stdin=None, directory='/', forked=False):
        self.text, self.error = '', ''
        self.changed = threading.Condition()
        stdin_pipe, stdout_pipe, stderr_pipe = (FORKS.Pipe(duplex=False) for _ in range(3))
        ends = [stdin_pipe[0], stdout_pipe[1], stderr_pipe[1]]
        if forked:
            self.process = FORKS.Process(
                target=run_in_fork, args=(words, environment, str(directory), *ends), daemon=True)
            with _fork_lock:
                self.process.start()
        else:
            self.process = subprocess.Popen(
                words, env=environment, cwd=directory, start_new_session=True,
                stdin=ends[0], stdout=ends[1], stderr=ends[2])
        for end in ends:
            end.close()
        self.pid, self.stdin, self.directory = self.process.pid, stdin_pipe[1], directory
        self.readers = [
            threading.Thread(target=self._read, args=(stdout_pipe[0], 'text'), daemon=True),
            threading.Thread(target=self._read, args=(stderr_pipe[0], 'error'), daemon=True)]
        for reader in self.readers:
            reader.start()
        if stdin is not None:
            os.write(self.stdin.fileno(), stdin.encode())
            self.stdin.close()

    def _read(self, pipe, name):
        while data := os.read(pipe.fileno(), 65536):
            with self.changed:
                setattr(self, name, getattr(self, name) + data.decode(errors='replace'))
                self.changed.notify_all()
        with self.changed:
            self.changed.notify_all()

    @property
    def status(self):
        with _fork_lock:
            return (self.process.poll() if isinstance(self.process, subprocess.Popen)
                    else self.process.exitcode)

    def wait_for(self, condition, timeout=TIMEOUT):
        """Wait until a condition holds or the command exits. Return the condition's last value."""
        deadline = monotonic() + timeout
        with self.changed:
            while not condition() and self.status is None and monotonic() < deadline:
                self.changed.wait(POLL_TIME)
            return condition()

    def has_printed(self, expected):
        """Return whether the output has a match for a pattern, or n matches for [pattern, n]."""
        pattern, count = expected if isinstance(expected, list) else (expected, 1)
        return len(re.findall(pattern, self.text[:self.text.rfind('\n') + 1], re.M)) >= count

    def send(self, name, target):
        with suppress(ProcessLookupError):
            (os.killpg if target == 'group' else os.kill)(self.pid, getattr(signal, name))

    def running_processes(self):
        found = []
        for stat in Path('/proc').glob('[0-9]*/stat'):
            with suppress(OSError):
                state, _, group = stat.read_text().rpartition(')')[2].split()[:3]
                if int(group) == self.pid and state != 'Z':
                    found.append(stat.parent.name)
        return found

    def end(self, timeout=2 * TIMEOUT):
        """Wait for the command to exit, kill its remaining processes and return their IDs."""
        try:
            assert self.wait_for(lambda: self.status is not None, timeout), self.text + self.error
            for reader in self.readers:
                reader.join(10)
            return self.running_processes()
        finally:
            self.send('SIGKILL', 'group')


@contextmanager
def restored_signal_handlers():
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def run_here(words, patch, stdin=''):
    """Run `ros2` in this process and return the status and output. `patch` restores sys."""
    out, err = (io.TextIOWrapper(io.BytesIO(), write_through=True) for _ in range(2))
    for name, value in (('argv', words), ('stdin', io.StringIO(stdin)), ('stdout', out),
                        ('stderr', err)):
        patch.setattr(sys, name, value)
    with restored_signal_handlers():
        try:
            import_module(PROGRAMS['ros2']).main()
        except SystemExit as end:
            status = end.code or 0
    if isinstance(status, str):
        print(status, file=sys.stderr)
        status = 1
    text, error = (each.buffer.getvalue().decode() for each in (out, err))
    return SimpleNamespace(status=status, text=text, error=error)
