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
benchmark: measure what the live graph costs, how regular it is and how quickly it reacts.

How it is measured:

* `ros2 launch turtle_brick turtle_arena.launch.py view:=none` runs in a ROS domain of its own.
* Processor time is the user and system time of each process over a window: "idle", the brick
  hovering and the robot at rest, while nobody else listens to what comes 100 or 250 times per
  second; and "catching", one drop after another, with one listener more, which drops them.
* Intervals are taken in a further idle window, with that listener. Their instants are those at
  which the middleware took a message over for publication (source_timestamp), not those of its
  arrival here.
* Latency is taken from the drops: each finds the robot at rest, at a random distance that asks
  for motion. The release is the stamp of the last position before the brick falls; the decision
  is the goal's publication; motion is the first pose of turtlesim that has changed.

What other programs use meanwhile is measured too, and said: above a twentieth of a core the
numbers are not worth much.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timezone
from functools import partial
from math import cos, dist, pi, sin
import os
from pathlib import Path
import platform
from random import Random
import signal
import sys
from time import monotonic, sleep, time_ns
from typing import Any

import numpy as np
import psutil
from rclpy.utilities import get_rmw_implementation_identifier
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import load, ParameterError, Parameters
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.core.time_steps import NANO
from turtle_brick.physics import STEP
from turtle_brick.ros.tf import BASE_LINK, BRICK
from turtle_brick.tools import plots
from turtle_brick.tools.drops import at_least_one
from turtle_referee.domains import DomainError, reserved_domain
from turtle_referee.drops import DropWatch
from turtle_referee.hands import Hands
from turtle_referee.names import Profile
from turtle_referee.observer import Observer
from turtle_referee.processes import Process
from turtle_referee.record import Record
from turtle_referee.spinning import Spinner

LAUNCH = ('ros2', 'launch', 'turtle_brick', 'turtle_arena.launch.py', 'view:=none')

OURS = ('turtle_robot', 'arena', 'catcher')
NODES = (*OURS, 'turtlesim_node', 'robot_state_publisher')
"""The programs of the graph."""

START_TIME = 60.0
"""How long (s) they may take to start and to find each other."""

WARM_UP = 3.0
"""How long (s) the graph runs before it is measured."""

LEAD = 100_000_000
"""How long (ns) before a brick is asked to fall its positions are looked at."""

OTHERS = 0.05
"""Cores in use by other programs from which on the numbers are worth little."""

MOVED = 1e-6
"""Distance (m) from which a robot counts as having moved."""


# ------------------------------------------------------------------------------ what is computed

def chain(record: Record, begin: int, end: int) -> dict[str, float] | None:
    """
    Find the links of the chain from a brick's release to the robot's motion.

    :param record: what was heard
    :param begin: an instant (ns) shortly before the release
    :param end: one after the first motion
    :return: The time (s) from the release to the end of each link: the third sample of the fall,
        the goal, the first command to move, the first pose that has moved, and the first transform
        (`plots.LINKS`); None where the brick did not fall or the robot did not move.
    """
    bricks = record.frames[BRICK].heard(begin, end)
    heights = [sample.pose.position[2] for _, sample in bricks]
    falls = np.flatnonzero(np.diff(heights) < 0.0)
    if not falls.size or falls[0] + 2 >= len(bricks):
        return None
    # A release falls on a step: the last position before the first that is lower.
    release = bricks[falls[0]][1].stamp
    goals = (goal.published for goal in record.heard('goal_pose', release, end))
    moving = (heard.published for heard in record.heard('cmd_vel', release, end)
              if heard.message.linear.x or heard.message.linear.y)
    ends = {
        'seen': bricks[falls[0] + 2][0],
        'decided': next(goals, None),
        'commanded': next(moving, None),
        'moved': first_motion((heard.published, (heard.message.x, heard.message.y))
                              for heard in record.heard('pose', release, end)),
        'known': first_motion((published, sample.pose.position[:2]) for published, sample
                              in record.frames[BASE_LINK].heard(release, end))}
    if None in ends.values():
        return None
    return {link: (instant - release) * NANO for link, instant in ends.items()}


def first_motion(places: Iterable[tuple[int, Any]]) -> int | None:
    """Return when (ns) the first place was published that differs from where the robot was."""
    start = None
    for published, place in places:
        start = place if start is None else start
        if dist(place, start) > MOVED:
            return published
    return None


# ------------------------------------------------------------------------------ what is measured

class Usage:
    """What processes, and all other programs, use from now on."""

    def __init__(self, nodes: dict[str, psutil.Process]) -> None:
        """Begin."""
        self._processes = {'benchmark': psutil.Process(), **nodes}
        self._before = self._now()

    def _now(self) -> dict[str, float]:
        """Return the time (s) since any fixed instant that each has had of the processors."""
        # What neither idles nor waits for a disk works: a tickless Linux sees programs that wake
        # up with its timers always or never, but books idle time as it is.
        spent = psutil.cpu_times()
        return {'': monotonic(),
                'all': psutil.cpu_count() * monotonic() - spent.idle - spent.iowait,
                **{name: sum(process.cpu_times()[:2])
                   for name, process in self._processes.items()}}

    def cores(self) -> dict[str, float]:
        """Return how many cores each has used; 'others' are all programs but these."""
        used = {name: then - self._before[name] for name, then in self._now().items()}
        seconds = used.pop('')
        cores = {name: time / seconds for name, time in used.items()}
        cores['others'] = max(cores.pop('all') - sum(cores[name] for name in self._processes), 0.0)
        return cores


class Benchmark:
    """The measurements, one after another."""

    def __init__(self, options: argparse.Namespace, parameters: Parameters) -> None:
        """Measure nothing yet, but know the command line and the physical numbers."""
        self.seconds: float = options.seconds
        self.drops: int = options.drops
        self.parameters = parameters
        self.random = Random(1)

    @contextmanager
    def observing(self) -> Iterator[Hands]:
        """Hear the graph, and be heard by it, for a while."""
        make = partial(Observer, name='benchmark',
                       profile=Profile.from_parameters(self.parameters))
        with Spinner(make) as spinner:
            hands = Hands(spinner, spinner.node)
            spinner.spin_until(hands.sees_everything, START_TIME, 'the graph is there')
            yield hands

    def run(self) -> dict[str, Any]:
        """Measure everything; return what was found."""
        found: dict[str, Any] = {}
        with Process(LAUNCH) as launch:
            with self.observing() as hands:
                hands.graph.spin_for(WARM_UP)
            nodes = programs(psutil.Process(launch.pid))

            def window(what: str, action: Callable[[], Any]) -> Any:
                print(what, file=sys.stderr, flush=True)
                usage = Usage(nodes)
                result = action()
                if not launch.running:
                    raise RuntimeError(launch.end_in_words())
                found[what] = usage.cores()
                return result

            window('idle', lambda: sleep(self.seconds))
            with self.observing() as hands:
                drops = window('catching', lambda: [self.throw(hands) for _ in range(self.drops)])
                found['intervals'] = window('idle, listening', lambda: self.listen(hands))
                chains = [chain(hands.record, drop.begin - LEAD, drop.end) for drop in drops]
        found['latency'] = [links for links in chains if links is not None]
        if not found['latency']:
            raise RuntimeError('no drop was heard from its release to the first motion')
        found['outcomes'] = Counter(
            'caught' if drop.caught else 'refused' if drop.refusals else 'missed'
            for drop in drops)
        return found

    def throw(self, hands: Hands) -> DropWatch:
        """
        Place a brick where it can be caught, drop it and wait until all is over.

        :raises ValueError: a service has refused
        :raises TimeoutError: a service did not answer
        """
        z = self.parameters.brick_start[2]
        # So that the robot has to move and can make it.
        distance = self.random.uniform(0.5, 0.9) * guaranteed_distance(z, self.parameters)
        angle = self.random.uniform(-pi, pi)
        place = (CENTER[0] + distance * cos(angle), CENTER[1] + distance * sin(angle), z)
        hands.place(place).check()
        drop = hands.drop(place)
        assert drop.ask is not None
        drop.ask.check()
        return drop

    def listen(self, hands: Hands) -> dict[str, np.ndarray]:
        """Return all intervals (s) over a window."""
        begin = time_ns()
        hands.graph.spin_for(self.seconds)
        hands.observer.update()
        record = hands.record
        instants = {name: [heard.published for heard in record.heard(name, begin)]
                    for name in ('cmd_vel', 'odom', 'joint_states')}
        for label, frame in (('odom -> base_link', BASE_LINK), ('world -> brick', BRICK)):
            # Several steps may come in one message.
            instants[label] = sorted({then for then, _ in record.frames[frame].heard(begin)})
        return {label: np.diff(published) * NANO for label, published in instants.items()}


def programs(launch: psutil.Process) -> dict[str, psutil.Process]:
    """Return the processes of the graph that a launch has started, by the names of NODES."""
    found = {}
    for process in launch.children(recursive=True):
        for word in process.cmdline()[:2]:  # the second one where the first is Python
            if Path(word).name in NODES:
                found[Path(word).name] = process
    if missing := set(NODES) - set(found):
        raise RuntimeError(f'launch has not started {", ".join(sorted(missing))}')
    return found


# -------------------------------------------------------------------------------- how it reports

def machine() -> str:
    """Say what the numbers were measured on and with."""
    model = next((line.partition(':')[2] for line in Path('/proc/cpuinfo').read_text().splitlines()
                  if line.startswith('model name')), 'an unknown processor')
    return (f'{len(os.sched_getaffinity(0))} cores of {" ".join(model.split())}, '
            f'Python {platform.python_version()}, {get_rmw_implementation_identifier()}, '
            f'{datetime.now(timezone.utc):%Y-%m-%d %H:%M UTC}')


def report(found: dict[str, Any], seconds: float) -> str:
    """
    Make a table of what was found.

    :param found: by `Benchmark.run`
    :param seconds: the length of a window
    :return: The text for the terminal.
    """
    idle, catching = found['idle'], found['catching']
    others = max(idle['others'], catching['others'])
    lines = [
        f'{seconds:g} s per window; other programs used {others:.2f} cores at most' + (
            ': TOO MUCH for numbers that are worth something' if others > OTHERS else ''), '',
        'processor time, % of a core      idle  catching']
    for title, names in (*((name, (name,)) for name in NODES),
                         ('the three of ours', OURS), ('all five', NODES)):
        lines.append(f'  {title:26}' + ''.join(
            f'{sum(100.0 * cores[name] for name in names):{width}.1f}'
            for cores, width in ((idle, 9), (catching, 10))))
    lines += ['', 'intervals, ms        nominal     mean      p01      p50      p99      max']
    for topic, intervals in found['intervals'].items():
        nominal = STEP * 1e-6 if topic == 'world -> brick' else 10.0
        p01, p50, p99 = 1e3 * np.percentile(intervals, (1, 50, 99))
        lines.append(
            f'  {topic:18}{nominal:8.1f}{1e3 * np.mean(intervals):9.3f}{p01:9.3f}{p50:9.3f}'
            f'{p99:9.3f}{1e3 * max(intervals):9.2f}')
    lines += ['', f'latency from the release, ms ({len(found["latency"])} drops)     p50      p01'
              '      p99']
    for link, words in (('decided', 'decision (goal published)'),
                        ('commanded', 'first command to move'),
                        ('moved', 'first motion (pose of turtlesim)'),
                        ('known', 'first motion in TF')):
        p01, p50, p99 = 1e3 * np.percentile([links[link] for links in found['latency']],
                                            (1, 50, 99))
        lines.append(f'  {words:38}{p50:9.1f}{p01:9.1f}{p99:9.1f}')
    lines.append('  drops, all within reach: ' + ', '.join(
        f'{count} {outcome}' for outcome, count in sorted(found['outcomes'].items())))
    return '\n'.join(lines)


def main(args: Sequence[str] | None = None) -> int:
    """Run the benchmark; return its exit status."""
    first, rest = __doc__.strip().split('\n\n', 1)
    parser = argparse.ArgumentParser(
        prog='benchmark', description=first.partition(': ')[2].capitalize(), epilog=rest,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=at_least_one, default=60, metavar='T',
                        help='length of a window (s, default: 60); there are two, and the drops')
    parser.add_argument('--drops', type=at_least_one, default=20, metavar='N',
                        help='how many bricks are dropped (default: 20)')
    parser.add_argument('--output', type=Path, default=Path('.'), metavar='DIR',
                        help='where latency.png goes (default: here)')
    options = parser.parse_args(args)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        options.output.mkdir(parents=True, exist_ok=True)
        with reserved_domain() as domain:
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            found = Benchmark(options, load()).run()
        print(machine())
        print(report(found, options.seconds))
        plots.latency(found['latency'], options.output / 'latency.png')
        print(f'\n{options.output / "latency.png"}')
    except KeyboardInterrupt:
        print('benchmark: stopped, and nothing written', file=sys.stderr)
        return 0
    except (DomainError, OSError, ParameterError, psutil.Error, RuntimeError, TimeoutError,
            ValueError) as error:
        print(f'benchmark: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
