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
Processes of Python that need not import first: forks of one that has imported what they need.

Imports take most of the processor time (0.4 of 0.6 s) of a command like `ros2 node list`.
"""

from functools import cache
import json
import os
from select import select
import socket
import subprocess
import sys
from threading import Lock

SERVER = """
import contextlib, importlib, json, os, signal, socket, sys
for name in sys.argv[2:]:
    with contextlib.suppress(ImportError):
        importlib.import_module(name)
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
server = socket.socket(fileno=int(sys.argv[1]))
while True:
    asked, ends, *_ = socket.recv_fds(server, 1 << 20, 4)
    if not asked:
        sys.exit()
    if os.fork() == 0:
        break
    for end in ends:
        os.close(end)
server.close()
*streams, told = ends
signal.signal(signal.SIGCHLD, signal.SIG_DFL)
started = os.fork()
if started:
    for end in streams:
        os.close(end)
    os.write(told, b'%d\\n' % started)
    os.write(told, b'%d\\n' % os.waitstatus_to_exitcode(os.waitpid(started, 0)[1]))
    os._exit(0)
os.setsid()
os.close(told)
for number, end in enumerate(streams):
    os.dup2(end, number)
    os.close(end)
source, sys.argv[:], environment, directory = json.loads(asked)
os.environ.clear()
os.environ.update(environment)
os.chdir(directory)
sys.stdout.reconfigure(line_buffering='PYTHONUNBUFFERED' in environment)
exec(source)
"""

ROS2_MODULES = ('ros2cli.cli', 'ros2cli.graph', 'ros2cli.traffic', 'rclpy.action', 'numpy')
ROS2 = 'from ros2cli.cli import main; sys.exit(main())'


_one = Lock()


@cache
def server(*modules):
    """Start what has imported modules; return how to ask it for forks."""
    ours, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with other:
        subprocess.Popen([sys.executable, '-c', SERVER, str(other.fileno()), *modules],
                         pass_fds=[other.fileno()], start_new_session=True)
    return ours


class Forked:
    """What runs some Python in a process of its own; as subprocess.Popen, in a new session."""

    def __init__(self, modules, source, argv, env, cwd):
        """Start it, with pipes."""
        ends = [os.pipe() for _ in range(4)]
        ends[0] = ends[0][::-1]
        here, there = zip(*ends)
        with _one:
            asked = server(*modules)
        socket.send_fds(asked, [json.dumps([source, argv, env, str(cwd or '.')]).encode()], there)
        for end in there:
            os.close(end)
        self.stdin, self.stdout, self.stderr, self._told = (
            open(end, 'rb' if index else 'wb', 0) for index, end in enumerate(here))
        self.pid = int(self._told.readline())
        self.returncode = None

    def poll(self, timeout=0.0):
        """Return the status if it has ended within a time (s), else None."""
        if self.returncode is None and select([self._told], [], [], timeout)[0]:
            self.returncode = int(self._told.readline())
        return self.returncode

    def wait(self, timeout=None):
        """Wait until it has ended, at most for a time (s); return its status."""
        if self.poll(timeout) is None:
            raise subprocess.TimeoutExpired('a fork', timeout)
        return self.returncode
