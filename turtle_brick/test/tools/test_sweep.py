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

"""The sweep: reproducible whatever the workers, honest about promises, and never in vain."""

import csv
from dataclasses import replace
from importlib.util import find_spec
from math import hypot, inf, sqrt
import os
from pathlib import Path
import signal
import subprocess
import sys
from threading import Event
from time import monotonic

import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import default_path, from_mapping, load
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.tools import sweep, sweeping
import yaml

PNG = b'\x89PNG\r\n\x1a\n'
FIGURES = ('map.png', 'margin.png', 'drop.png')
DEADLINE = 60.0
PARAMETERS = load()
PLAN = sweeping.Plan(grid=False, count=24, heights=(2.0, 9.0), seed=5)
ENVIRONMENT = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}

needs_matplotlib = pytest.mark.skipif(
    find_spec('matplotlib') is None, reason='matplotlib is not installed')


def read(path):
    """Return the rows of a table, and the lines above it."""
    lines = path.read_text(encoding='utf-8').splitlines(keepends=True)
    above = [line for line in lines if line.startswith('#')]
    return list(csv.DictReader(lines[len(above):])), ''.join(above)


def alone(drop):
    """Return the simulation of a drop that was the first of its own."""
    return sweeping.Chain(drop.index, drop.seed, ((drop.brick_x, drop.brick_y, drop.brick_z),))


def start(*args):
    """Start a sweep in a process group of its own, as a terminal does."""
    return subprocess.Popen(
        [sys.executable, '-m', 'turtle_brick.tools.sweep', *map(str, args)], env=ENVIRONMENT,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


def wait_until(condition):
    """Wait for a condition, a minute at most."""
    deadline = monotonic() + DEADLINE
    pause = Event()
    while not condition():
        assert monotonic() < deadline
        pause.wait(0.01)


def group_is_empty(group):
    """Tell whether no process of a group is left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


@pytest.fixture(scope='module')
def drops():
    """Make the drops of a small plan in this very process."""
    return [drop for batch in sweep.batches(PARAMETERS, PLAN, 1, lambda: False)
            for drop in batch.drops]


def test_the_table_depends_on_the_options_alone(tmp_path, capsys):
    """One worker and three write the same bytes."""
    options = ['--drops', '30', '--seed', '7', '--height', '2', '9', '--no-figures']
    tables = []
    for workers in ('1', '3'):
        directory = tmp_path / workers
        assert sweep.main([*options, '--workers', workers, '--output', str(directory)]) == 0
        tables.append((directory / sweep.TABLE).read_bytes())
    assert tables[0] == tables[1]
    other = tmp_path / 'other'
    assert sweep.main([*options, '--seed', '8', '--workers', '1', '--output', str(other)]) == 0
    assert (other / sweep.TABLE).read_bytes() != tables[0]


def test_what_stands_above_the_table_makes_it_again(tmp_path, capsys):
    """Version, options and parameters are there, and the options give the same table."""
    params_file = tmp_path / 'other.yaml'
    given = yaml.safe_load(default_path().read_text(encoding='utf-8'))
    given['/**']['ros__parameters']['max_velocity'] = 2
    params_file.write_text(yaml.safe_dump(given), encoding='utf-8')
    assert sweep.main(['--grid', '4', '--seed', '11', '--chain', '3', '--no-jitter',
                       '--params-file', str(params_file), '--workers', '1', '--no-figures',
                       '--output', str(tmp_path / 'first')]) == 0
    rows, above = read(tmp_path / 'first' / sweep.TABLE)
    first, _, *parameters = (line.lstrip('# ') for line in above.splitlines())
    assert from_mapping(yaml.safe_load('\n'.join(parameters))) == replace(
        PARAMETERS, max_velocity=2.0)
    program, _, options = first.partition(': sweep ')
    assert program == f'turtle_brick {sweeping.version()}'
    assert sweep.main([*options.split(), '--params-file', str(params_file), '--workers', '1',
                       '--no-figures', '--output', str(tmp_path / 'again')]) == 0
    assert ((tmp_path / 'first' / sweep.TABLE).read_bytes()
            == (tmp_path / 'again' / sweep.TABLE).read_bytes())
    assert [int(row['turn']) for row in rows] == [0, 1, 2] * 5 + [0]


def test_version_is_that_of_the_package():
    """The version is a number with dots, the one that setup.py installs."""
    setup = Path(__file__).resolve().parents[2] / 'setup.py'
    assert f"version='{sweeping.version()}'" in setup.read_text(encoding='utf-8')


def test_a_row_can_be_made_again_alone(drops):
    """Seed and place of a row are all that it takes."""
    for drop in drops[::7]:
        chain = alone(drop)
        assert sweeping.make(PARAMETERS, chain, PLAN.delays)[0] == [drop]


def test_rows_obey_the_laws(drops):
    """Falls take sqrt(2 h / g), margins are differences, and what is caught lies on top."""
    assert {drop.outcome for drop in drops} == {'caught', 'refused'}
    for drop in drops:
        assert (drop.robot_x, drop.robot_y) == pytest.approx(CENTER, abs=1e-6)
        assert drop.distance == pytest.approx(
            hypot(drop.brick_x - CENTER[0], drop.brick_y - CENTER[1]), abs=1e-6)
        assert drop.margin == pytest.approx(drop.available - drop.needed)
        assert drop.reachable == (drop.margin >= 0.0) == (drop.outcome == 'caught')
        bottom = drop.brick_z - PARAMETERS.brick_size[2] / 2.0
        way = bottom - (PARAMETERS.platform_height if drop.outcome == 'caught' else 0.0)
        time = sqrt(2.0 * way / PARAMETERS.gravity_accel)
        assert time - 1e-6 <= drop.fall <= time + 0.004 + 1e-6
        assert drop.finished
        if drop.outcome == 'caught':
            assert 0.0 <= drop.spare <= drop.fall
            assert 0.0 <= drop.offset <= PARAMETERS.platform_radius
            assert hypot(drop.tilted_x - CENTER[0], drop.tilted_y - CENTER[1]) < 0.02
            assert drop.slide > 0.0
        else:
            assert drop.distance > drop.promised
            assert drop.spare is drop.offset is drop.slide is drop.tilted_x is None


def test_time_to_spare_is_the_time_that_the_robot_was_there(drops):
    """It is no less than reckoned, and no more than a robot without latency would have."""
    caught = [drop for drop in drops if drop.outcome == 'caught'
              and drop.distance > PARAMETERS.platform_radius]
    assert len(caught) > 3
    for drop in caught:
        travel = (drop.distance - PARAMETERS.platform_radius) / PARAMETERS.max_velocity
        assert drop.margin - 0.005 <= drop.spare <= drop.fall - travel


def test_a_grid_has_one_brick_in_every_cell():
    """In an order that spreads a part of it over the arena."""
    plan = sweeping.Plan(grid=True, count=9, heights=(8.0, 8.0), seed=1)
    bricks = list(plan.bricks())
    cells = [(int(x / ARENA_SIZE * 9), int(y / ARENA_SIZE * 9)) for x, y, _ in bricks]
    assert sorted(cells) == [(i, j) for i in range(9) for j in range(9)]
    assert cells != sorted(cells) and {z for _, _, z in bricks} == {8.0}
    quarter = cells[:20]
    assert len({i // 3 + 3 * (j // 3) for i, j in quarter}) >= 8


def test_random_bricks_are_in_the_arena_and_between_the_heights():
    """They fill it, too."""
    bricks = list(replace(PLAN, count=2000).bricks())
    for axis, low, high in ((0, 0.0, ARENA_SIZE), (1, 0.0, ARENA_SIZE), (2, *PLAN.heights)):
        values = [brick[axis] for brick in bricks]
        assert low <= min(values) <= low + 0.01 * (high - low)
        assert high - 0.01 * (high - low) <= max(values) <= high


def test_chains_hold_every_brick_once():
    """Whatever their length."""
    for length in (1, 5, 24, 100):
        chains = list(replace(PLAN, chain=length).chains())
        assert [brick for chain in chains for brick in chain.bricks] == list(PLAN.bricks())
        assert [chain.first for chain in chains] == list(range(0, 24, length))
        assert len({chain.seed for chain in chains}) == len(chains)


def test_broken_promises_are_found(drops):
    """Each kind, and only then."""
    caught = next(drop for drop in drops if drop.outcome == 'caught')
    refused = next(drop for drop in drops if drop.outcome == 'refused')
    assert sweeping.is_good([caught, refused])
    missed = replace(caught, outcome='missed')
    near = replace(refused, distance=refused.promised)
    unseen = replace(near, reachable=None)
    stuck = replace(caught, finished=False)
    for bad in (missed, near, unseen, stuck):
        assert not sweeping.is_good([caught, bad, refused])
        assert 'BROKEN in 1 of ' in sweeping.summary([caught, bad, refused])
    assert [bool(drop.broken) for drop in (missed, near, unseen, stuck)] == [True] * 3 + [False]
    outside = replace(refused, promised=None, distance=0.1)
    assert not outside.broken
    assert 'BROKEN' not in sweeping.summary([caught, refused, outside])


def test_nothing_is_promised_outside_the_arena_or_below_the_platform():
    """There alone."""
    assert sweeping.promise((5.0, 5.0, 8.0), PARAMETERS) == guaranteed_distance(8.0, PARAMETERS)
    assert sweeping.promise((-0.01, 5.0, 8.0), PARAMETERS) is None
    assert sweeping.promise((5.0, ARENA_SIZE + 0.01, 8.0), PARAMETERS) is None
    assert sweeping.promise((5.0, 5.0, 1.5), PARAMETERS) is None


def test_a_broken_promise_ends_in_status_1(tmp_path, capsys, monkeypatch):
    """A catcher that is promised to do more than it can is found out."""
    monkeypatch.setattr(sweeping, 'guaranteed_distance', lambda height, parameters: inf)
    assert sweep.main(['--drops', '12', '--workers', '1', '--no-figures',
                       '--output', str(tmp_path / 'out')]) == 1
    assert 'refused within the promised' in capsys.readouterr().out


def test_bricks_from_below_the_platform_are_refused_and_break_nothing(tmp_path, capsys):
    """No fall ends on the platform, and none is promised to."""
    assert sweep.main(['--grid', '2', '--height', '1.2', '--workers', '1', '--no-figures',
                       '--output', str(tmp_path / 'out')]) == 0
    rows, _ = read(tmp_path / 'out' / sweep.TABLE)
    assert [row['outcome'] for row in rows] == ['refused'] * 4
    assert [row['promised'] for row in rows] == [''] * 4


@pytest.mark.parametrize('args, words', [
    (['--drops', '0'], '0 is too small: at least 1'),
    (['--drops', 'many'], "'many' is not a whole number"),
    (['--drops', '3', '--grid', '3'], 'not allowed with'),
    (['--grid', '-2'], '-2 is too small: at least 1'),
    (['--workers', '0'], '0 is too small: at least 1'),
    (['--chain', '0'], '0 is too small: at least 1'),
    (['--height', 'nan'], '--height nan cannot be'),
    (['--height', '0.01'], '--height 0.01 cannot be'),
    (['--height', '9', '2'], '--height 9 2: the lowest comes first'),
    (['--height', '1', '2', '3'], 'one or two numbers, not 3'),
    (['--params-file', 'nowhere.yaml'], 'nowhere.yaml: No such file'),
    (['--output', __file__], 'this is not a directory'),
])
def test_what_is_wrong_with_the_options_is_said(args, words, tmp_path, capsys, monkeypatch):
    """One sentence names the value, the status is 2, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        sweep.main(args)
    assert ended.value.code == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_no_table_is_overwritten(tmp_path, capsys):
    """Results that are there stay as they are."""
    table = tmp_path / sweep.TABLE
    table.write_text('precious')
    with pytest.raises(SystemExit) as ended:
        sweep.main(['--drops', '3', '--output', str(tmp_path)])
    assert ended.value.code == 2
    assert table.read_text() == 'precious'
    assert 'there is a drops.csv already' in capsys.readouterr().err


def test_a_directory_that_cannot_be_made_is_named(tmp_path, capsys):
    """The reason with it, and status 2."""
    (tmp_path / 'file').write_text('')
    assert sweep.main(['--drops', '3', '--output', str(tmp_path / 'file' / 'below')]) == 2
    error = capsys.readouterr().err
    assert error.startswith('sweep: ') and 'file' in error and error.count('\n') == 1


def test_without_output_it_writes_into_sweeps_and_says_where(tmp_path, capsys, monkeypatch):
    """A folder that git leaves out."""
    monkeypatch.chdir(tmp_path)
    assert sweep.main(['--drops', '1', '--workers', '1', '--no-figures']) == 0
    table, = tmp_path.glob('sweeps/*/drops.csv')
    assert [*tmp_path.iterdir()] == [tmp_path / 'sweeps']
    assert f'1 drops, into {table.parent}\n' in capsys.readouterr().out


def test_signals_are_given_back(tmp_path, capsys):
    """To whoever had them before."""
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    sweep.main(['--drops', '1', '--no-figures', '--output', str(tmp_path / 'out')])
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


@needs_matplotlib
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_keeps_what_is_done(number, tmp_path):
    """The table is complete up to there, figures are made of it, the status is 0."""
    output = tmp_path / 'out'
    process = start('--drops', 1000000, '--workers', 2, '--output', output)
    table = output / sweep.TABLE
    wait_until(lambda: table.exists() and table.read_bytes().count(b'\n') > 40)
    # A terminal's Ctrl-C reaches every process of the group, the workers too.
    os.killpg(process.pid, number)
    out, err = process.communicate(timeout=DEADLINE)
    assert (process.returncode, err) == (0, '')
    rows, _ = read(table)
    assert [int(row['index']) for row in rows] == list(range(len(rows)))
    assert all(None not in row.values() and None not in row for row in rows)
    assert f'Stopped: {len(rows):,} of 1,000,000 drops are done, and kept.' in out
    assert f'held in all {sum(row["reachable"] == "1" for row in rows)}' in out
    for name in FIGURES:
        assert (output / name).read_bytes().startswith(PNG)
    assert sorted(path.name for path in output.iterdir()) == sorted([sweep.TABLE, *FIGURES])
    wait_until(lambda: group_is_empty(process.pid))


def test_a_signal_at_once_is_no_trouble(tmp_path):
    """Not even before the first drop, while the workers start."""
    output = tmp_path / 'out'
    process = start('--drops', 1000000, '--workers', 2, '--output', output, '--no-figures')
    wait_until((output / sweep.TABLE).exists)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=DEADLINE)
    assert (process.returncode, err) == (0, '')
    assert 'Stopped: ' in out
    wait_until(lambda: group_is_empty(process.pid))


def test_workers_end_with_the_first_process_however_it_ends(tmp_path):
    """Nobody is left behind when it is killed."""
    output = tmp_path / 'out'
    process = start('--drops', 1000000, '--workers', 2, '--output', output)
    table = output / sweep.TABLE
    wait_until(lambda: table.exists() and table.read_bytes().count(b'\n') > 20)
    process.kill()
    process.communicate(timeout=DEADLINE)
    wait_until(lambda: group_is_empty(process.pid))


def test_a_killed_worker_is_reported(tmp_path, capsys, monkeypatch):
    """What was done before is kept, and the status says that it is not all."""
    def broken(*_):
        yield sweep.work(PARAMETERS, [next(PLAN.chains())], PLAN.delays)
        raise sweep.BrokenProcessPool('gone')

    monkeypatch.setattr(sweep, 'batches', broken)
    output = tmp_path / 'out'
    assert sweep.main(['--drops', '5', '--no-figures', '--output', str(output)]) == 2
    assert len(read(output / sweep.TABLE)[0]) == 1
    assert 'a worker was killed' in capsys.readouterr().err


@needs_matplotlib
def test_a_second_ctrl_c_leaves_figures_out(tmp_path, drops, capsys):
    """The first was for the drops, the next is for the drawing."""
    sweep.draw(drops, PARAMETERS, PLAN, tmp_path, lambda: True)
    assert not list(tmp_path.iterdir())
    assert 'left out' in capsys.readouterr().out


@needs_matplotlib
def test_figures_show_missed_bricks_and_chains_too(tmp_path, drops):
    """Whatever became of the bricks, from one drop to many, and the chosen one is found again."""
    missed = replace(drops[0], outcome='missed', reachable=True, index=99)
    for number, some in enumerate(([missed], drops, [*drops, missed])):
        directory = tmp_path / str(number)
        directory.mkdir()
        plan = replace(PLAN, count=100, chain=4)
        here = [replace(drop, turn=drop.index % 4) for drop in some]
        sweep.draw(here, PARAMETERS, plan, directory, lambda: False)
        assert sorted(path.name for path in directory.iterdir()) == sorted(FIGURES)
    assert sweeping.most_telling([*drops, missed]) is missed


@needs_matplotlib
@pytest.mark.parametrize('height', ['0.5', '1.7'])
def test_bricks_from_below_the_promise_are_drawn(tmp_path, capsys, height):
    """Where no catch is promised at any distance."""
    assert sweep.main(['--drops', '4', '--workers', '1', '--height', height,
                       '--output', str(tmp_path / 'out')]) == 0
    assert sorted(path.name for path in (tmp_path / 'out').iterdir()) == sorted(
        [sweep.TABLE, *FIGURES])


def test_without_matplotlib_the_table_is_made_all_the_same(tmp_path, capsys, monkeypatch):
    """The figures are missed with one sentence."""
    monkeypatch.setattr(sweep, 'find_spec', lambda name: None)
    assert sweep.main(['--drops', '2', '--workers', '1', '--output', str(tmp_path / 'out')]) == 0
    assert 'they need matplotlib' in capsys.readouterr().out
    assert [path.name for path in (tmp_path / 'out').iterdir()] == [sweep.TABLE]


def test_a_trace_is_the_drop_of_its_row(drops):
    """Commands, speeds and phases belong together."""
    drop = min((drop for drop in drops if drop.outcome == 'caught'), key=lambda d: d.spare)
    chain = alone(drop)
    seen = sweeping.trace(PARAMETERS, chain, 0, PLAN.delays)
    falling = [time for time, phase in zip(seen.time, seen.phase) if phase.name == 'FALLING']
    assert falling[0] == pytest.approx(0.004)
    assert falling[-1] + 0.004 == pytest.approx(drop.fall)
    assert max(seen.command) == pytest.approx(PARAMETERS.max_velocity)
    assert max(seen.speed) == pytest.approx(PARAMETERS.max_velocity)
    first_command = next(t for t, v in zip(seen.command_time, seen.command) if v > 0.0)
    first_motion = next(t for t, v in zip(seen.time, seen.speed) if v > 0.0)
    assert 0.0 < first_command - seen.decision_time < 0.015
    assert 0.050 < first_motion - first_command < 0.090
    assert max(seen.tilt) == pytest.approx(PARAMETERS.tilt_angle)
    assert {phase.name for phase in seen.phase} == {'HOVERING', 'FALLING', 'RIDING', 'FLOATING'}


def test_nothing_of_ros_or_matplotlib_is_imported():
    """Before there is something to draw."""
    code = ('import sys, turtle_brick.tools.sweep; '
            'print(sorted({"rclpy", "matplotlib", "numpy", "tqdm"} & set(sys.modules)))')
    done = subprocess.run([sys.executable, '-c', code], env=ENVIRONMENT, check=True,
                          capture_output=True, text=True)
    assert done.stdout.strip() == '[]'
