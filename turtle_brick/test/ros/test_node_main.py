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

"""Test the startup, the parameters and the shutdown of a node."""

from dataclasses import asdict, replace
import os
from pathlib import Path
import signal
import subprocess
import sys
from time import monotonic

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from turtle_brick.core.parameters import (default_path, load, MissingParameterError,
                                          PARAMETER_RULES)
from turtle_brick.ros.node_main import declare_parameters, make_executor, run_node

PROGRAM = """
import os, signal, threading
from rcl_interfaces.msg import Log
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from turtle_brick.ros.node_main import run_node

class Probe(Node):
    def __init__(self):
        super().__init__('probe')
        {construct}
        self.publisher = self.create_publisher(Log, 'log', 10)
        self.timer = self.create_timer(0.01, self.tick)

    def tick(self):
        print('up', type(self.executor).__name__, flush=True)
        {tick}

run_node(Probe, None, {executor})
"""
"""Template of a program whose node prints a line in each timer callback."""

SEND_SIGNAL = 'os.kill(os.getpid(), signal.{})'


@pytest.fixture
def start(domain_id):
    """Provide a function that starts PROGRAM, and kill all started processes after the test."""
    started = []

    def start(construct='', tick='', executor=None):
        code = PROGRAM.format(construct=construct, tick=tick, executor=executor)
        started.append(subprocess.Popen([sys.executable, '-c', code], text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE))
        return started[-1]

    yield start
    for program in started:
        program.kill()
        program.communicate()


def end_of(program):
    """Return a program's exit status and its stderr lines without errors logged by rcl."""
    _, errors = program.communicate(timeout=600)
    return program.returncode, [
        line for line in errors.splitlines() if not line.startswith('[ERROR]')]


def processor_time(program):
    """Return the processor time (s) that a running program has used (see proc_pid_stat(5))."""
    fields = Path(f'/proc/{program.pid}/stat').read_text().rpartition(')')[2].split()
    user_time, system_time = map(int, fields[11:13])
    return (user_time + system_time) / os.sysconf('SC_CLK_TCK')


def processor_usage(program):
    """Return the number of CPU cores that a running program uses, averaged over 0.5 s."""
    begin, used = monotonic(), processor_time(program)
    with pytest.raises(subprocess.TimeoutExpired):
        program.wait(0.5)
    return (processor_time(program) - used) / (monotonic() - begin)


@pytest.mark.parametrize('number, executor, name', [
    (signal.SIGINT, None, 'EventsExecutor'),
    (signal.SIGTERM, 'SingleThreadedExecutor', 'SingleThreadedExecutor')])
def test_idle_node_sleeps_and_ends_quietly_after_signals(start, number, executor, name):
    """The first measurements of the processor usage may include the start of the node."""
    program = start(tick='self.timer.cancel()', executor=executor)
    assert program.stdout.readline() == f'up {name}\n'
    assert any(processor_usage(program) < 0.15 for _ in range(10))
    for _ in range(3):
        program.send_signal(number)
    assert end_of(program) == (0, [])


def test_older_rclpy_has_no_events_executor(live, monkeypatch):
    monkeypatch.setitem(sys.modules, 'rclpy.experimental', None)
    assert type(make_executor(live.context)) is SingleThreadedExecutor


@pytest.mark.parametrize('where, number, then', [
    ('construct', 'SIGINT', ''),
    ('tick', 'SIGTERM', '; [self.publisher.publish(Log()) for _ in range(1000)]')])
def test_signal_does_not_interrupt_constructors_and_callbacks(start, where, number, then):
    """A callback can still publish messages after the process has received a signal."""
    assert end_of(start(**{where: SEND_SIGNAL.format(number) + then})) == (0, [])


def test_sigterm_ends_a_process_if_the_middleware_blocks_its_shutdown(start):
    program = start(tick=SEND_SIGNAL.format('SIGINT'), construct=(
        'rclpy.try_shutdown = lambda: (print("blocked", flush=True), threading.Event().wait())'))
    assert 'blocked\n' in iter(program.stdout.readline, '')
    program.terminate()
    assert end_of(program) == (-signal.SIGTERM, [])


@pytest.fixture
def restored_signals():
    """Restore the signal handlers of this process after a test that calls `run_node`."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('args, reason', [
    ([], f'missing parameters: .*Add --ros-args --params-file {default_path()}, or .*'),
    (['-p', 'gravity_accel:=-3'], 'gravity_accel is -3, but must be a number from .*'),
    (['-p', 'brick_size:=[0.1, 1, 0.1]'], '.*Sequence should be of same type.*'),
    (['--no-such-argument'], 'invalid ROS arguments: .*--no-such-argument.*'),
])
def test_invalid_arguments_end_the_program_with_one_sentence(
        domain_id, restored_signals, args, reason):
    """The error message begins with the program name, not with its path."""
    file = ['--params-file', str(default_path())] if args else []
    with pytest.raises(SystemExit, match=f'^probe: {reason}$') as ended:
        run_node(lambda: declare_parameters(Node('probe')),
                 ['/opt/some/lib/probe', '--ros-args', *file, *args])
    assert '\n' not in ended.value.code


def probe(live, values):
    return live.add(Node, parameters=False, node_name='probe', parameter_overrides=[
        Parameter(name, value=value) for name, value in values.items()])


def test_missing_parameters_are_reported_with_the_file_and_the_node(live):
    node = probe(live, {'max_velocity': 3.0})
    with pytest.raises(MissingParameterError, match=(
            '^missing parameters: brick_size, .*. Add --ros-args --params-file .*, or if .* given'
            ', check the spelling .* a section for the node /.*probe or for /')):
        declare_parameters(node)


def test_parameters_have_values_descriptions_and_are_read_only(live):
    defaults = {name: list(value) if isinstance(value, tuple) else value
                for name, value in asdict(load()).items()}
    node = probe(live, {**defaults, 'max_velocity': 3, 'brick_start': [7, 6, 5]})
    assert declare_parameters(node) == replace(
        load(), max_velocity=3.0, brick_start=(7.0, 6.0, 5.0))
    for name, rule in PARAMETER_RULES.items():
        descriptor, held = node.describe_parameter(name), node.get_parameter(name)
        assert descriptor.description == rule.description
        assert descriptor.additional_constraints == f'{name} must be {rule.allowed_values()}'
        (result,) = node.set_parameters([held])
        assert not result.successful and 'read-only' in result.reason
