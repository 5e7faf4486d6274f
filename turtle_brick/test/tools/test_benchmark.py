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

"""The benchmark: what it computes and tells, and how it ends; it is not run here."""

import os
import signal
import subprocess
import sys
from threading import Event
from time import monotonic, process_time

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import psutil
import pytest
from turtle_brick.tools import benchmark, plots
from turtle_brick.tools.benchmark import drift, Events, NODES, OURS

STEP = 4_000_000
SECOND = 1_000_000_000

few = settings(max_examples=25, derandomize=True)


# ------------------------------------------------------------------------------ what it computes

@few
@given(st.randoms(use_true_random=False), st.integers(500, 1500))
def test_late_publication_is_no_drift(random, count):
    """However late the steps come, as long as some of each second come in time."""
    delays = [0 if index % 100 == 0 else random.randrange(30_000_000) for index in range(count)]
    stamps = [7 + index * STEP for index in range(count)]
    missing, latest = drift(stamps, [stamp + late for stamp, late in zip(stamps, delays)], STEP)
    assert missing == 0
    assert latest == pytest.approx(max(delays) * 1e-9)


@few
@given(st.integers(1, 20), st.integers(300, 700))
def test_lost_steps_are_counted(missing, place):
    """A gap between the stamps is as many steps as are missing; a repetition counts, too."""
    stamps = [index * STEP for index in range(1000)]
    gap = stamps[:place] + stamps[place + missing:]
    assert drift(gap, gap, STEP) == (missing, 0.0)
    twice = stamps[:place] + stamps[place - 1:]
    assert drift(twice, twice, STEP) == (1, 0.0)


@pytest.mark.parametrize('rate, behind', [(232, 18), (250, 0), (240, 10)])
def test_a_simulation_that_loses_periods_falls_behind(rate, behind):
    """Stamps that count callbacks instead of time fall behind by what the timer lost."""
    published = [index * SECOND // rate for index in range(60 * rate + 1)]
    stamps = [index * STEP for index in range(60 * rate + 1)]
    # From the first to the last second there are 59.
    assert drift(stamps, published, STEP)[0] == pytest.approx(59 * behind, abs=2)


def fall(release, drop=True):
    """Return what is heard of a brick that is let go at an instant (ns)."""
    heard = []
    for index in range(-5, 40):
        time = max(index, 0) * STEP * 1e-9
        stamp = release + index * STEP
        heard.append((stamp + 300_000, stamp, 8.0 - 4.905 * time * time if drop else 8.0))
    return heard


def drive(release, latency, period):
    """Return places of a robot that begins to move some time (ns) after the release."""
    return [(instant, 5.5 + max(instant - release - latency, 0) * 3e-9, 5.5)
            for instant in range(release - SECOND // 10, release + SECOND // 5, period)]


@few
@given(st.integers(10**18, 2 * 10**18), st.integers(9_000_000, 30_000_000),
       st.integers(0, 10_000_000), st.integers(50_000_000, 90_000_000))
def test_the_chain_is_found(release, decided, waited, queued):
    """Each link at its time, whatever was heard before the release."""
    commanded = release + decided + waited
    moved = decided + waited + queued
    ends = benchmark.chain(Events(
        brick=fall(release), goals=[release - SECOND, release + decided, release + SECOND],
        commands=[(release - 20_000_000, 1.0), (commanded - 1, 0.0), (commanded, 3.0),
                  (commanded + 10_000_000, 3.0)],
        poses=drive(release, moved, 16_000_000), transforms=drive(release, moved, 10_000_000)))
    assert list(ends) == list(plots.LINKS)
    assert ends['seen'] == pytest.approx(0.0083)
    assert ends['decided'] == pytest.approx(decided * 1e-9)
    assert ends['commanded'] == pytest.approx((decided + waited) * 1e-9)
    assert 0.0 <= ends['moved'] - moved * 1e-9 <= 0.016001
    assert 0.0 <= ends['known'] - moved * 1e-9 <= 0.010001


def test_no_chain_is_made_up():
    """Of what was not heard."""
    release = 10**18
    whole = Events(fall(release), [release + 9_000_000], [(release + 15_000_000, 3.0)],
                   drive(release, 80_000_000, 16_000_000), drive(release, 80_000_000, 10_000_000))
    assert benchmark.chain(whole) is not None
    rest = drive(release, SECOND, 16_000_000)
    for part in ({'brick': fall(release, drop=False)}, {'brick': []}, {'brick': fall(release)[:6]},
                 {'goals': [release - 1]}, {'commands': [(release + 1, 0.0)]}, {'poses': rest},
                 {'transforms': rest}, {'poses': []}):
        assert benchmark.chain(whole._replace(**part)) is None


# ------------------------------------------------------------------------------ what it measures

def test_what_processes_use_is_told_apart_from_others():
    """Of a process that works for a while, as the system books it, and of nobody else."""
    with subprocess.Popen([sys.executable, '-c', 'while True: pass']) as busy:
        usage = benchmark.Usage({'busy': psutil.Process(busy.pid)})
        begin, own = monotonic(), process_time()
        Event().wait(1.0)
        before = sum(psutil.Process(busy.pid).cpu_times()[:2])
        cores = usage.cores()
        seconds = monotonic() - begin
        busy.kill()
    assert cores['busy'] == pytest.approx(before / seconds, abs=0.1)
    assert cores['benchmark'] == pytest.approx((process_time() - own) / seconds, abs=0.1)
    assert 0.0 <= cores['others'] <= psutil.cpu_count() - cores['busy'] + 0.2


def test_the_programs_of_the_graph_are_found_by_their_names():
    me = psutil.Process()
    scripts = [subprocess.Popen(['sleep', '60'])]
    try:
        with pytest.raises(RuntimeError, match='launch has not started arena, catcher, robot_'):
            benchmark.programs(me)
    finally:
        scripts[0].kill()
        scripts[0].wait()


# -------------------------------------------------------------------------------- how it reports

def test_the_table_holds_what_was_found():
    """Sums and percentiles included."""
    cores = {name: 0.1 * (index + 1) for index, name in enumerate(NODES)}
    quiet = {topic: np.array([0.009, 0.010, 0.011]) for topic in (
        'cmd_vel', 'odom', 'joint_states', 'odom -> base_link', 'world -> brick')}
    links = {'seen': 0.0081, 'decided': 0.0091, 'commanded': 0.0141, 'moved': 0.0831,
             'known': 0.0871}
    found = {
        'idle': {**cores, 'others': 0.01, 'host': 0.034},
        'catching': {**cores, 'others': 0.02, 'host': 0.0},
        'memory': dict.fromkeys(NODES, 50 * 2**20),
        'intervals': {**quiet, 'steps': 15000, 'drift': (0, 0.001)},
        'intervals beside loops': {**quiet, 'steps': 14998, 'drift': (3, 0.02)},
        'latency': [links, links], 'outcomes': {'caught': 12, 'missed': 1}}
    text = benchmark.report(found, 60.0)
    rows = {line.strip().partition('  ')[0]: line.split() for line in text.splitlines()}
    assert OURS == ('turtle_robot', 'arena', 'catcher')
    assert rows['turtle_robot'][-4:] == ['10.0', '10.0', '50', 'MB']
    assert rows['the three of ours'][-4:] == ['60.0', '60.0', '150', 'MB']
    assert rows['all five'][-4:] == ['150.0', '150.0', '250', 'MB']
    assert rows['cmd_vel'][1:] == ['10.0', '10.000', '9.020', '10.000', '10.980', '11.00',
                                   '10.980', '11.00']
    assert rows['world -> brick'][3] == '4.0'
    assert 'drift of the physics: 0 steps of 15,000 (published at most 1.0 ms late)' in text
    assert 'beside two busy loops 3 of 14,998 (20.0 ms)' in text
    assert rows['decision (goal published)'][-3:] == ['9.1'] * 3
    assert rows['first motion (pose of turtlesim)'][-3:] == ['83.1'] * 3
    assert '12 caught, 1 missed' in text
    assert 'kept 0.034 cores for itself' in text and 'TOO MUCH' not in text
    found['catching']['others'] = 0.2
    assert 'used 0.20 cores at most: TOO MUCH' in benchmark.report(found, 60.0)


def test_the_figure_is_made(tmp_path):
    """From one drop and from many."""
    links = dict(zip(plots.LINKS, (0.0081, 0.0091, 0.0141, 0.0831, 0.0871)))
    for count in (1, 30):
        plots.latency([links] * count, tmp_path / 'latency.png')
        assert (tmp_path / 'latency.png').read_bytes().startswith(b'\x89PNG')


# ----------------------------------------------------------------------------------- how it ends

@pytest.mark.parametrize('args, words', [
    (['--seconds', '0'], '--seconds 0: at least 1'),
    (['--seconds', 'nan'], '--seconds nan: at least 1'),
    (['--drops', '0'], '--drops 0: at least 1'),
    (['--output', __file__], 'this is not a directory'),
])
def test_what_is_wrong_with_the_options_is_said(args, words, capsys):
    """One sentence names the value, and the status is 2."""
    with pytest.raises(SystemExit, match='2'):
        benchmark.main(args)
    assert words in capsys.readouterr().err


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_all_that_it_has_started(number, tmp_path):
    """Quietly, with status 0, and nothing is written."""
    process = psutil.Popen(
        [sys.executable, '-m', 'turtle_brick.tools.benchmark', '--output', str(tmp_path / 'out')],
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))},
        stderr=subprocess.PIPE, text=True)
    deadline = monotonic() + 60.0
    while len(started := process.children(recursive=True)) < 4:
        assert monotonic() < deadline and process.poll() is None
        Event().wait(0.05)
    process.send_signal(number)
    _, said = process.communicate(timeout=60.0)
    assert (process.returncode, said) == (0, 'benchmark: stopped, and nothing written\n')
    assert not [child for child in started if child.is_running()]
    assert not (tmp_path / 'out').exists()
