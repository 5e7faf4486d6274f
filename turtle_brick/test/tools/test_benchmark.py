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

"""The benchmark: what it computes, what it compares with, and how it ends; it is not run here."""

from importlib.util import find_spec
import json
from math import hypot
import os
from pathlib import Path
import signal
import subprocess
import sys
from threading import Event
from time import monotonic, process_time

from hypothesis import given
from hypothesis import strategies as st
import numpy
import pytest
from turtle_brick.tools import benchmark, benchmark_nodes, measuring, processes, report
from turtle_brick.tools.graph import Graph
from turtle_brick.tools.measuring import BrickSample, Events, Place

DEADLINE = 60.0
STEP = 4_000_000
ENVIRONMENT = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
SECOND = 1_000_000_000

finite = st.floats(-1e6, 1e6)
needs_matplotlib = pytest.mark.skipif(
    find_spec('matplotlib') is None, reason='matplotlib is not installed')


# ------------------------------------------------------------------------------ what it computes

@given(st.lists(finite, min_size=1, max_size=50), st.floats(0.0, 1.0))
def test_percentiles_are_those_of_numpy(values, part):
    """Linearly interpolated."""
    assert measuring.percentile(sorted(values), part) == pytest.approx(
        numpy.percentile(values, 100.0 * part), rel=1e-9, abs=1e-9)


@given(st.lists(finite, min_size=1, max_size=50), st.randoms())
def test_a_spread_is_in_order_and_knows_no_order(values, random):
    """Its numbers ascend, and shuffling changes nothing."""
    found = measuring.spread(values)
    ends = [min(values), found.p01, found.p50, found.p99, found.maximum]
    assert all(low <= high + 1e-9 for low, high in zip(ends, ends[1:]))
    assert (found.count, found.maximum) == (len(values), max(values))
    random.shuffle(values)
    assert measuring.spread(values) == found


@pytest.mark.parametrize('instants', ([], [17]))
def test_a_spread_of_nothing_is_refused(instants):
    """And intervals of a single instant are nothing."""
    with pytest.raises(ValueError, match='nothing was heard'):
        measuring.spread(measuring.intervals(instants))


@given(st.randoms(use_true_random=False), st.integers(500, 1500))
def test_late_publication_is_no_drift(random, count):
    """However late the steps come, as long as some of each second come in time."""
    delays = [0 if index % 100 == 0 else random.randrange(30_000_000) for index in range(count)]
    stamps = [7 + index * STEP for index in range(len(delays))]
    published = [stamp + delay for stamp, delay in zip(stamps, delays)]
    found = measuring.drift(stamps, published, STEP)
    assert (found.lost, found.behind, found.total) == (0, 0, 0)
    assert found.steps == len(delays)
    assert found.latest == pytest.approx(max(delays) * 1e-9)


@given(st.integers(1, 20), st.integers(300, 700))
def test_lost_steps_are_counted(missing, place):
    """A gap between the stamps is as many steps as are missing; a repetition is a negative one."""
    stamps = [index * STEP for index in range(1000)]
    gap = stamps[:place] + stamps[place + missing:]
    assert measuring.drift(gap, gap, STEP).lost == missing
    twice = stamps[:place] + stamps[place - 1:]
    assert measuring.drift(twice, twice, STEP).lost == -1
    assert measuring.drift(twice, twice, STEP).total == 1


@pytest.mark.parametrize('rate, behind', [(232, 18), (250, 0), (240, 10)])
def test_a_simulation_that_loses_periods_falls_behind(rate, behind):
    """Stamps that count callbacks instead of time fall behind by what the timer lost."""
    published = [index * SECOND // rate for index in range(60 * rate + 1)]
    stamps = [index * STEP for index in range(60 * rate + 1)]
    found = measuring.drift(stamps, published, STEP)
    # From the first to the last second there are 59.
    assert found.behind == pytest.approx(59 * behind, abs=2)
    assert found.lost == 0


def fall(release, drop=True):
    """Return samples of a brick that is let go at an instant."""
    samples = []
    for index in range(-5, 40):
        stamp = release + index * STEP
        time = max(index, 0) * STEP * 1e-9
        z = 8.0 - 4.905 * time * time if drop else 8.0
        samples.append(BrickSample(stamp, stamp + 300_000, z))
    return samples


def drive(release, latency, period):
    """Return places of a robot that begins to move some time after the release."""
    return [Place(instant, 5.5 + max(instant - release - latency, 0) * 3e-9, 5.5)
            for instant in range(release - SECOND // 10, release + SECOND // 5, period)]


@given(st.integers(10**18, 2 * 10**18), st.integers(9_000_000, 30_000_000),
       st.integers(0, 10_000_000), st.integers(50_000_000, 90_000_000))
def test_the_chain_is_found(release, decided, waited, queued):
    """Each link at its time, whatever was heard before the release."""
    commanded = release + decided + waited
    moved = decided + waited + queued
    poses = drive(release, moved, 16_000_000)
    transforms = drive(release, moved, 10_000_000)
    heard = Events(
        brick=fall(release), goals=[release - SECOND, release + decided, release + SECOND],
        commands=[(release - 20_000_000, 1.0), (release - 10_000_000, 0.0),
                  (commanded - 1, 0.0), (commanded, 3.0), (commanded + 10_000_000, 3.0)],
        poses=poses, transforms=transforms)
    ends = measuring.chain(heard)
    assert list(ends) == list(measuring.PARTS)
    assert ends['seen'] == pytest.approx(0.0083)
    assert ends['decided'] == pytest.approx(decided * 1e-9)
    assert ends['commanded'] == pytest.approx((decided + waited) * 1e-9)
    for name, places, period in (('moved', poses, 0.016), ('known', transforms, 0.010)):
        assert 0.0 <= ends[name] - moved * 1e-9 <= period + 1e-6
        assert any(place.published == release + round(ends[name] * 1e9) for place in places)
    taken = measuring.parts(ends)
    assert sum(taken.values()) == pytest.approx(ends['known'])
    assert taken['commanded'] == pytest.approx(waited * 1e-9, abs=1e-9)


def test_no_chain_is_made_up():
    """Of what was not heard."""
    release = 10**18
    whole = Events(brick=fall(release), goals=[release + 9_000_000],
                   commands=[(release + 15_000_000, 3.0)],
                   poses=drive(release, 80_000_000, 16_000_000),
                   transforms=drive(release, 80_000_000, 10_000_000))
    assert measuring.chain(whole) is not None
    rest = drive(release, SECOND, 16_000_000)
    for part in ({'brick': fall(release, drop=False)}, {'brick': []}, {'brick': fall(release)[:6]},
                 {'goals': [release - 1]}, {'commands': [(release + 1, 0.0)]}, {'poses': rest},
                 {'transforms': rest}, {'poses': []}):
        assert measuring.chain(whole._replace(**part)) is None


def test_processor_time_is_that_of_all_threads():
    """To the clock ticks that Linux counts in."""
    begin, own = measuring.processor_time(os.getpid()), process_time()
    while process_time() < own + 0.1:
        hypot(1.0, 2.0)
    used = measuring.processor_time(os.getpid()) - begin
    assert used == pytest.approx(process_time() - own, abs=0.03)


def test_machine_is_busy_with_at_least_this_process():
    """What the host of a virtual machine takes away, the process does not see."""
    begin, own = measuring.busy_time() + measuring.stolen_time(), process_time()
    while process_time() < own + 0.2:
        hypot(1.0, 2.0)
    assert measuring.busy_time() + measuring.stolen_time() - begin >= 0.15


def test_machine_is_busy_when_it_is_not_idle(monkeypatch):
    """Of 4 processors and 10 s, 25 s are idle, 3 s waited and 2 s stolen: 10 s are work."""
    spent = dict.fromkeys(('user', 'nice', 'system', 'idle', 'iowait', 'irq', 'softirq'), 0.0)
    monkeypatch.setattr(measuring.os, 'sysconf', lambda name: 4)
    busy = []
    for now, idle, waited, stolen in ((100.0, 50.0, 5.0, 1.0), (110.0, 75.0, 8.0, 3.0)):
        monkeypatch.setattr(measuring, 'monotonic', lambda now=now: now)
        monkeypatch.setattr(measuring, '_spent', lambda known={
            **spent, 'idle': idle, 'iowait': waited, 'steal': stolen}: known)
        busy.append(measuring.busy_time())
    assert busy[1] - busy[0] == pytest.approx(10.0)


def test_peak_memory_is_the_most_that_there_was():
    """Not what is left of it."""
    code = ('import os; from turtle_brick.tools.measuring import peak_memory; '
            'before = peak_memory(os.getpid()); data = b"x" * 80_000_000; del data; '
            'print(peak_memory(os.getpid()) - before)')
    done = subprocess.run([sys.executable, '-c', code], env=ENVIRONMENT, check=True,
                          capture_output=True, text=True)
    assert 75_000_000 <= int(done.stdout) <= 100_000_000


# ------------------------------------------------------------------------ what it compares with

def topics(graph, node):
    """Return what a node publishes and hears of interest: (direction, topic, type, QoS)."""
    own = set()
    for direction, names, infos in (
            ('publishes', node.get_publisher_names_and_types_by_node,
             node.get_publishers_info_by_topic),
            ('hears', node.get_subscriber_names_and_types_by_node,
             node.get_subscriptions_info_by_topic)):
        for topic, (kind, *_) in names(node.get_name(), node.get_namespace()):
            if topic in ('/rosout', '/parameter_events'):
                continue
            own.update((direction, topic, kind, info.qos_profile.durability.name)
                       for info in infos(topic) if info.node_name == node.get_name())
    return own


@pytest.mark.parametrize('name', processes.composable())
def test_the_floor_does_the_same_work(name, domain_id):
    """A bare node has the topics, the types and the timers of the real one."""
    seen = []
    for add in (benchmark_nodes.add_real, benchmark_nodes.add_bare):
        with Graph(domain_id, quiet=True) as graph:
            add(graph, name)
            node, = graph.nodes
            # The graph of a ROS domain is known with a delay, even to those who make it.
            graph.spin_until(lambda: len(topics(graph, node)) >= 2, DEADLINE, 'topics are known')
            before = set()
            while before != (now := topics(graph, node)):
                before = now
                graph.spin_for(0.1)
            seen.append((now, sorted(timer.timer_period_ns for timer in node.timers)))
    assert seen[0] == seen[1]


def test_every_node_has_a_floor():
    """The same five."""
    assert set(benchmark_nodes.BARE_NODES) == {*processes.OURS, *processes.FOREIGN}


# -------------------------------------------------------------------------------- how it reports

def found():
    """Return what a run may find, with numbers that are easy to recognise."""
    spread = measuring.spread([0.009, 0.010, 0.011])
    links = {'seen': 0.0081, 'decided': 0.0091, 'commanded': 0.0141, 'moved': 0.0831,
             'known': 0.0871}
    names = [*processes.OURS, *processes.FOREIGN]
    cores = {name: 0.1 * (index + 1) for index, name in enumerate(names)}
    run = {
        'floor': {'cores': dict.fromkeys(names, 0.1), 'memory': {}},
        'idle': cores, 'catching': cores, 'memory': {name: 50 * 2**20 for name in names},
        'intervals': {'cmd_vel': spread, 'world -> brick': spread},
        'intervals_busy': {'cmd_vel': spread, 'world -> brick': spread},
        'drift': measuring.Drift(15000, 0, 0, 0.001),
        'drift_busy': measuring.Drift(15000, 2, -1, 0.02),
        'latency': [links, links], 'outcomes': {'caught': 12, 'missed': 1},
    }
    composed = {**run, 'floor': {'cores': {'composed': 0.5}}, 'idle': {'composed': 0.6},
                'catching': {'composed': 0.7}, 'memory': {'composed': 90 * 2**20}}
    return {'machine': benchmark.machine(), 'seconds': 60.0, 'drops': 2, 'others_cores': 0.01,
            'stolen_cores': 0.034,
            'processes': run, 'composed': composed}


def test_the_table_holds_what_was_found(domain_id):
    """Sums, ratios and medians included."""
    text = report.report(found())
    rows = {line.strip().partition('  ')[0]: line.split() for line in text.splitlines()}
    assert rows['turtle_robot'][-5:] == ['10.0', '10.0', '1.00', '50', 'MB']
    assert rows['the three of ours'][-6:] == ['60.0', '60.0', '30.0', '2.00', '150', 'MB']
    assert '5 in one process' in rows and rows['5 in one process'][-3] == '1.20'
    assert 'drift of the physics: 0 steps of 15,000' in text
    assert 'with two busy loops 3 of 15,000' in text
    assert rows['decision (goal published)'][-6:] == ['9.1'] * 6
    assert rows['first motion (pose of turtlesim)'][-6:] == ['83.1'] * 6
    assert '12 caught, 1 missed' in text
    assert 'TOO MUCH' not in text
    assert 'kept 0.034 cores for itself' in text
    assert 'TOO MUCH' in report.report({**found(), 'others_cores': 0.2})


def test_the_numbers_can_be_read_by_others():
    """JSON holds all of them, by name."""
    read = json.loads(json.dumps(report.plain(found())))
    assert read['processes']['intervals']['cmd_vel']['p50'] == 0.01
    assert read['processes']['drift']['steps'] == 15000
    assert read['composed']['latency'][1]['moved'] == 0.0831
    assert read['machine']['cores'] >= 1 and read['machine']['processor']


@needs_matplotlib
def test_the_figure_is_made(tmp_path):
    """From one drop and from many."""
    for count in (1, 30):
        some = {'processes': {'latency': found()['processes']['latency'][:1] * count}}
        report.draw(some, tmp_path / f'{count}.png')
        assert (tmp_path / f'{count}.png').read_bytes().startswith(b'\x89PNG')


# ----------------------------------------------------------------------------------- how it ends

@pytest.mark.parametrize('args, words', [
    (['--seconds', '0'], '--seconds 0: at least 1'),
    (['--seconds', 'nan'], '--seconds nan: at least 1'),
    (['--drops', '0'], '--drops 0: at least 1'),
    (['--output', __file__], 'this is not a directory'),
])
def test_what_is_wrong_with_the_options_is_said(args, words, capsys):
    """One sentence names the value, and the status is 2."""
    with pytest.raises(SystemExit) as ended:
        benchmark.main(args)
    assert ended.value.code == 2
    assert words in capsys.readouterr().err


def test_a_node_that_cannot_run_is_named(tmp_path):
    """With the last that it said."""
    process = processes.Process(
        'arena', [sys.executable, '-c', 'print("first", flush=True); exit("no parameters")'],
        tmp_path / 'log')
    with pytest.raises(RuntimeError, match='arena has ended with status 1.*no parameters'):
        deadline = monotonic() + DEADLINE
        while monotonic() < deadline:
            process.check()
            Event().wait(0.01)


def children(parent):
    """Return the ids of the processes that a process has started."""
    found = []
    for stat in Path('/proc').glob('[0-9]*/stat'):
        try:
            fields = stat.read_text().rpartition(')')[2].split()
        except OSError:
            continue
        if int(fields[1]) == parent:
            found.append(int(stat.parent.name))
    return found


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_all_that_it_has_started(number, tmp_path, domain_id):
    """Quietly, with status 0, and nothing is written."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'turtle_brick.tools.benchmark', '--output', str(tmp_path / 'out')],
        env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    deadline = monotonic() + DEADLINE
    while len(started := children(process.pid)) < 5:
        assert monotonic() < deadline and process.poll() is None
        Event().wait(0.02)
    process.send_signal(number)
    _, said = process.communicate(timeout=DEADLINE)
    assert process.returncode == 0
    assert said.endswith('benchmark: stopped, and nothing written\n') and 'Traceback' not in said
    assert not any(Path('/proc', str(child)).exists() for child in started)
    assert not (tmp_path / 'out').exists()
