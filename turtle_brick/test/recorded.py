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
import json
import os
from pathlib import Path
import re
import signal
import subprocess
import threading
from time import monotonic

from forked import Forked

DATA = Path(__file__).parent / 'data' / 'ros2'
TIME, GLANCE = 30.0, 0.02
"""How long (s) a command may take to do something, and how often it is looked at."""


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


class Command:
    """A command that runs in a process group of its own, as a shell starts it."""

    def __init__(self, words, environment, stdin=None, cwd=None, forked=None):
        """
        Start it with pipes, of which the first may have a text and an end.

        :param forked: the modules and the Python that do it in a fork; see Forked
        """
        self.text, self.error = '', ''
        self.changed = threading.Condition()
        pipe = subprocess.PIPE
        self.popen = Forked(*forked, words, environment, cwd) if forked else subprocess.Popen(
            words, env=environment, cwd=cwd, start_new_session=True, stdin=pipe, stdout=pipe,
            stderr=pipe)
        ends = [(self.popen.stdout.fileno(), 'text'), (self.popen.stderr.fileno(), 'error')]
        self.readers = [threading.Thread(target=self._read, args=end, daemon=True) for end in ends]
        for reader in self.readers:
            reader.start()
        if stdin is not None:
            self.popen.stdin.write(stdin.encode())
            self.popen.stdin.close()

    def _read(self, end, name):
        while data := os.read(end, 65536):
            with self.changed:
                setattr(self, name, getattr(self, name) + data.decode(errors='replace'))
                self.changed.notify_all()

    def wait_for(self, condition):
        """Wait until something is so, or it has ended, or the time is over; tell if it is so."""
        deadline = monotonic() + TIME
        with self.changed:
            while not condition() and self.popen.poll() is None and monotonic() < deadline:
                self.changed.wait(GLANCE)
            return condition()

    def has_said(self, pattern, times=1):
        """Tell whether whole lines of it have a pattern so often."""
        return len(re.findall(pattern, self.text[:self.text.rfind('\n') + 1], re.M)) >= times

    def send(self, name, whom):
        """Send a signal by its name to the process, or to its group."""
        with suppress(ProcessLookupError):
            (os.killpg if whom == 'group' else os.kill)(self.popen.pid, getattr(signal, name))

    def left(self):
        """Return the processes of its group that live."""
        found = []
        for stat in Path('/proc').glob('[0-9]*/stat'):
            with suppress(OSError):
                state, _, group = stat.read_text().rpartition(')')[2].split()[:3]
                if int(group) == self.popen.pid and state != 'Z':
                    found.append(stat.parent.name)
        return found

    def end(self, timeout=2 * TIME):
        """Wait until it has ended; return its status, and what is left of it, which then goes."""
        try:
            status = self.popen.wait(timeout)
            for reader in self.readers:
                reader.join(10)
            return status, self.left()
        finally:
            self.send('SIGKILL', 'group')
