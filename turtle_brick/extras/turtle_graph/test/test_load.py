# SPDX-License-Identifier: Apache-2.0
"""Test how the load of the machine is measured."""

import os
import sys

import pytest
from turtle_graph.client import load
from turtle_graph.client.load import LoadMeter
from turtle_graph.client.processes import Process
from turtle_graph.referee.referee import graph_processes

MILLISECOND = 1_000_000


@pytest.mark.parametrize('used, ran, waited, is_calm', (
    (0.2, 0.1, 0.01, True),  # A processor was free whenever the graph needed one.
    (0.4, 0.1, 0.15, False),  # Other programs delayed the graph.
    (0.4, 0.37, 0.15, True),  # The threads of the graph waited for one another.
    (0.4, 0.4, 0.9, True)))
def test_a_window_is_calm_if_other_programs_do_not_delay_the_graph(
        used, ran, waited, is_calm, monkeypatch):
    busy = iter((10.0, 10.0 + used))
    threads = iter(({'executor': (1.0, 2.0), 'idle': (5.0, 7.0)},
                    {'executor': (1.0 + ran, 2.0 + waited), 'idle': (5.0, 7.0),
                     'new': (9.0, 9.0)}))
    monkeypatch.setattr(load, 'used_time', lambda: next(busy))
    monkeypatch.setattr(load, 'thread_times', lambda processes: next(threads))
    meter, begin = LoadMeter(lambda: [1]), 1_800_000_000_000_000_000
    assert meter.measure(begin) is None
    assert meter.measure(begin + 100 * MILLISECOND) is None
    window = meter.measure(begin + 200 * MILLISECOND)
    assert (window.begin, window.end, window.calm) == (
        begin, begin + 200 * MILLISECOND, is_calm)
    assert not window._replace(end=begin + 2_000 * MILLISECOND).calm


def test_threads_and_processors_are_measured():
    begin, busy = load.thread_times([os.getpid(), 1 << 30]), load.used_time()
    sum(range(5_000_000))
    end = load.thread_times([os.getpid()])
    assert max(end[thread][0] - begin[thread][0] for thread in begin if thread in end) > 0.02
    assert load.used_time() > busy


def test_rviz2_is_not_a_part_of_the_graph():
    wait = 'print("ready", flush=True); input()'
    start = f'from subprocess import *; Popen([{sys.executable!r}, "-c", {wait!r}, "/bin/rviz2"], '
    with Process([sys.executable, '-c', f'{start}stdin=PIPE).wait()']) as launched:
        launched.wait_for_output('ready', 10.0)
        assert len(launched.family()) == 2
        assert graph_processes(launched) == [launched.pid]
