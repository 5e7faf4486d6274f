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

Every drop begins with the robot at rest in the center of the arena, in a simulation of its own
(`turtle_brick.tools.simulation`); with --chain, several drops follow one another in one simulation.
The output is a table, drops.csv, with one row per drop, and figures: the map of the arena, the
margins against the distance, and one drop in detail. The table depends on the options alone,
not on the number of workers: the same options give the same file, byte for byte.

Ctrl-C keeps the drops so far: they are in the table, and the figures show them.

The status is 0 if both promises were kept in every drop: what was said to be reachable was
caught, and nothing within the guaranteed distance was refused. It is 1 if not, and 2 if the sweep
failed.
"""

import argparse
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from importlib.util import find_spec
from math import isfinite
import multiprocessing
from multiprocessing import resource_tracker
import os
from pathlib import Path
import signal
import sys
from threading import Thread
from time import monotonic, process_time, strftime
from types import FrameType
from typing import Any, NamedTuple

from turtle_brick.core.parameters import load, ParameterError, Parameters
from turtle_brick.tools.simulation import Delays
from turtle_brick.tools.sweeping import (Chain, Drop, is_good, make, most_telling, Plan, summary,
                                         Table, trace)

TABLE = 'drops.csv'

BATCH = 8
"""Simulations that a worker runs at a time: about a tenth of a second."""

AHEAD = 3
"""Batches per worker that are queued ahead."""


class Batch(NamedTuple):
    """The result of a worker's job."""

    drops: list[Drop]
    simulated: float
    """Simulated time (s)."""
    cost: float
    """Processor time (s)."""


def work(parameters: Parameters, chains: Sequence[Chain], delays: Delays) -> Batch:
    """
    Run some simulations in a worker.

    :param parameters: The physical numbers.
    :param chains: The simulations.
    :param delays: The delays between their parts.
    :return: The drops in order, with their cost.
    """
    begin = process_time()
    drops: list[Drop] = []
    simulated = 0.0
    for chain in chains:
        more, time = make(parameters, chain, delays)
        drops += more
        simulated += time
    return Batch(drops, simulated, process_time() - begin)


class Stop:
    """Counts Ctrl-C and SIGTERM, so that work under way is finished but no more begun."""

    SIGNALS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        """Change no signal handler yet: `with` does."""
        self.count = 0
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> 'Stop':
        """Replace the signal handlers."""
        self._before = {
            number: signal.signal(number, self._on_signal) for number in self.SIGNALS}
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the signal handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self.count += 1

    def __bool__(self) -> bool:
        """Tell whether a signal has come."""
        return self.count > 0


def _begin_worker() -> None:
    """Ignore signals, which the first process handles, and end when that process has ended."""
    for number in Stop.SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, Stop.SIGNALS)

    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    Thread(target=follow, daemon=True).start()


def batches(parameters: Parameters, plan: Plan, workers: int,
            stop: Callable[[], bool]) -> Iterator[Batch]:
    """
    Run the drops of a plan in several processes.

    :param parameters: The physical numbers.
    :param plan: The drops.
    :param workers: The number of processes; 1 is this one.
    :param stop: Polled; once it returns True, no more is begun.
    :return: The results, in the order of the plan: all of them, or those that were begun before
        the stop.
    :raises BrokenProcessPool: A worker was killed.
    """
    jobs = _in_parts(plan.chains(), max(BATCH // plan.chain, 1))
    if workers == 1:
        for chains in jobs:
            if stop():
                return
            yield work(parameters, chains, plan.delays)
        return
    # Started first: it would unblock the signals that are blocked below.
    resource_tracker.ensure_running()
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context('spawn'), _begin_worker)
    pending: deque[Future] = deque()
    try:
        while True:
            while len(pending) < workers * AHEAD and not stop():
                job = next(jobs, None)
                if job is None:
                    break
                # A worker must not see a signal before it ignores them.
                before = signal.pthread_sigmask(signal.SIG_BLOCK, Stop.SIGNALS)
                try:
                    pending.append(pool.submit(work, parameters, job, plan.delays))
                finally:
                    signal.pthread_sigmask(signal.SIG_SETMASK, before)
            if stop():
                # Batches begin in order, so the results have no gap.
                while pending and pending[-1].cancel():
                    pending.pop()
            if not pending:
                return
            yield pending.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)


def _in_parts(chains: Iterable[Chain], size: int) -> Iterator[list[Chain]]:
    """Split into lists of a size; the last may be shorter."""
    part: list[Chain] = []
    for chain in chains:
        part.append(chain)
        if len(part) == size:
            yield part
            part = []
    if part:
        yield part


def draw(drops: Sequence[Drop], parameters: Parameters, plan: Plan, directory: Path,
         stop: Callable[[], bool]) -> None:
    """
    Draw the figures.

    :param drops: The results.
    :param parameters: The physical numbers.
    :param plan: The drops that were planned.
    :param directory: The directory of the files.
    :param stop: Polled between figures; once it returns True, the rest is left out.
    """
    if not drops:
        print('No figures: no drop was finished.')
        return
    if find_spec('matplotlib') is None:
        print('No figures: they need matplotlib (apt: python3-matplotlib, pip: matplotlib).')
        return
    from turtle_brick.tools import plots
    chosen = most_telling(drops)
    chain = next(chain for chain in plan.chains() if chain.first == chosen.index - chosen.turn)
    for name, make_figure in (
            ('map.png', lambda path: plots.reachability_map(
                drops, parameters, plan.cell, path)),
            ('margin.png', lambda path: plots.margins(drops, parameters, path)),
            ('drop.png', lambda path: plots.one_drop(
                trace(parameters, chain, chosen.turn, plan.delays), chosen, parameters, path))):
        if stop():
            print('The remaining figures were left out.')
            return
        make_figure(directory / name)
        print(f'  {directory / name}')


class Progress:
    """A progress bar, on a terminal only."""

    def __init__(self, total: int) -> None:
        """
        Show an empty bar.

        :param total: The number of drops.
        """
        self._bar = None
        if sys.stdout.isatty() and find_spec('tqdm') is not None:
            from tqdm import tqdm
            self._bar = tqdm(total=total, unit=' drops', file=sys.stdout, smoothing=0.1,
                             dynamic_ncols=True)

    def add(self, drops: Sequence[Drop]) -> None:
        """Advance by some drops."""
        if self._bar is not None:
            self._bar.update(len(drops))

    def end(self) -> None:
        """Close the bar."""
        if self._bar is not None:
            self._bar.close()


def at_least(least: int) -> Callable[[str], int]:
    """Return the argparse type of an integer with a lower bound."""
    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f'{text!r} is not a whole number') from None
        if value < least:
            raise argparse.ArgumentTypeError(f'{value} is too small: at least {least}')
        return value
    return read


def parse(args: Sequence[str] | None) -> tuple[argparse.Namespace, Parameters, Plan]:
    """
    Read the command line; a mistake in it ends the process with status 2 and a sentence.

    :param args: The arguments; those of the process if None.
    :return: The options, the parameters and the plan.
    """
    first, second = __doc__.strip().split('\n\n')[:2]
    parser = argparse.ArgumentParser(
        prog='sweep', description=first.partition(': ')[2].capitalize(), epilog=second)
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument('--drops', type=at_least(1), default=2000, metavar='N',
                      help='drop N bricks at random places of the arena (default: 2000)')
    kind.add_argument('--grid', type=at_least(1), metavar='N',
                      help='drop a brick in each of the N x N cells of the arena instead')
    parser.add_argument('--height', type=float, nargs='+', metavar='Z',
                        help="height of the brick's center at the release (m): one number, or the "
                        'range of random heights (default: that of brick_start)')
    parser.add_argument('--seed', type=int, default=1, metavar='N',
                        help='seed of all random numbers (default: 1)')
    parser.add_argument('--chain', type=at_least(1), default=1, metavar='N',
                        help='drops that follow one another in one simulation (default: 1)')
    parser.add_argument('--no-jitter', dest='jitter', action='store_false',
                        help='run all timers without jitter')
    parser.add_argument('--workers', type=at_least(1), metavar='N',
                        help='processes (default: one for each core)')
    parser.add_argument('--params-file', type=Path, metavar='FILE',
                        help='the parameters (default: config/turtle.yaml of the package)')
    parser.add_argument('--output', type=Path, metavar='DIR',
                        help='where the table and the figures go (default: sweeps/<date>-<time>)')
    parser.add_argument('--no-figures', dest='figures', action='store_false',
                        help='make the table only')
    options = parser.parse_args(args)
    try:
        parameters = load(options.params_file)
    except ParameterError as error:
        parser.error(str(error))
    heights = options.height or [parameters.brick_start[2]]
    lowest = parameters.brick_size[2] / 2.0
    if len(heights) > 2:
        parser.error(f'--height takes one or two numbers, not {len(heights)}')
    for height in heights:
        if not isfinite(height) or height < lowest:
            parser.error(f'--height {height:g} cannot be: the center of a brick that lies on the '
                         f'ground is at {lowest:g} m')
    if heights[0] > heights[-1]:
        parser.error(f'--height {heights[0]:g} {heights[-1]:g}: the lowest comes first')
    plan = Plan(grid=options.grid is not None, count=options.grid or options.drops,
                heights=(heights[0], heights[-1]), seed=options.seed, chain=options.chain,
                jitter=options.jitter)
    options.output = options.output or Path('sweeps', strftime('%Y%m%d-%H%M%S'))
    if options.output.exists() and not options.output.is_dir():
        parser.error(f'--output {options.output}: this is not a directory')
    if (options.output / TABLE).exists():
        parser.error(f'--output {options.output}: there is a {TABLE} already, which stays')
    options.workers = min(options.workers or len(os.sched_getaffinity(0)), plan.drops)
    return options, parameters, plan


def main(args: Sequence[str] | None = None) -> int:
    """Run the sweep; return its exit status."""
    with Stop() as stop:
        options, parameters, plan = parse(args)
        try:
            return run(options, parameters, plan, stop)
        except OSError as error:
            print(f'sweep: {error}', file=sys.stderr)
            return 2


def run(options: argparse.Namespace, parameters: Parameters, plan: Plan, stop: Stop) -> int:
    """
    Run, write, draw and count the drops.

    :param options: The command line.
    :param parameters: The physical numbers.
    :param plan: The drops.
    :param stop: True once a signal has come.
    :return: The exit status.
    :raises OSError: The table or a figure cannot be written.
    """
    options.output.mkdir(parents=True, exist_ok=True)
    print(f'{plan.drops:,} drops, into {options.output.resolve()}', flush=True)
    drops: list[Drop] = []
    simulated = cost = 0.0
    begin = monotonic()
    failure = ''
    with open(options.output / TABLE, 'x', encoding='utf-8', newline='') as file:
        table = Table(file, parameters, plan)
        progress = Progress(plan.drops)
        try:
            for batch in batches(parameters, plan, options.workers, lambda: bool(stop)):
                table.write(batch.drops)
                drops += batch.drops
                simulated += batch.simulated
                cost += batch.cost
                progress.add(batch.drops)
        except BrokenProcessPool:
            failure = 'a worker was killed'
        progress.end()
    took = monotonic() - begin
    if stop and len(drops) < plan.drops:
        print(f'Stopped: {len(drops):,} of {plan.drops:,} drops are done, and kept.')
    workers = f'{options.workers} worker{"s" if options.workers > 1 else ""}'
    print(f'{len(drops):,} drops in {took:.1f} s with {workers}', end='')
    print(f', {len(drops) / cost:.0f} drops and {simulated / cost:.0f} s simulated in a '
          'second of a core' if cost else '')
    print(f'  {options.output / TABLE}', flush=True)
    if options.figures:
        asked_before = stop.count
        draw(drops, parameters, plan, options.output, lambda: stop.count > asked_before)
    print()
    print(summary(drops))
    for drop in [drop for drop in drops if drop.broken][:10]:
        print(f'  drop {drop.index} (seed {drop.seed}), {drop.distance:.3f} m away: {drop.broken}')
    if failure:
        print(f'sweep: {failure}', file=sys.stderr)
        return 2
    return 0 if is_good(drops) else 1


if __name__ == '__main__':
    sys.exit(main())
