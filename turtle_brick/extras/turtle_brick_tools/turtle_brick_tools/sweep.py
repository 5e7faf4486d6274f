# SPDX-License-Identifier: Apache-2.0

"""
sweep: simulate many drops without ROS, on all cores, and count the outcomes.

The sweep writes a table (drops.csv, one row per drop), a map of the arena, and a plot of one drop.
The table depends only on the options and the parameters. The same options produce an identical
table even if some workers in a Dask cluster fail.
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
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick_tools import positive_int
from turtle_brick_tools.simulation import outcome_counts, simulate_drop, SimulatedDrop, trace

TABLE = 'drops.csv'


@dataclass(frozen=True)
class Plan:
    """The drops in a sweep. The plan and the parameters fully determine the table."""

    grid: bool  # Whether the bricks are on a grid.
    count: int  # Number of drops, or number of cells along each side of the grid.
    heights: tuple[float, float]  # Minimum and maximum release height (m).
    seed: int
    moving: bool = False  # Whether the robot drives between random points.

    @property
    def drop_count(self) -> int:
        """Return the total number of drops."""
        return self.count ** 2 if self.grid else self.count

    @property
    def options(self) -> str:
        """Return the command-line options that produce this plan."""
        kind = '--grid' if self.grid else '--drops'
        low, high = self.heights
        moving = ' --moving' if self.moving else ''
        return f'{kind} {self.count} --height {low!r} {high!r} --seed {self.seed}{moving}'

    def simulations(self) -> Iterator[tuple[int, int, Vector]]:
        """Yield the index, seed and brick position (m, world frame) for each drop, in order."""
        bricks, seeds = Random(f'{self.seed} bricks'), Random(f'{self.seed} simulations')
        positions: Iterator[tuple[float, float]] = (
            (bricks.uniform(0.0, ARENA_SIZE), bricks.uniform(0.0, ARENA_SIZE))
            for _ in range(self.drop_count))
        if self.grid:
            side = ARENA_SIZE / self.count
            cells = [((column + 0.5) * side, (row + 0.5) * side)
                     for row in range(self.count) for column in range(self.count)]
            bricks.shuffle(cells)  # A random order spreads the first few drops over the arena.
            positions = iter(cells)
        for number, (x, y) in enumerate(positions):
            yield number, seeds.getrandbits(32), (x, y, bricks.uniform(*self.heights))


def table_header(parameters: Parameters, plan: Plan) -> str:
    """Return the table's header comment with the version, the options and the parameters."""
    version = ElementTree.parse(default_path().parents[1] / 'package.xml').findtext('version')
    lines = [f'turtle_brick {version}: sweep {plan.options}',
             'lengths in m, in the world frame; times in s; parameters:']
    for name, value in asdict(parameters).items():
        lines.append(f'  {name}: {list(value) if isinstance(value, tuple) else value}')
    return ''.join(f'# {line}\n' for line in lines)


def format_value(value: object) -> object:
    """Format a table value: floats with six decimal places, and booleans as 0 or 1."""
    if isinstance(value, bool):
        return int(value)
    return f'{value:.6f}' if isinstance(value, float) else value


def summary(drops: Sequence[SimulatedDrop]) -> str:
    """Return lines of text that list the outcomes of the drops and all broken guarantees."""
    guaranteed = [drop for drop in drops if drop.within_guarantee]
    broken = [drop for drop in drops if drop.broken_guarantee]
    lines = [outcome_counts(drops), f'guaranteed catches, {outcome_counts(guaranteed)}',
             f'broken guarantees: {len(broken):,}']
    for drop in broken[:10]:
        lines.append(f'  drop {drop.number}, seed {drop.seed}, {drop.distance:.3f} m from the '
                     f'robot: {drop.broken_guarantee}')
    return '\n'.join(lines)


def drop_to_draw(drops: Sequence[SimulatedDrop]) -> SimulatedDrop:
    """Return the first drop that broke a guarantee, or the catch with the smallest margin."""
    for drop in drops:
        if drop.broken_guarantee:
            return drop
    caught = [drop for drop in drops if drop.result.caught and drop.margin is not None]
    return min(caught, key=lambda drop: drop.margin or 0.0, default=drops[0])


def run(options: argparse.Namespace, parameters: Parameters, plan: Plan) -> list[SimulatedDrop]:
    """Simulate the drops, write the table, and return the finished drops, even after Ctrl-C."""
    drops: list[SimulatedDrop] = []
    begin = monotonic()
    stopped = Event()
    started = takewhile(lambda _: not stopped.is_set(), plan.simulations())

    def stop(*_: object) -> None:
        """Finish the current drops only. A second Ctrl-C stops the program immediately."""
        stopped.set()
        signal.signal(signal.SIGINT, original_handler)

    with open(options.output / TABLE, 'x', encoding='utf-8', newline='') as file:
        file.write(table_header(parameters, plan))
        writer = csv.writer(file, lineterminator='\n')
        # Worker processes inherit this handler, so Ctrl-C does not kill them.
        original_handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
        results = Parallel(None if options.dask else options.workers, return_as='generator')(
            delayed(simulate_drop)(parameters, *simulation, plan.moving) for simulation in started)
        signal.signal(signal.SIGINT, stop)
        print(f'Simulating {plan.drop_count:,} drops; output: {options.output.resolve()}',
              flush=True)
        for drop in tqdm(results, total=plan.drop_count, unit=' drops', disable=None):
            row = drop.row()
            if not drops:
                writer.writerow(row)
            writer.writerow(map(format_value, row.values()))
            file.flush()
            drops.append(drop)
    signal.signal(signal.SIGINT, original_handler)
    print(f'{len(drops):,} of {plan.drop_count:,} drops in {monotonic() - begin:.1f} s\n'
          f'  {options.output / TABLE}', flush=True)
    return drops


def draw(drops: Sequence[SimulatedDrop], parameters: Parameters, directory: Path) -> None:
    """Plot one drop and, unless the robot was moving, a map of the arena."""
    from turtle_brick_tools import plots  # The workers do not need matplotlib.
    drop = drop_to_draw(drops)
    plots.one_drop(trace(parameters, drop), drop, parameters, directory / 'drop.png')
    print(f'  {directory / "drop.png"}')
    if not drop.moving:  # The map shows distances from the arena's center.
        plots.reachability_map(drops, parameters, directory / 'map.png')
        print(f'  {directory / "map.png"}')


def parse(args: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        prog='sweep',
        description='Simulate many drops without ROS, on all cores, and count the outcomes.',
        epilog='Without --moving, each drop starts with the robot at rest in the center of the '
        'arena. The same options produce an identical table. After Ctrl-C, the finished drops '
        'remain in the table and are drawn. Exit status: 0 if every accepted brick was caught and '
        'no brick within the guaranteed distance was refused, otherwise 1; 2 if the sweep failed.')
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument('--drops', type=positive_int, default=2000, metavar='N',
                      help='drop N bricks at random positions in the arena (default: 2000)')
    kind.add_argument('--grid', type=positive_int, metavar='N',
                      help='drop one brick in each cell of an N x N grid')
    parser.add_argument('--moving', action='store_true',
                        help='drop the bricks while the robot drives between random points')
    parser.add_argument('--height', type=float, nargs='+', metavar='Z',
                        help="height (m) of the brick's center at the release, or the minimum "
                        'and the maximum of random heights (default: height of brick_start)')
    parser.add_argument('--seed', type=int, default=1, metavar='N',
                        help='seed for all random numbers (default: 1)')
    parser.add_argument('--workers', type=positive_int, default=cpu_count(), metavar='N',
                        help='number of worker processes (default: number of cores)')
    parser.add_argument('--dask', metavar='ADDRESS',
                        help='run on the workers of a Dask scheduler, such as tcp://host:8786')
    parser.add_argument('--params-file', type=Path, metavar='FILE',
                        help='parameter file (default: config/turtle.yaml of the package)')
    parser.add_argument('--output', type=Path, metavar='DIR',
                        default=Path('sweeps', strftime('%Y%m%d-%H%M%S')),
                        help='directory for the table and figures (default: sweeps/<date>-<time>)')
    parser.add_argument('--no-figures', dest='figures', action='store_false',
                        help='write only the table')
    return parser.parse_args(args)


def make_plan(options: argparse.Namespace, parameters: Parameters) -> Plan:
    """Return the plan for the command-line options, or raise ValueError if a height is invalid."""
    lowest = parameters.brick_size[2] / 2.0
    heights = options.height or [parameters.brick_start[2]]
    if len(heights) > 2 or not lowest <= heights[0] <= heights[-1] < inf:
        raise ValueError(f'--height is {" ".join(map(str, heights))}, but must be one height or '
                         f'a minimum and a maximum, each at least {lowest:g} m')
    return Plan(options.grid is not None, options.grid or options.drops,
                (heights[0], heights[-1]), options.seed, options.moving)


def main(args: Sequence[str] | None = None) -> int:
    """Run a sweep and return the exit status."""
    options = parse(args)
    try:
        parameters = load(options.params_file)
        plan = make_plan(options, parameters)
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
    return 1 if any(drop.broken_guarantee for drop in drops) else 0


if __name__ == '__main__':
    sys.exit(main())
