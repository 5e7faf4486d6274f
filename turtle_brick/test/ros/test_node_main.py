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

"""How the process of a node begins, spins and ends."""

from importlib.metadata import distribution
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
from time import monotonic

from ament_index_python.packages import get_package_prefix
from conftest import is_standin
import psutil
import pytest
from turtle_brick.core.parameters import default_path

# A process, as `ros2 run` starts it. The node says when it is up, and spins.
PROGRAM = """
import os, signal, sys
{before}
from rcl_interfaces.msg import Log
from rclpy.node import Node
from turtle_brick.ros.node_main import init, spin

class Probe(Node):
    def __init__(self):
        super().__init__('probe')
        {construct}
        self.publisher = self.create_publisher(Log, 'log', 10)
        self.timer = self.create_timer(0.01, self.tick)
        self.ticks = 0

    def tick(self):
        self.ticks += 1
        if self.ticks == 1:
            print('up', type(self.executor).__name__, flush=True)
        {tick}

sys.argv[0] = '/opt/some/lib/probe'  # as `ros2 run` names it
with init():
    spin(Probe())
"""

WAIT_SET = "sys.modules['rclpy.experimental'] = None"
"""A line that makes rclpy one that has no EventsExecutor."""

TO_ITSELF = 'os.kill(os.getpid(), signal.{})'


@pytest.fixture
def start(domain_id):
    """Return a function that starts the program; whatever it started ends with the test."""
    started = []

    def start(*args, before='', construct='', tick=''):
        code = PROGRAM.format(before=before, construct=construct, tick=tick)
        started.append(subprocess.Popen([sys.executable, '-c', code, *args], text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE))
        return started[-1]

    yield start
    for program in started:
        program.kill()
        program.communicate()


def end_of(program):
    """Return a program's exit status and its lines on standard error, rcl's log left out."""
    _, errors = program.communicate(timeout=30)
    return program.returncode, [
        line for line in errors.splitlines() if not line.startswith('[ERROR]')]


@pytest.mark.parametrize('number, before, executor', [
    (signal.SIGINT, '', 'EventsExecutor'), (signal.SIGTERM, WAIT_SET, 'SingleThreadedExecutor')])
def test_an_idle_node_sleeps_and_signals_end_it_quietly(start, number, before, executor):
    """Also several at once; and what rclpy waits with is not over at once, again and again."""
    program = start(before=before, tick='self.timer.cancel()')
    assert program.stdout.readline() == f'up {executor}\n'
    process = psutil.Process(program.pid)
    begin, used = monotonic(), sum(process.cpu_times()[:2])
    with pytest.raises(subprocess.TimeoutExpired):
        program.wait(0.5)
    assert sum(process.cpu_times()[:2]) - used < 0.15 * (monotonic() - begin)
    for _ in range(3):
        program.send_signal(number)
    assert end_of(program) == (0, [])


@pytest.mark.parametrize('where, number, then', [
    ('construct', 'SIGINT', ''),
    ('tick', 'SIGTERM', '; [self.publisher.publish(Log()) for _ in range(1000)]')])
def test_a_signal_disturbs_neither_the_making_of_a_node_nor_a_callback(start, where, number, then):
    """What it publishes after the signal still goes out, and nobody complains."""
    assert end_of(start(**{where: TO_ITSELF.format(number) + then})) == (0, [])


FOR_EVER = """
import rclpy, threading
from turtle_brick.ros import node_main
node_main.END_TIME = 1
rclpy.try_shutdown = threading.Event().wait
"""


def test_a_middleware_that_never_ends_ends_all_the_same(start):
    program = start(before=FOR_EVER, tick=TO_ITSELF.format('SIGINT'))
    assert end_of(program) == (-signal.SIGALRM, [])


DECLARE = """from turtle_brick.core.parameters import ArenaParameters
        from turtle_brick.ros.node_parameters import declare_parameters
        declare_parameters(self, ArenaParameters)"""


@pytest.mark.parametrize('args, reason', [
    ([], f'missing parameters: .*add --ros-args --params-file {default_path()}'),
    (['-p', 'gravity_accel:=-3'], 'gravity_accel is -3, but must be a number from .*'),
    (['-p', 'brick_size:=[0.1, 1, 0.1]'], '.*Sequence should be of same type.*'),
    (['--no-such-argument'], 'ROS can not use its arguments: .*--no-such-argument.*'),
])
def test_arguments_that_cannot_be_end_it_with_a_sentence(start, args, reason):
    file = ['--params-file', str(default_path())] if args else []
    status, (sentence,) = end_of(start('--ros-args', *file, *args, construct=DECLARE))
    assert status == 1 and re.fullmatch(f'probe: {reason}', sentence)


EXECUTABLES = [
    *(Path(get_package_prefix('turtle_brick'), 'lib', 'turtle_brick', entry.name)
      for entry in distribution('turtle_brick').entry_points),
    *(Path(get_package_prefix(package), path) for package, path in (
        ('turtlesim', 'lib/turtlesim/turtlesim_node'), ('ros2cli', 'bin/ros2'))
      if is_standin(package))]


def run_interrupted(path, directory, *names):
    """Run an executable with modules that interrupt what imports them; return what it says."""
    for name in names:
        (directory / f'{name}.py').write_text(
            f"import os, signal; {TO_ITSELF.format('SIGINT')}; print('too late')")
    done = subprocess.run(
        [path], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        env={**os.environ, 'PYTHONPATH': f'{directory}:{os.environ["PYTHONPATH"]}'})
    return done.stdout, done.returncode


@pytest.mark.parametrize('path', EXECUTABLES, ids=lambda path: path.name)
def test_an_interrupt_ends_an_executable_while_it_imports_its_modules(path, tmp_path):
    status = 2 if path.name in ('referee', 'ros2') else 0
    assert run_interrupted(
        path, tmp_path, 'joblib', 'launch', 'matplotlib', 'rclpy', 'yaml') == ('', status)


def test_an_interrupt_ends_an_executable_while_python_looks_up_what_it_runs(tmp_path):
    subprocess.run([sys.executable, '-W', 'ignore', 'setup.py', '-q', 'egg_info', '-e', tmp_path,
                    'install_scripts', '-d', tmp_path], cwd=Path(__file__).parents[2], check=True)
    assert run_interrupted(tmp_path / 'arena', tmp_path, 'email') == ('', 0)


@pytest.mark.parametrize('path, before, last', [
    ('/opt/lib/turtle_brick/my_node', '', ['KeyboardInterrupt']),
    ('/opt/lib/turtle_brick/sweep', 'signal.signal(signal.SIGINT, signal.SIG_IGN)', [])])
def test_an_interrupt_is_otherwise_as_always(path, before, last):
    """It raises an exception; and a worker of a sweep ignores it."""
    program = (f'import os, signal, sys\n{before}\nsys.argv[0] = {path!r}\nimport turtle_brick\n'
               + TO_ITSELF.format('SIGINT'))
    done = subprocess.run([sys.executable, '-c', program], stderr=subprocess.PIPE, text=True)
    assert done.stderr.splitlines()[-1:] == last
