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
* Intervals are taken in further windows, with that listener: idle, and beside two busy loops.
  Their instants are those at which the middleware took a message over for publication
  (source_timestamp), not those of its arrival here.
* Drift is counted in steps of the physics: gaps between the stamps of the brick's transforms,
  and what the stamps fall behind the clock of their publication.
* Latency is taken from drops on a robot at rest, each from a random distance that asks for
  motion. The release is the stamp of the last position before the brick falls; the decision is
  the goal's publication; motion is the first pose of turtlesim that has changed.

What other programs use meanwhile is measured too, and said: above a twentieth of a core the
numbers are not worth much. So is what the host of a virtual machine keeps from it: while it does,
everything comes late, and the percentiles show it.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timezone
from functools import partial
from math import cos, hypot, inf, pi, sin
import os
from pathlib import Path
import platform
from random import Random
import signal
import sys
from time import monotonic, sleep, time_ns
from typing import Any, NamedTuple

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

BUSY_LOOPS = 2

OTHERS = 0.05
"""Cores in use by other programs from which on the numbers are worth little."""

MOVED = 1e-6
"""Distance (m) from which a robot counts as having moved."""


# ------------------------------------------------------------------------------ what is computed

def drift(stamps: Sequence[int], published: Sequence[int], period: int) -> tuple[int, float]:
    """
    Compare the stamps of steps with the clock at which they were published.

    :param stamps: the instant that each step belongs to (ns), in the order of publication
    :param published: when it was published (ns)
    :param period: the time of a step (ns)
    :return: How many steps are missing, by count or by clock, and the longest time (s) from a
        stamp to its publication. A publication may be late by some steps, but not later and later:
        the lags of the first and the last second are compared, each by its least, since what
        delays a publication comes and goes.
    """
    lost = np.sum(np.diff(stamps) // period - 1)
    lags = np.subtract(published, stamps)
    second = 1_000_000_000 // period
    behind = round((min(lags[-second:]) - min(lags[:second])) / period)
    return int(abs(lost) + abs(behind)), float(max(lags)) * NANO


class Events(NamedTuple):
    """What was heard from before a brick's release until the robot had moved; first, when (ns)."""

    brick: Sequence[tuple[int, int, float]]
    """When its positions were published, their stamps (ns), and its heights (m)."""
    goals: Sequence[int]
    commands: Sequence[tuple[int, float]]
    """With their speeds (m/s)."""
    poses: Sequence[tuple[int, float, float]]
    """Poses of turtlesim: x and y (m)."""
    transforms: Sequence[tuple[int, float, float]]
    """Transforms of base_link: x and y (m)."""


def chain(events: Events) -> dict[str, float] | None:
    """
    Find the links of the chain from a brick's release to the robot's motion.

    :param events: what was heard
    :return: The time (s) from the release to the end of each link: the third sample of the fall,
        the goal, the first command to move, the first pose that has moved, and the first transform
        (`plots.LINKS`); None where the brick did not fall or the robot did not move.
    """
    heights = np.array([z for _, _, z in events.brick])
    falls = np.flatnonzero(np.diff(heights) < 0.0)
    if not len(falls) or falls[0] + 2 >= len(heights):
        return None
    # A release falls on a step: the last position before the first that is lower.
    release = events.brick[falls[0]][1]
    ends = {
        'seen': events.brick[falls[0] + 2][0],
        'decided': next((then for then in events.goals if then >= release), None),
        'commanded': next((then for then, speed in events.commands
                           if then >= release and speed > 0.0), None),
        'moved': first_motion(events.poses, release),
        'known': first_motion(events.transforms, release)}
    if None in ends.values():
        return None
    return {link: (end - release) * NANO for link, end in ends.items() if end is not None}


def first_motion(places: Sequence[tuple[int, float, float]], since: int) -> int | None:
    """Return when (ns) the first place was published that differs from the one before."""
    for (_, x_before, y_before), (published, x, y) in zip(places, places[1:]):
        if published >= since and hypot(x - x_before, y - y_before) > MOVED:
            return published
    return None


def events(record: Record, begin: int, end: int) -> Events:
    """Return what was heard in a stretch of time (ns)."""
    return Events(
        brick=[(published, sample.stamp, sample.pose.position[2])
               for published, sample in record.frames[BRICK].heard(begin, end)],
        goals=[heard.published for heard in record.heard('goal_pose', begin, end)],
        commands=[(heard.published, hypot(heard.message.linear.x, heard.message.linear.y))
                  for heard in record.heard('cmd_vel', begin, end)],
        poses=[(heard.published, heard.message.x, heard.message.y)
               for heard in record.heard('pose', begin, end)],
        transforms=[(published, *sample.pose.position[:2])
                    for published, sample in record.frames[BASE_LINK].heard(begin, end)])


# ------------------------------------------------------------------------------ what is measured

class Usage:
    """What processes, and all other programs, use from now on."""

    def __init__(self, nodes: dict[str, psutil.Process]) -> None:
        """Begin."""
        self._nodes = nodes
        self._before = self._now()

    def _now(self) -> dict[str, float]:
        """Return the time (s) since any fixed instant that each has had of the processors."""
        own = psutil.Process().cpu_times()
        spent = psutil.cpu_times()
        # What is not idle works: a tickless Linux sees programs that wake up with its timers
        # always or never, but books idle time as it is.
        busy = (psutil.cpu_count() * monotonic() - spent.idle - getattr(spent, 'iowait', 0.0)
                - getattr(spent, 'steal', 0.0))
        return {'': monotonic(), 'all': busy, 'host': getattr(spent, 'steal', 0.0),
                'benchmark': own.user + own.system,
                **{name: sum(node.cpu_times()[:2]) for name, node in self._nodes.items()}}

    def cores(self) -> dict[str, float]:
        """Return how many cores each has used; 'others' are all programs but these."""
        used = {name: then - self._before[name] for name, then in self._now().items()}
        seconds = used.pop('')
        cores = {name: time / seconds for name, time in used.items()}
        ours = sum(cores[name] for name in ('benchmark', *self._nodes))
        cores['others'] = max(cores.pop('all') - ours, 0.0)
        return cores


class Benchmark:
    """The measurements, one after another."""

    def __init__(self, options: argparse.Namespace, parameters: Parameters) -> None:
        """
        Measure nothing yet.

        :param options: of the command line
        :param parameters: the physical numbers
        """
        self.seconds: float = options.seconds
        self.drops: int = options.drops
        self.parameters = parameters
        self.random = Random(1)
        self.outcomes: Counter[str] = Counter()

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
                window('catching', lambda: self.catch(hands))
                found['memory'] = {name: node.memory_info().rss for name, node in nodes.items()}
                found['intervals'] = window('idle, listening', lambda: self.listen(hands))
                loops = [Process([sys.executable, '-c', 'while True: pass'])
                         for _ in range(BUSY_LOOPS)]
                try:
                    found['intervals beside loops'] = window(
                        'beside two busy loops, listening', lambda: self.listen(hands))
                finally:
                    for loop in loops:
                        loop.kill()
                found['latency'] = window(
                    f'{self.drops} drops', lambda: self.measure_latency(hands))
        found['outcomes'] = self.outcomes
        return found

    def catch(self, hands: Hands) -> None:
        """Drop one brick after another over a window."""
        end = monotonic() + self.seconds
        while monotonic() < end:
            self.throw(hands)

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
        self.outcomes['caught' if drop.caught else 'refused' if drop.refusals else 'missed'] += 1
        return drop

    def listen(self, hands: Hands) -> dict[str, Any]:
        """Return all intervals (s) over a window, and the drift of the physics."""
        begin = time_ns()
        hands.graph.spin_for(self.seconds)
        hands.observer.update()
        record = hands.record
        instants = {name: [heard.published for heard in record.heard(name, begin)]
                    for name in ('cmd_vel', 'odom', 'joint_states')}
        for label, frame in (('odom -> base_link', BASE_LINK), ('world -> brick', BRICK)):
            # Several steps may come in one message.
            instants[label] = sorted({then for then, _ in record.frames[frame].heard(begin)})
        steps = record.frames[BRICK].heard(begin)
        return {'steps': len(steps),
                'drift': drift([sample.stamp for _, sample in steps],
                               [published for published, _ in steps], STEP),
                **{label: np.diff(published) * NANO for label, published in instants.items()}}

    def measure_latency(self, hands: Hands) -> list[dict[str, float]]:
        """Return the chain of each of some drops."""
        chains = []
        for _ in range(self.drops):
            drop = self.throw(hands)
            links = chain(events(hands.record, drop.begin - LEAD, drop.end))
            if links is not None:
                chains.append(links)
        if not chains:
            raise RuntimeError('no drop was heard from its release to the first motion')
        return chains


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


# ----------------------------------------------------------------------------- what is reported

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
    idle, catching, memory = found['idle'], found['catching'], found['memory']
    others = max(idle['others'], catching['others'])
    lines = [
        f'{seconds:g} s per window; other programs used {others:.2f} cores at most' + (
            ': TOO MUCH for numbers that are worth something' if others > OTHERS else ''),
        f'the host of this virtual machine kept {max(idle["host"], catching["host"]):.3f} cores '
        'for itself', '',
        'processor time, % of a core      idle  catching    memory']
    for title, names in (*((name, (name,)) for name in NODES),
                         ('the three of ours', OURS), ('all five', NODES)):
        lines.append(f'  {title:26}{sum(100.0 * idle[name] for name in names):9.1f}'
                     f'{sum(100.0 * catching[name] for name in names):10.1f}'
                     f'{sum(memory[name] for name in names) / 2 ** 20:7.0f} MB')
    lines += ['', 'intervals, ms        nominal     mean      p01      p50      p99      max'
              '   beside two busy loops: p99      max']
    quiet, busy = found['intervals'], found['intervals beside loops']
    for topic in ('cmd_vel', 'odom', 'joint_states', 'odom -> base_link', 'world -> brick'):
        nominal = STEP * 1e-6 if topic == 'world -> brick' else 10.0
        p01, p50, p99 = 1e3 * np.percentile(quiet[topic], (1, 50, 99))
        lines.append(
            f'  {topic:18}{nominal:8.1f}{1e3 * np.mean(quiet[topic]):9.3f}{p01:9.3f}{p50:9.3f}'
            f'{p99:9.3f}{1e3 * max(quiet[topic]):9.2f}'
            f'{1e3 * np.percentile(busy[topic], 99):29.3f}{1e3 * max(busy[topic]):9.2f}')
    (lost, latest), (lost_busy, latest_busy) = quiet['drift'], busy['drift']
    lines.append(f'  drift of the physics: {lost} steps of {quiet["steps"]:,} (published at most '
                 f'{1e3 * latest:.1f} ms late), beside two busy loops {lost_busy} of '
                 f'{busy["steps"]:,} ({1e3 * latest_busy:.1f} ms)')
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


def parse(args: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line; what is wrong with it ends the process with a sentence."""
    first, rest = __doc__.strip().split('\n\n', 1)
    parser = argparse.ArgumentParser(
        prog='benchmark', description=first.partition(': ')[2].capitalize(), epilog=rest,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=60.0, metavar='T',
                        help='length of each window (s, default: 60); there are four')
    parser.add_argument('--drops', type=int, default=20, metavar='N',
                        help='drops for the latency (default: 20)')
    parser.add_argument('--output', type=Path, default=Path('.'), metavar='DIR',
                        help='where latency.png goes (default: here)')
    options = parser.parse_args(args)
    if not 1.0 <= options.seconds < inf:
        parser.error(f'--seconds {options.seconds:g}: at least 1')
    if options.drops < 1:
        parser.error(f'--drops {options.drops}: at least 1')
    if options.output.exists() and not options.output.is_dir():
        parser.error(f'--output {options.output}: this is not a directory')
    return options


def main(args: Sequence[str] | None = None) -> int:
    """Run the benchmark; return its exit status."""
    options = parse(args)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with reserved_domain() as domain:
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            found = Benchmark(options, load()).run()
        print(machine())
        print(report(found, options.seconds))
        options.output.mkdir(parents=True, exist_ok=True)
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
