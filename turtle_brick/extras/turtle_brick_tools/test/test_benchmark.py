# SPDX-License-Identifier: Apache-2.0

"""Test the benchmark's computations, report and termination."""

import os
import signal
import sys
from threading import Event
from time import monotonic
from types import SimpleNamespace

from geometry_msgs.msg import Twist, Vector3
from live_graph import wait_for_exits
import numpy as np
import psutil
import pytest
from turtle_brick.physics import STEP_NS
from turtle_brick.ros.tf import BASE_LINK, BRICK
from turtle_brick_tools import benchmark
from turtle_brick_tools.benchmark import NODES
from turtle_graph.client.geometry import Pose
from turtle_graph.client.processes import Process
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Frame, Received, Record, Sample
from turtlesim.msg import Pose as TurtlePoseMessage

RELEASE = 1_700_000_000_000_000_000
LEAD, END = RELEASE - 100_000_000, RELEASE + 1_000_000_000
DECIDED, COMMANDED, MOVED = 9_000_000, 15_000_000, 81_000_000
"""Times (ns) from the brick's release to the decision, first command and first robot motion."""


def recorded(gravity=9.81, decided=DECIDED, transformed=MOVED):
    """Return the record of a drop with events at given times (ns) after RELEASE."""
    record = Record(Profile())
    record.frames = {BRICK: Frame(False), BASE_LINK: Frame(False)}
    for step in range(-5, 40):
        stamp = RELEASE + step * STEP_NS
        height = 8.0 - gravity / 2.0 * (max(step, 0) * STEP_NS * 1e-9) ** 2
        record.frames[BRICK].add(
            stamp + 300_000, step, Sample(stamp, 'world', Pose((1.0, 2.0, height))))
    for time, x in drive(10_000_000, transformed):
        record.frames[BASE_LINK].add(time, 0, Sample(time, 'odom', Pose((x, 5.5, 0.0))))
    record.topics['pose'] = [Received(time, TurtlePoseMessage(x=x, y=5.5))
                             for time, x in drive(16_000_000, MOVED)]
    record.topics['goal_pose'] = [Received(RELEASE + decided, None)]
    record.topics['cmd_vel'] = [
        Received(RELEASE + time, Twist(linear=Vector3(y=speed)))
        for time, speed in ((-1, 1.0), (COMMANDED - 1, 0.0), (COMMANDED, 3.0), (MOVED, 3.0))]
    return record


def drive(period, moved):
    """Return times (ns) and x coordinates (m) of a robot that starts `moved` ns after RELEASE."""
    return [(RELEASE + time, 5.5 + max(time - moved, 0) * 3e-9)
            for time in range(-100_000_000, 200_000_000, period)]


@pytest.fixture(scope='module')
def plots():
    from turtle_brick_tools import plots  # Importing matplotlib takes half a second.
    return plots


def test_reaction_times_ignore_messages_before_the_release(plots):
    ends = benchmark.reaction_times(recorded(), LEAD, END)
    assert list(ends) == list(plots.LINKS)
    assert ends['seen'] == pytest.approx(0.0083)
    assert ends['decided'] == pytest.approx(DECIDED * 1e-9)
    assert ends['commanded'] == pytest.approx(COMMANDED * 1e-9)
    assert 0.0 < ends['moved'] - MOVED * 1e-9 <= 0.016
    assert 0.0 < ends['known'] - MOVED * 1e-9 <= 0.010
    for broken in ({'gravity': 0.0}, {'decided': -1}, {'transformed': END}):
        assert benchmark.reaction_times(recorded(**broken), LEAD, END) is None


def test_processor_usage_is_the_used_time_per_elapsed_time():
    def process(*used):
        times = iter([(1.0, 2.0, 7.0, 8.0), (1.0 + used[0], 2.0 + used[1], 9.0, 9.0)])
        return SimpleNamespace(cpu_times=lambda: next(times))

    begin = monotonic()
    cores = benchmark.processor_usage({'arena': process(0.1, 0.2), 'catcher': process(0.0, 0.1)},
                                      lambda: Event().wait(0.05))
    assert 0.1 / (monotonic() - begin) <= cores['catcher'] <= 0.1 / 0.05
    assert cores['arena'] == pytest.approx(3.0 * cores['catcher'])


def test_report_and_figure_show_the_results(plots, tmp_path):
    cores = {name: 0.1 * (index + 1) for index, name in enumerate(NODES)}
    times = dict.fromkeys(('cmd_vel', 'world -> brick'), np.array([0.009, 0.010, 0.011]))
    links = dict(zip(plots.LINKS, (0.0081, 0.0091, 0.0141, 0.0831, 0.0871)))
    found = {'idle': cores, 'catching': cores, 'intervals': times, 'latency': [links, links],
             'outcomes': {'caught': 12, 'missed': 1}}
    text = benchmark.report(found)
    rows = {line.strip().partition('  ')[0]: line.split() for line in text.splitlines()}
    assert rows['turtle_brick nodes'][-2:] == ['60.0', '60.0']
    assert rows['all nodes'][-2:] == ['150.0', '150.0']
    assert rows['cmd_vel'][1:] == ['10.0', '10.000', '9.020', '10.000', '10.980', '11.00']
    assert rows['world -> brick'][3] == '4.0'
    assert rows['first motion (pose of turtlesim)'][-3:] == ['83.1'] * 3
    assert '12 caught, 1 missed' in text
    plots.latency(found['latency'], tmp_path / 'latency.png')
    assert (tmp_path / 'latency.png').read_bytes().startswith(b'\x89PNG')


def test_a_signal_ends_the_benchmark_and_its_processes(tmp_path):
    with Process([sys.executable, '-m', 'turtle_brick_tools.benchmark',
                  '--output', str(tmp_path / 'out')]) as process:
        deadline = monotonic() + 300.0
        while len(started := psutil.Process(process.pid).children(recursive=True)) < 3:
            assert monotonic() < deadline
            Event().wait(0.05)
        ends = [os.pidfd_open(program.pid) for program in started]
        assert process.stop(signal.SIGTERM, 300.0) == 0
    assert process.output == 'benchmark: interrupted; no file was written\n'
    wait_for_exits(ends, 300.0)
    assert not list((tmp_path / 'out').iterdir())
