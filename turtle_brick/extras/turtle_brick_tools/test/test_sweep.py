# SPDX-License-Identifier: Apache-2.0

"""Test the table, figures, command line and guarantee checks of the sweep."""

import csv
from dataclasses import replace
from math import hypot, inf
import os
import re
import signal
import sys
from threading import Event
from time import monotonic

from defaults import PARAMETERS
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import default_path, Parameters
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick_tools import simulation, sweep
from turtle_brick_tools.simulation import (guaranteed_distance, guaranteed_distance_to,
                                           simulate_drop, trace)
from turtle_graph.client.processes import Process
import yaml

PLAN = sweep.Plan(grid=False, count=24, heights=(2.0, 9.0), seed=5)


def read(path):
    lines = path.read_text(encoding='utf-8').splitlines(keepends=True)
    above = [line for line in lines if line.startswith('#')]
    return list(csv.DictReader(lines[len(above):])), above


@pytest.fixture(scope='module')
def drops():
    return [simulate_drop(PARAMETERS, *one) for one in PLAN.simulations()]


@pytest.fixture(scope='module')
def caught(drops):
    return min((drop for drop in drops if drop.result.caught), key=lambda drop: drop.margin)


@pytest.fixture(scope='module')
def refused(drops):
    return next(drop for drop in drops if drop.outcome == 'refused')


def test_the_options_in_the_header_reproduce_the_table(tmp_path, capsys):
    given = yaml.safe_load(default_path().read_text(encoding='utf-8'))
    given['/**']['ros__parameters']['max_velocity'] = 2
    params_file = tmp_path / 'other.yaml'
    params_file.write_text(yaml.safe_dump(given), encoding='utf-8')

    def made(name, *options):
        assert sweep.main([*options, '--params-file', str(params_file), '--no-figures',
                           '--workers', '1', '--output', str(tmp_path / name)]) == 0
        return tmp_path / name / sweep.TABLE

    first = made('first', '--grid', '3', '--height', '2', '9', '--seed', '7')
    rows, (head, _, *parameters) = read(first)
    assert [int(row['index']) for row in rows] == list(range(9))
    above = yaml.safe_load(''.join(line.lstrip('# ') for line in parameters))
    assert Parameters.from_mapping(above) == replace(PARAMETERS, max_velocity=2.0)
    program, _, options = head.strip('# \n').partition(': sweep ')
    assert program.startswith('turtle_brick 1.')
    assert made('again', *options.split()).read_bytes() == first.read_bytes()
    assert made('other', *options.split(), '--seed', '8').read_bytes() != first.read_bytes()


def test_the_columns_of_a_row_are_consistent(drops):
    """A brick is caught if and only if its time margin is not negative."""
    rows = [drop.row() for drop in drops]
    assert {row['outcome'] for row in rows} == {'caught', 'refused'}
    for row in rows:
        assert row['distance'] == pytest.approx(
            hypot(row['brick_x'] - CENTER[0], row['brick_y'] - CENTER[1]), abs=1e-6)
        assert row['margin'] == pytest.approx(row['available'] - row['needed'])
        assert row['reachable'] == (row['margin'] >= 0.0) == (row['outcome'] == 'caught')
        assert row['available'] <= row['fall'] and row['finished']
        if row['outcome'] == 'caught':
            assert hypot(row['tilted_x'] - CENTER[0], row['tilted_y'] - CENTER[1]) < 0.02
        else:
            assert row['distance'] > row['guaranteed']
            assert row['slide'] is row['tilted_x'] is None


def test_positions_cover_the_grid_or_the_whole_range():
    """The first drops on a grid are spread over the arena, and each drop has its own seed."""
    plan = sweep.Plan(grid=True, count=9, heights=(8.0, 8.0), seed=1)
    numbers, seeds, bricks = zip(*plan.simulations())
    assert numbers == tuple(range(plan.drop_count)) and len(set(seeds)) == plan.drop_count
    cells = [(int(x / ARENA_SIZE * 9), int(y / ARENA_SIZE * 9)) for x, y, _ in bricks]
    assert sorted(cells) == [(i, j) for i in range(9) for j in range(9)]
    assert {z for _, _, z in bricks} == {8.0}
    assert len({i // 3 + 3 * (j // 3) for i, j in cells[:20]}) >= 8
    bricks = [brick for _, _, brick in replace(PLAN, count=2000).simulations()]
    for values, low, high in zip(zip(*bricks), (0.0, 0.0, 2.0), (ARENA_SIZE, ARENA_SIZE, 9.0)):
        assert low <= min(values) < low + 0.1 < high - 0.1 < max(values) <= high


def test_each_kind_of_broken_guarantee_is_found(caught, refused):
    missed = caught._replace(result=caught.result._replace(caught=False))
    near = refused._replace(guaranteed=refused.distance)
    unseen = near._replace(result=near.result._replace(decision=None))
    stuck = caught._replace(result=caught.result._replace(finished=False))
    for bad in (missed, near, unseen, stuck):
        assert bad.broken_guarantee and sweep.drop_to_draw([refused, caught, bad]) is bad
        assert f'guarantees: 1\n  drop {bad.number},' in sweep.summary([caught, bad, refused])
    assert not caught.broken_guarantee and not refused.broken_guarantee
    assert sweep.summary([caught, refused]).endswith('broken guarantees: 0')


def test_no_catch_is_guaranteed_outside_the_arena():
    limit = guaranteed_distance_to((5.0, 5.0, 8.0), PARAMETERS)
    assert limit == guaranteed_distance(8.0, PARAMETERS)
    assert guaranteed_distance_to((5.0, ARENA_SIZE + 0.01, 8.0), PARAMETERS) == -inf


def test_the_exit_status_is_1_after_a_broken_guarantee(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(simulation, 'guaranteed_distance', lambda *_: inf)
    assert sweep.main(['--drops', '6', '--workers', '1', '--no-figures',
                       '--output', str(tmp_path)]) == 1
    assert 'refused within the guaranteed' in capsys.readouterr().out


def test_figures_are_drawn(tmp_path, drops, caught):
    """The figures show every outcome of a drop. No map is drawn for a moving robot."""
    missed = caught._replace(result=caught.result._replace(caught=False))
    unseen = caught._replace(result=caught.result._replace(decision=None, caught=False))
    sweep.draw([simulate_drop(PARAMETERS, 0, 1, (2.0, 3.0, 0.5), moving=True)], PARAMETERS,
               tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ['drop.png']
    sweep.draw([*drops, missed, unseen], PARAMETERS, tmp_path)
    assert all((tmp_path / name).read_bytes().startswith(b'\x89PNG')
               for name in ('map.png', 'drop.png'))


def test_a_moving_robot_catches_every_brick_reported_as_reachable(tmp_path, capsys):
    """No catch is guaranteed, because the robot is not at rest at the arena's center."""
    assert sweep.main(['--moving', '--drops', '40', '--height', '5', '10', '--workers', '1',
                       '--no-figures', '--output', str(tmp_path)]) == 0
    output = capsys.readouterr().out
    assert re.search(r'^40 drops: [1-9]\d* caught, \d+ refused, 0 missed$', output, re.M)
    assert 'guaranteed catches, 0 drops' in output
    rows, header = read(tmp_path / sweep.TABLE)
    assert any('--moving' in line for line in header)
    assert len({(row['robot_x'], row['robot_y']) for row in rows}) > 30


def test_a_trace_repeats_the_drop(caught):
    samples = trace(PARAMETERS, caught)
    falling = [sample.time for sample in samples if sample.brick_state.name == 'FALLING']
    assert falling[0] == pytest.approx(0.004)
    assert falling[-1] + 0.004 == pytest.approx(caught.result.fall_time)
    assert max(sample.commanded for sample in samples) == pytest.approx(PARAMETERS.max_velocity)
    command, motion = (next(sample.time for sample in samples if getattr(sample, speed) > 0.0)
                       for speed in ('commanded', 'speed'))
    assert 0.0 < command - caught.result.decision_time < 0.020 < motion - command < 0.090
    assert max(sample.tilt for sample in samples) == pytest.approx(PARAMETERS.tilt_angle)
    assert {sample.brick_state.name for sample in samples} == {
        'HOVERING', 'FALLING', 'RIDING', 'FLOATING'}


@pytest.mark.parametrize('args, words', [
    (['--height', 'nan'], '--height is nan, but must be one height'),
    (['--height', '9', '2'], '--height is 9.0 2.0, but must be'),
    (['--params-file', 'nowhere.yaml'], 'nowhere.yaml: No such file'),
    (['--output', '.'], '[Errno 17] File exists'),
    (['--dask', 'no address'], ''),
])
def test_invalid_options_give_one_sentence(args, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / sweep.TABLE).write_text('precious')
    assert sweep.main(args) == 2
    assert capsys.readouterr().err.startswith(f'sweep: {words}')
    assert [path.read_text() for path in tmp_path.iterdir()] == ['precious']


def test_ctrl_c_keeps_the_finished_drops(tmp_path, drops):
    """The rows written by two workers before Ctrl-C match those written by one worker."""
    options = '--drops 1000000 --workers 2 --height 2 9 --seed 5 --no-figures --output'
    with Process([sys.executable, '-m', 'turtle_brick_tools.sweep', *options.split(),
                  str(tmp_path)]) as process:
        table, deadline = tmp_path / sweep.TABLE, monotonic() + 300.0
        while not table.exists() or table.read_bytes().count(b'\n') < 22:
            assert monotonic() < deadline
            Event().wait(0.05)
        # Ctrl-C in a terminal sends SIGINT to every process in the foreground group.
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(300.0) == 0
    rows, _ = read(table)
    assert [int(row['index']) for row in rows] == list(range(len(rows)))
    for row, drop in zip(rows, drops):
        assert list(row.values()) == [
            '' if value is None else str(sweep.format_value(value))
            for value in drop.row().values()]
    assert f'{len(rows):,} of 1,000,000 drops in ' in process.output
    assert process.output.count('\n') == 7, process.output
