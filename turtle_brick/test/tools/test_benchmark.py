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

"""Test the benchmark's computations, report and termination."""

from functools import partial
import signal
import sys
from threading import Event
from time import monotonic, process_time
from types import SimpleNamespace

from graph_client.processes import Process
import numpy as np
import psutil
import pytest
from turtle_brick.physics import STEP_NS
from turtle_brick.ros.tf import BASE_LINK, BRICK
from turtle_brick.tools import benchmark, plots
from turtle_brick.tools.benchmark import NODES

RELEASE = 1_700_000_000_000_000_000
LEAD, END = RELEASE - 100_000_000, RELEASE + 1_000_000_000
DECIDED, COMMANDED, MOVED = 9_000_000, 15_000_000, 81_000_000
"""Times (ns) from the release to the decision, the command and the first motion."""


class Recorded:
    """Stand-in for a record of messages before and after a release."""

    def __init__(self, **tracks):
        """Create typical tracks. Keyword arguments replace tracks with the same name."""
        self.tracks = {
            BRICK: fall(), BASE_LINK: drive(10_000_000), 'pose': drive(16_000_000),
            'goal_pose': [(RELEASE + DECIDED, None), (RELEASE + 2 * DECIDED, None)],
            'cmd_vel': [(RELEASE - 1, speed(1.0)), (RELEASE + COMMANDED - 1_000_000, speed(0.0)),
                        (RELEASE + COMMANDED, speed(3.0)), (RELEASE + MOVED, speed(3.0))],
            **tracks}
        self.frames = {name: SimpleNamespace(published_between=partial(self.during, name))
                       for name in (BRICK, BASE_LINK)}

    def during(self, name, begin, end):
        return [one for one in self.tracks[name] if begin <= one[0] <= end]

    def messages(self, topic, begin, end):
        return [SimpleNamespace(published=then, message=message)
                for then, message in self.during(topic, begin, end)]


def fall(gravity=9.81):
    """Return the publication times (ns) and positions (m) of a falling brick."""
    heights = {step: 8.0 - gravity / 2.0 * (max(step, 0) * STEP_NS * 1e-9) ** 2
               for step in range(-5, 40)}
    return [(RELEASE + step * STEP_NS + 300_000, SimpleNamespace(
        stamp=RELEASE + step * STEP_NS, pose=SimpleNamespace(position=(1.0, 2.0, height))))
        for step, height in heights.items()]


def drive(period, moved=MOVED):
    """Return publication times (ns) and poses of a robot that starts to move at `moved` (ns)."""
    places = {time: 5.5 + max(time - moved, 0) * 3e-9
              for time in range(-100_000_000, 200_000_000, period)}
    return [(RELEASE + time, SimpleNamespace(
        x=x, y=5.5, pose=SimpleNamespace(position=(x, 5.5, 0.0)))) for time, x in places.items()]


def speed(meters_per_second):
    return SimpleNamespace(linear=SimpleNamespace(x=0.0, y=meters_per_second))


def test_reaction_times_ignore_messages_before_the_release():
    ends = benchmark.reaction_times(Recorded(), LEAD, END)
    assert list(ends) == list(plots.LINKS)
    assert ends['seen'] == pytest.approx(0.0083)
    assert ends['decided'] == pytest.approx(DECIDED * 1e-9)
    assert ends['commanded'] == pytest.approx(COMMANDED * 1e-9)
    assert 0.0 < ends['moved'] - MOVED * 1e-9 <= 0.016
    assert 0.0 < ends['known'] - MOVED * 1e-9 <= 0.010
    for track in ({BRICK: fall(gravity=0.0)}, {'goal_pose': [(RELEASE - 1, None)]},
                  {BASE_LINK: drive(10_000_000, moved=END)}):
        assert benchmark.reaction_times(Recorded(**track), LEAD, END) is None


def test_processor_usage_of_a_busy_and_an_idle_process():
    begin, before = monotonic(), process_time()

    def work() -> None:
        while monotonic() < begin + 0.5:
            pass

    with psutil.Popen(['sleep', '60']) as idle:
        cores = benchmark.processor_usage({'busy': psutil.Process(), 'idle': idle}, work)
        booked = (process_time() - before) / (monotonic() - begin)
        idle.kill()
    assert cores == {'busy': pytest.approx(booked, abs=0.1), 'idle': pytest.approx(0.0, abs=0.03)}
    assert cores['busy'] > 0.05


def test_report_and_figure_show_the_results(tmp_path):
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
    """A benchmark that receives SIGTERM exits with status 0 and does not write a file."""
    with Process([sys.executable, '-m', 'turtle_brick.tools.benchmark',
                  '--output', str(tmp_path / 'out')]) as process:
        deadline = monotonic() + 300.0
        while len(started := psutil.Process(process.pid).children(recursive=True)) < 4:
            assert monotonic() < deadline
            Event().wait(0.05)
        assert process.stop(signal.SIGTERM, 300.0) == 0
    assert process.output == 'benchmark: interrupted; no file was written\n'
    # Orphaned processes exist until init reaps them.
    assert not psutil.wait_procs(started, timeout=60.0)[1]
    assert not list((tmp_path / 'out').iterdir())
