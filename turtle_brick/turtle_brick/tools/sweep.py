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

"""
sweep: drop many bricks without ROS, over all cores, and see what is caught, refused or missed.

Every drop begins with the robot at rest in the center of the arena, in a simulation of its own.
The output is a table, drops.csv, with one row per drop, and figures: the map of the arena, and one
drop in detail. The table depends on the options alone, not on the number of workers: the same
options give the same file, byte for byte.

After Ctrl-C the drops that are done stay in the table, and the figures show them.

With --dask the workers of a Dask cluster make the drops: the table is the same, also where some of
them die.

The status is 0 if both promises were kept in every drop: what was said to be reachable was
caught, and nothing within the guaranteed distance was refused. It is 1 if not, and 2 if the sweep
failed.
"""

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor
import csv
from dataclasses import asdict, dataclass
from itertools import takewhile
from math import inf
from pathlib import Path
from random import Random
import signal
import sys
from threading import Event
from time import monotonic, strftime
from xml.etree import ElementTree

from joblib import cpu_count, delayed, Parallel, parallel_config
from tqdm import tqdm
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import default_path, load, Parameters
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.tools.simulation import at_least_one, counted, Drop, simulate, trace

TABLE = 'drops.csv'


@dataclass(frozen=True)
class Plan:
    """The drops to make: with the parameters, all that the table depends on."""

    grid: bool  # whether the bricks are on a grid
    count: int  # how many drops; on a grid, how many along each side of the arena
    heights: tuple[float, float]  # the lowest and the highest release of a brick (m)
    seed: int

    @property
    def drops(self) -> int:
        """Return how many drops there are in all."""
        return self.count ** 2 if self.grid else self.count

    @property
    def options(self) -> str:
        """Return the command line that asks for it."""
        heights = ' '.join(repr(height) for height in dict.fromkeys(self.heights))
        return (f'--{"grid" if self.grid else "drops"} {self.count} --height {heights} '
                f'--seed {self.seed}')

    def simulations(self) -> Iterator[tuple[int, int, Vector]]:
        """
        Yield number, seed and brick of each drop, in the order of the table.

        The bricks are at points of the world (m), uniformly at random, or in the centers of the
        arena's cells in random order, so that the first ones already cover the whole arena.
        """
        bricks, seeds = Random(f'{self.seed} bricks'), Random(f'{self.seed} simulations')
        places: Iterator[tuple[float, float]] = (
            (bricks.uniform(0.0, ARENA_SIZE), bricks.uniform(0.0, ARENA_SIZE))
            for _ in range(self.drops))
        if self.grid:
            side = ARENA_SIZE / self.count
            cells = [((column + 0.5) * side, (row + 0.5) * side)
                     for row in range(self.count) for column in range(self.count)]
            bricks.shuffle(cells)
            places = iter(cells)
        for number, (x, y) in enumerate(places):
            yield number, seeds.getrandbits(32), (x, y, bricks.uniform(*self.heights))


def heading(parameters: Parameters, plan: Plan) -> str:
    """Return the head of the table: everything needed to make it again."""
    version = ElementTree.parse(default_path().parents[1] / 'package.xml').findtext('version')
    lines = [f'turtle_brick {version}: sweep {plan.options}',
             'lengths in m, in the world; times in s; parameters:']
    lines += [f'  {name}: {list(value) if isinstance(value, tuple) else value}'
              for name, value in asdict(parameters).items()]
    return ''.join(f'# {line}\n' for line in lines)


def as_text(value: object) -> object:
    """Return a value as it stands in the table: six decimals, booleans as 0 and 1."""
    if isinstance(value, bool):
        return int(value)
    return f'{value:.6f}' if isinstance(value, float) else value


def summary(drops: Sequence[Drop]) -> str:
    """Return what became of the drops, and which promises were broken."""
    promised = [drop for drop in drops if drop.within_promise]
    broken = [drop for drop in drops if drop.broken]
    return '\n'.join([
        counted(drops), f'where a catch is promised, {counted(promised)}',
        f'promises broken: {len(broken):,}'] + [
            f'  drop {drop.number}, seed {drop.seed}, {drop.distance:.3f} m away: {drop.broken}'
            for drop in broken[:10]])


def most_telling(drops: Sequence[Drop]) -> Drop:
    """Return the drop to show: a broken promise, else the tightest catch, else the first."""
    return min(drops, key=lambda drop: (
        not drop.broken, not drop.result.caught,
        inf if drop.margin is None else drop.margin, drop.number))


def run(options: argparse.Namespace, parameters: Parameters, plan: Plan) -> list[Drop]:
    """Make the drops and write the table; return those that were begun before a Ctrl-C, or all."""
    drops: list[Drop] = []
    begin = monotonic()
    stopped = Event()
    begun = takewhile(lambda _: not stopped.is_set(), plan.simulations())

    def stop(*_: object) -> None:
        """Begin no further drop; a second Ctrl-C ends all at once."""
        stopped.set()
        signal.signal(signal.SIGINT, on_interrupt)

    with open(options.output / TABLE, 'x', encoding='utf-8', newline='') as file:
        file.write(heading(parameters, plan))
        writer = csv.writer(file, lineterminator='\n')
        # The workers begin here and inherit this: a Ctrl-C is for the first process alone.
        on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)
        results = Parallel(None if options.dask else options.workers, return_as='generator')(
            delayed(simulate)(parameters, *one) for one in begun)
        signal.signal(signal.SIGINT, stop)
        # Not before a Ctrl-C keeps the drops: who reads this may send one.
        print(f'{plan.drops:,} drops, into {options.output.resolve()}', flush=True)
        for drop in tqdm(results, total=plan.drops, unit=' drops', disable=None):
            row = drop.row()
            if not drops:
                writer.writerow(row)
            writer.writerow(map(as_text, row.values()))
            file.flush()
            drops.append(drop)
    signal.signal(signal.SIGINT, on_interrupt)
    print(f'{len(drops):,} of {plan.drops:,} drops in {monotonic() - begin:.1f} s\n'
          f'  {options.output / TABLE}', flush=True)
    return drops


def draw(drops: Sequence[Drop], parameters: Parameters, directory: Path) -> None:
    """Draw the figures of what became of at least one drop."""
    from turtle_brick.tools import plots  # here, since workers have no need of matplotlib
    plots.reachability_map(drops, parameters, directory / 'map.png')
    chosen = most_telling(drops)
    plots.one_drop(trace(parameters, chosen), chosen, parameters, directory / 'drop.png')
    for name in ('map.png', 'drop.png'):
        print(f'  {directory / name}')


def main(args: Sequence[str] | None = None) -> int:
    """Make, count and draw the drops; return the exit status."""
    first, second = __doc__.strip().split('\n\n')[:2]
    parser = argparse.ArgumentParser(
        prog='sweep', description=first.partition(': ')[2].capitalize(), epilog=second)
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument('--drops', type=at_least_one, default=2000, metavar='N',
                      help='drop N bricks at random places of the arena (default: 2000)')
    kind.add_argument('--grid', type=at_least_one, metavar='N',
                      help='drop a brick in each of the N x N cells of the arena instead')
    parser.add_argument('--height', type=float, nargs='+', metavar='Z',
                        help="height of the brick's center at the release (m): one number, or the "
                        'range of random heights (default: that of brick_start)')
    parser.add_argument('--seed', type=int, default=1, metavar='N',
                        help='seed of all random numbers (default: 1)')
    parser.add_argument('--workers', type=at_least_one, default=cpu_count(), metavar='N',
                        help='processes (default: one for each core)')
    parser.add_argument('--dask', metavar='ADDRESS',
                        help='of a Dask scheduler, as tcp://host:8786: its workers make the drops')
    parser.add_argument('--params-file', type=Path, metavar='FILE',
                        help='the parameters (default: config/turtle.yaml of the package)')
    parser.add_argument('--output', type=Path, metavar='DIR',
                        default=Path('sweeps', strftime('%Y%m%d-%H%M%S')),
                        help='where the table and the figures go (default: sweeps/<date>-<time>)')
    parser.add_argument('--no-figures', dest='figures', action='store_false',
                        help='make the table only')
    options = parser.parse_args(args)
    try:
        parameters = load(options.params_file)
        lowest = parameters.brick_size[2] / 2.0
        heights = options.height or [parameters.brick_start[2]]
        if len(heights) > 2 or not lowest <= heights[0] <= heights[-1] < inf:
            raise ValueError('--height takes one number, or the lowest and the highest, from '
                             f'{lowest:g} m on, where a brick lies on the ground')
        plan = Plan(options.grid is not None, options.grid or options.drops,
                    (heights[0], heights[-1]), options.seed)
        if options.dask:
            parallel_config('dask', scheduler_host=options.dask)
        options.output.mkdir(parents=True, exist_ok=True)
        drops = run(options, parameters, plan)
        if drops and options.figures:
            draw(drops, parameters, options.output)
    except (BrokenExecutor, OSError, ValueError) as error:
        print(f'sweep: {error}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    print(f'\n{summary(drops)}')
    return 1 if any(drop.broken for drop in drops) else 0


if __name__ == '__main__':
    sys.exit(main())
