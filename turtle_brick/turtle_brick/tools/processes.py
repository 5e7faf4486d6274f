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

"""The nodes of a graph as processes of their own."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import Any

from turtle_brick.core.parameters import default_path
from turtle_brick.tools.benchmark_nodes import REMAP
from turtle_brick.tools.graph import Child, executable, Graph, write_parameters
from turtle_brick.tools.interrupts import INTERRUPTS

OURS = ('turtle_robot', 'arena', 'catcher')
FOREIGN = {'turtlesim': 'turtlesim_standin', 'robot_state_publisher': 'robot_state_publisher'}
"""The other nodes of the graph, and the Python package whose presence tells a stand-in."""

END_TIME = 10.0
"""How long (s) a process may take to end when it is asked to."""


class Process(Child):
    """A program of its own, and what it uses."""

    def __init__(self, name: str, command: Sequence[str], log: Path) -> None:
        """
        Start it.

        :param name: what to call it
        :param command: its command line
        :param log: the file for all that it says
        """
        self.name = name
        self._log = log
        with open(log, 'wb') as file:
            super().__init__(command, stdout=file, stderr=subprocess.STDOUT)

    @property
    def pid(self) -> int:
        """Return the process's id."""
        return self._process.pid

    def check(self) -> None:
        """
        See that it still runs.

        :raises RuntimeError: it does not; the text holds the last of what it said
        """
        if self._process.poll() is not None:
            said = self._log.read_text(errors='replace').strip().splitlines() or ['nothing']
            raise RuntimeError(f'{self.name} has ended with status {self._process.returncode}, '
                               f'and said last: {said[-1]}')


class Processes:
    """The programs of a graph; on leaving it, they are ended."""

    def __init__(self) -> None:
        """Begin with none."""
        self._files = TemporaryDirectory()
        self.all: list[Process] = []

    def __enter__(self) -> 'Processes':
        """Return the processes themselves."""
        return self

    def __exit__(self, *_: object) -> None:
        """End them all."""
        with INTERRUPTS.held():
            for process in self.all:
                process.ask_to_end()
            for process in self.all:
                process.see_end(END_TIME)
            self._files.cleanup()

    def start(self, name: str, *command: str) -> None:
        """Start one."""
        with INTERRUPTS.held():
            self.all.append(Process(name, command, Path(self._files.name, f'{name}.log')))

    def parameter_file(self, name: str, parameters: dict[str, Any]) -> str:
        """Write parameters for any node; return the file's path."""
        return str(write_parameters(Path(self._files.name, f'{name}.yaml'), parameters))

    def check(self) -> None:
        """See that all still run; RuntimeError if not."""
        for process in self.all:
            process.check()


def composable() -> list[str]:
    """Return the nodes that can be composed here: ours, and the stand-ins."""
    return [*OURS, *(name for name, module in FOREIGN.items() if find_spec(module) is not None)]


def start_graph(processes: Processes, watch: Graph, kind: str, composed: bool) -> None:
    """
    Start a graph.

    :param processes: what to add its processes to
    :param watch: knows the robot's description
    :param kind: 'real' or 'bare'
    :param composed: whether as many nodes as possible share a process
    """
    together = composable() if composed else []
    host = [sys.executable, '-m', 'turtle_brick.tools.benchmark_nodes', kind]
    if together:
        processes.start('composed', *host, *together)
    for name in (*FOREIGN, *OURS):
        if name in together:
            continue
        if kind == 'bare':
            processes.start(name, *host, name, '--ros-args', *REMAP.get(name, ()))
            continue
        package = name if name in FOREIGN else 'turtle_brick'
        program = 'turtlesim_node' if name == 'turtlesim' else name
        params_file = str(default_path())
        if name == 'turtlesim':
            params_file = processes.parameter_file(name, {'holonomic': True})
        elif name == 'robot_state_publisher':
            params_file = processes.parameter_file(name, watch.robot_parameters())
        processes.start(name, executable(package, program),
                        '--ros-args', '--params-file', params_file, *REMAP.get(name, ()))
