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
"""The real launch and ros2: what was recorded, the files it was done with, and to do it again."""

from contextlib import suppress
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
TIME, GLANCE = 30.0, 0.02
"""How long (s) a command may take to do something, and how often it is looked at."""

PROGRAMS = {'ros2': 'ros2cli.cli', 'launch_test': 'launch_testing'}
"""The modules with the programs that can run in a fork."""

FORKS = get_context('forkserver')
"""Forks what has imported what these programs need, which takes 0.4 of their 0.6 s."""
FORKS.set_forkserver_preload([*PROGRAMS.values(), *(f'ros2cli.{name}' for name in (
    'graph', 'packages', 'traffic')), 'launch_xml', 'numpy', 'rclpy.action'])

_one = threading.Lock()
"""The forks are started, and asked for their status, by one thread at a time."""


def records(*files):
    """Return the records of files, by name."""
    return {record['name']: record for file in files
            for record in json.loads((DATA / f'{file}.json').read_text())['records']}


def write_files(top):
    """Write the files that were recorded with into a folder."""
    for name, file in json.loads((DATA / 'files.json').read_text()).items():
        path = top / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(file['text'])
        path.chmod(0o755 if file.get('executable') else 0o644)


def with_paths(words, files):
    """Return the words of a recorded command, with the folder that those files are in now."""
    return [word.replace('$FILES', str(files)).replace('$PROBE', f'{files}/probe')
            for word in words]


def become(words, environment, directory, *ends):
    """Do in this fork what a program does whose stdin, stdout and stderr are some pipes."""
    os.setsid()
    for number, end in enumerate(ends):
        os.dup2(end.fileno(), number)
        end.close()
    sys.stdin = open(0)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(directory)
    sys.argv[:] = words
    try:
        status = import_module(PROGRAMS[words[0]]).main()
    except SystemExit as end:
        status = end.code
    except BaseException:  # noqa: B902 -- of which Python itself tells so
        sys.excepthook(*sys.exc_info())
        status = 1
    gc.collect()  # takes nodes out of the graph, as the end of Python does, which a fork has not
    sys.exit(status)


class Command:
    """A command that runs in a process group of its own, as a shell starts it."""

    def __init__(self, words, environment, stdin=None, directory='/', forked=False):
        """Start it with pipes, of which the first may have a text and an end; maybe in a fork."""
        self.text, self.error = '', ''
        self.changed = threading.Condition()
        pipes = [FORKS.Pipe(duplex=False) for _ in range(3)]
        there = [end for end, _ in pipes[:1]] + [end for _, end in pipes[1:]]
        if forked:
            process = FORKS.Process(
                target=become, args=(words, environment, str(directory), *there), daemon=True)
            with _one:
                process.start()
        else:
            process = subprocess.Popen(
                words, env=environment, cwd=directory, start_new_session=True,
                **dict(zip(('stdin', 'stdout', 'stderr'), there)))
        for end in there:
            end.close()
        self.process, self.pid, self.stdin = process, process.pid, pipes[0][1]
        self.directory = directory
        self.readers = [threading.Thread(target=self._read, args=end, daemon=True) for end in (
            (pipes[1][0], 'text'), (pipes[2][0], 'error'))]
        for reader in self.readers:
            reader.start()
        if stdin is not None:
            os.write(self.stdin.fileno(), stdin.encode())
            self.stdin.close()

    def _read(self, end, name):
        while data := os.read(end.fileno(), 65536):
            with self.changed:
                setattr(self, name, getattr(self, name) + data.decode(errors='replace'))
                self.changed.notify_all()

    @property
    def status(self):
        """Return its status if it has ended, else None."""
        with _one:
            return (self.process.poll() if isinstance(self.process, subprocess.Popen)
                    else self.process.exitcode)

    def wait_for(self, condition, timeout=TIME):
        """Wait until something is so, or it has ended, or the time is over; tell if it is so."""
        deadline = monotonic() + timeout
        with self.changed:
            while not condition() and self.status is None and monotonic() < deadline:
                self.changed.wait(GLANCE)
            return condition()

    def has_said(self, what):
        """Tell whether whole lines of it have a pattern, or a pattern so often."""
        pattern, times = what if isinstance(what, list) else (what, 1)
        return len(re.findall(pattern, self.text[:self.text.rfind('\n') + 1], re.M)) >= times

    def send(self, name, whom):
        """Send a signal by its name to the process, or to its group."""
        with suppress(ProcessLookupError):
            (os.killpg if whom == 'group' else os.kill)(self.pid, getattr(signal, name))

    def left(self):
        """Return the processes of its group that live."""
        found = []
        for stat in Path('/proc').glob('[0-9]*/stat'):
            with suppress(OSError):
                state, _, group = stat.read_text().rpartition(')')[2].split()[:3]
                if int(group) == self.pid and state != 'Z':
                    found.append(stat.parent.name)
        return found

    def end(self, timeout=2 * TIME):
        """Wait until it has ended, end what is left of it, and return what that was."""
        try:
            assert self.wait_for(lambda: self.status is not None, timeout), self.text + self.error
            for reader in self.readers:
                reader.join(10)
            return self.left()
        finally:
            self.send('SIGKILL', 'group')


def done_here(words, patch, stdin=''):
    """
    Do in this process what `ros2` does; return its status and what it has said.

    :param patch: the MonkeyPatch that undoes what this changes
    """
    out, err = (io.TextIOWrapper(io.BytesIO(), write_through=True) for _ in range(2))
    for name, value in (('argv', words), ('stdin', io.StringIO(stdin)), ('stdout', out),
                        ('stderr', err)):
        patch.setattr(sys, name, value)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        import_module(PROGRAMS['ros2']).main()
    except SystemExit as end:
        status = end.code or 0
    for number, handler in handlers.items():
        signal.signal(number, handler)
    if isinstance(status, str):
        print(status, file=sys.stderr)
        status = 1
    text, error = (each.buffer.getvalue().decode() for each in (out, err))
    return SimpleNamespace(status=status, text=text, error=error)
