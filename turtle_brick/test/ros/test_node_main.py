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

from collections.abc import Iterator
from importlib.util import find_spec
import os
from pathlib import Path
import signal
import subprocess
import sys
from time import monotonic

import pytest
from turtle_brick.core.parameters import default_path

# A process, as `ros2 run` starts it. The node says when it is up, and spins.
PROGRAM = """
import os, signal, sys
import rclpy
from rclpy.node import Node
from turtle_brick.ros.node_parameters import declare_parameters
from turtle_brick.ros.node_main import make_executor
from turtle_brick.ros.node_main import init, spin
{before}

class Probe(Node):
    def __init__(self):
        super().__init__('probe')
        {construct}
        self.timer = self.create_timer(0.01, self.tick)
        self.ticks = 0

    def tick(self):
        self.ticks += 1
        if self.ticks == 1:
            print('up', flush=True)
        {tick}

sys.argv[0] = '/opt/some/lib/probe'  # as `ros2 run` names it
with init():
    executor = make_executor()
    executor.add_node(Probe())
    spin(executor)
"""


class Process:
    """The program above, with its own lines in it, in a process."""

    def __init__(self, domain_id: int, *args: str, before: str = '', construct: str = 'pass',
                 tick: str = 'pass') -> None:
        code = PROGRAM.format(before=before, construct=construct, tick=tick)
        self.process = subprocess.Popen(
            [sys.executable, '-c', code, *args], text=True,
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain_id)},
            stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def wait_until_up(self) -> None:
        """Wait for the first line."""
        assert self.process.stdout.readline() == 'up\n'

    def end(self) -> tuple[int, list[str]]:
        """Return the exit status and the lines on standard error, rcl's log left out."""
        _, errors = self.process.communicate(timeout=30)
        return self.process.returncode, [
            line for line in errors.splitlines() if not line.startswith('[ERROR]')]


@pytest.fixture
def start(domain_id) -> Iterator[object]:
    """Return a function that starts the program; whatever it started ends with the test."""
    started = []

    def start(*args: str, **lines: str) -> Process:
        started.append(Process(domain_id, *args, **lines))
        return started[-1]

    yield start
    for program in started:
        program.process.kill()
        program.process.communicate()


OLD_RCLPY = "sys.modules['rclpy.experimental'] = None"
"""A line that makes rclpy one that has no EventsExecutor."""


@pytest.mark.parametrize('before', ['', OLD_RCLPY], ids=['events', 'wait set'])
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('times', [1, 3])
def test_signals_end_it_quietly(start, number, times, before):
    program = start(before=before)
    program.wait_until_up()
    for _ in range(times):
        program.process.send_signal(number)
    assert program.end() == (0, [])


@pytest.mark.parametrize('number', ['SIGINT', 'SIGTERM'])
def test_signal_while_it_is_made_ends_it_quietly(start, number):
    construct = f'os.kill(os.getpid(), signal.{number}); self.create_timer(1.0, print)'
    assert start(construct=construct).end() == (0, [])


@pytest.mark.parametrize('before', ['', OLD_RCLPY], ids=['events', 'wait set'])
@pytest.mark.parametrize('number', ['SIGINT', 'SIGTERM'])
def test_a_callback_is_not_disturbed_by_a_signal(start, number, before):
    """What it publishes after the signal still goes out, and nobody complains."""
    construct = 'self.publisher = self.create_publisher(Log, "log", 10)'
    tick = (f'os.kill(os.getpid(), signal.{number})\n'
            '        for _ in range(1000): self.publisher.publish(Log())')
    program = start(before=f'from rcl_interfaces.msg import Log\n{before}',
                    construct=construct, tick=tick)
    assert program.end() == (0, [])


@pytest.mark.parametrize('number', ['SIGINT', 'SIGTERM'])
def test_signal_before_rclpy_is_up_ends_it_quietly(start, number):
    before = ('begin = rclpy.init\n'
              f'rclpy.init = lambda **k: (os.kill(os.getpid(), signal.{number}), begin(**k))')
    assert start(before=before).end() == (0, [])


@pytest.mark.parametrize('before', ['', OLD_RCLPY], ids=['events', 'wait set'])
def test_idle_node_ends_when_its_context_is_shut_down_without_a_word(start, before):
    tick = ('self.timer.cancel()\n'
            '        import threading\n'
            '        handle = rclpy.get_default_context().handle\n'
            '        threading.Timer(0.2, handle.shutdown).start()')
    assert start(tick=tick, before=before).end() == (0, [])


@pytest.mark.parametrize('before, kind', [
    pytest.param('', 'EventsExecutor', id='events', marks=pytest.mark.skipif(
        find_spec('rclpy.experimental') is None, reason='this rclpy is older than 7.1.4')),
    pytest.param(OLD_RCLPY, 'SingleThreadedExecutor', id='wait set')])
def test_the_executor_is_the_cheapest_that_rclpy_has(start, before, kind):
    tick = "assert type(self.executor).__name__ == '" + kind + "'; rclpy.shutdown()"
    assert start(tick=tick, before=before).end() == (0, [])


def test_an_idle_node_sleeps(start):
    """What rclpy waits with must not be over at once, again and again."""
    program = start(tick='self.timer.cancel()')
    program.wait_until_up()
    times = Path('/proc', str(program.process.pid), 'stat')

    def used():
        user, system = times.read_text().rpartition(')')[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf('SC_CLK_TCK')

    begin, before = monotonic(), used()
    with pytest.raises(subprocess.TimeoutExpired):
        program.process.wait(2.0)
    share = (used() - before) / (monotonic() - begin)
    program.process.send_signal(signal.SIGINT)
    assert program.end() == (0, [])
    assert share < 0.1


def test_shutdown_from_within_ends_it_quietly(start):
    assert start(tick='rclpy.shutdown()').end() == (0, [])


def test_a_defect_is_not_hidden(start):
    status, errors = start(tick='1 / 0').end()
    assert status == 1
    assert errors[-1] == 'ZeroDivisionError: division by zero'


def test_missing_parameters_end_it_with_a_sentence(start):
    status, errors = start(construct='declare_parameters(self)').end()
    assert status == 1
    (sentence,) = errors
    assert sentence.startswith('probe: missing parameters: ')
    assert sentence.endswith(f'add --ros-args --params-file {default_path()}')


def test_the_file_that_the_sentence_names_is_enough(start):
    program = start('--ros-args', '--params-file', str(default_path()),
                    construct='declare_parameters(self)')
    program.wait_until_up()
    program.process.send_signal(signal.SIGTERM)
    assert program.end() == (0, [])


@pytest.mark.parametrize('args, reason', [
    (['-p', 'max_velocity:=-3'], 'probe: max_velocity is -3, but must be a number from'),
    (['-p', 'platform_height:=0.5'], 'probe: platform_height 0.5 m is too low for a platform'),
    (['-p', 'brick_size:=[0.1, 1, 0.1]'], 'Sequence should be of same type'),
    (['--params-file', '/absent.yaml'], '/absent.yaml'),
    (['-p', 'use_sim_time:=abc'], "'use_sim_time' to 'abc' of type 'STRING'"),
    (['--no-such-argument'], "probe: unknown ROS arguments ['--no-such-argument']"),
])
def test_arguments_that_cannot_be_end_it_with_a_sentence(start, args, reason):
    status, errors = start('--ros-args', '--params-file', str(default_path()), *args,
                           construct='declare_parameters(self)').end()
    assert status == 1
    (sentence,) = errors
    assert sentence.startswith('probe: ')
    assert reason in sentence


@pytest.mark.parametrize('variable', ['HOME', 'ROS_HOME', 'ROS_LOG_DIR'])
@pytest.mark.parametrize('folder', [os.devnull, ''])
def test_where_no_log_can_be_written_it_runs_all_the_same(start, monkeypatch, tmp_path, variable,
                                                          folder):
    for name in ('HOME', 'ROS_HOME', 'ROS_LOG_DIR'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(variable, folder)
    monkeypatch.setenv('TMPDIR', str(tmp_path))
    program = start()
    program.wait_until_up()
    program.process.send_signal(signal.SIGINT)
    assert program.end() == (0, [])
    assert [path.name[:8] for path in tmp_path.iterdir()] == ['ros_log_']


def test_file_that_is_no_parameter_file_ends_it_with_a_sentence(start, tmp_path):
    path = tmp_path / 'wrong.yaml'
    path.write_text('a: [b', encoding='utf-8')
    status, errors = start('--ros-args', '--params-file', str(path),
                           construct='declare_parameters(self)').end()
    assert status == 1
    (sentence,) = errors
    assert sentence.startswith('probe: ')
    assert str(path) in sentence
    assert path.read_text('utf-8') == 'a: [b'
