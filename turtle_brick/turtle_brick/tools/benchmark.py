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

How it is measured, on a machine that has nothing else to do:

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
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import dist
import os
from pathlib import Path
from random import Random
import signal
import sys
from time import monotonic, sleep, time_ns
from typing import Any

import numpy as np
import psutil
from turtle_brick.core.parameters import load
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.physics import STEP_NS
from turtle_brick.ros.tf import BASE_LINK, BRICK
from turtle_brick.tools import plots
from turtle_brick.tools.demo import random_brick
from turtle_brick.tools.simulation import at_least_one
from turtle_referee.graph_client.client import GraphClient
from turtle_referee.graph_client.domains import DomainError, reserved_domain
from turtle_referee.graph_client.drops import DropWatch
from turtle_referee.graph_client.observer import Observer
from turtle_referee.graph_client.processes import Process
from turtle_referee.graph_client.profile import Profile
from turtle_referee.graph_client.record import Record
from turtle_referee.graph_client.spinning import NodeSpinner

LAUNCH = ('ros2', 'launch', 'turtle_brick', 'turtle_arena.launch.py', 'view:=none')

OURS = ('turtle_robot', 'arena', 'catcher')
NODES = (*OURS, 'turtlesim_node', 'robot_state_publisher')  # the programs of the graph

START_TIME = 60.0  # how long (s) they may take to start and to find each other
WARM_UP = 3.0  # how long (s) the graph runs before it is measured
LEAD = 100_000_000  # how long (ns) before a brick is asked to fall its positions are looked at
MOVED = 1e-6  # distance (m) from which a robot counts as having moved


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
    bricks = record.frames[BRICK].published_between(begin, end)
    heights = [sample.pose.position[2] for _, sample in bricks]
    falls = np.flatnonzero(np.diff(heights) < 0.0)
    if not falls.size or falls[0] + 2 >= len(bricks):
        return None
    # A release falls on a step: the last position before the first that is lower.
    release = bricks[falls[0]][1].stamp
    goals = (goal.published for goal in record.messages('goal_pose', release, end))
    moving = (heard.published for heard in record.messages('cmd_vel', release, end)
              if heard.message.linear.x or heard.message.linear.y)
    ends = {
        'seen': bricks[falls[0] + 2][0],
        'decided': next(goals, None),
        'commanded': next(moving, None),
        'moved': first_motion((heard.published, (heard.message.x, heard.message.y))
                              for heard in record.messages('pose', release, end)),
        'known': first_motion((published, sample.pose.position[:2]) for published, sample
                              in record.frames[BASE_LINK].published_between(release, end))}
    if None in ends.values():
        return None
    return {link: (instant - release) * SECONDS_PER_NS for link, instant in ends.items()}


def first_motion(places: Iterable[tuple[int, Any]]) -> int | None:
    """Return when (ns) the first place was published that differs from where the robot was."""
    start = None
    for published, place in places:
        start = place if start is None else start
        if dist(place, start) > MOVED:
            return published
    return None


# ------------------------------------------------------------------------------ what is measured

def programs(launch: psutil.Process) -> dict[str, psutil.Process]:
    """Return the processes of the graph that a launch has started, by the names of NODES."""
    return {Path(word).name: process for process in launch.children(recursive=True)
            for word in process.cmdline()[:2]  # the second one where the first is Python
            if Path(word).name in NODES}


def cores(nodes: dict[str, psutil.Process], action: Callable[[], Any]) -> dict[str, float]:
    """Return how many cores each program uses during an action."""
    def spent() -> dict[str, float]:
        return {name: sum(process.cpu_times()[:2]) for name, process in nodes.items()}

    begin, before = monotonic(), spent()
    action()
    seconds, after = monotonic() - begin, spent()
    return {name: (after[name] - before[name]) / seconds for name in nodes}


def measure(seconds: float, count: int) -> dict[str, Any]:
    """Measure everything in windows (s) and over so many drops; return what was found."""
    parameters, random = load(), Random(1)
    make = partial(Observer, name='benchmark', profile=Profile.from_parameters(parameters))
    drops: list[DropWatch] = []

    def meet(spinner: NodeSpinner) -> GraphClient:
        client = GraphClient(spinner, spinner.node)
        spinner.spin_until(client.is_complete, START_TIME, 'the graph is there')
        return client

    def throw() -> None:
        for _ in range(count):
            # So that the robot has to move and can make it.
            place = random_brick(random, client, parameters, 0.5, 0.9)
            client.place(place).check()
            drops.append(client.drop(place))

    with Process(LAUNCH) as launch:
        with NodeSpinner(make) as spinner:
            meet(spinner)
            spinner.spin_for(WARM_UP)
        nodes = programs(psutil.Process(launch.pid))
        print('idle', file=sys.stderr, flush=True)
        found: dict[str, Any] = {'idle': cores(nodes, lambda: sleep(seconds))}
        with NodeSpinner(make) as spinner:
            client = meet(spinner)
            print('catching', file=sys.stderr, flush=True)
            found['catching'] = cores(nodes, throw)
            print('idle, listening', file=sys.stderr, flush=True)
            begin = time_ns()
            spinner.spin_for(seconds)
            client.observer.update()
            found['intervals'] = intervals(client.record, begin)
            chains = [chain(client.record, drop.begin - LEAD, drop.end) for drop in drops]
    found['latency'] = [links for links in chains if links is not None]
    found['outcomes'] = Counter(
        'caught' if drop.caught else 'refused' if drop.refusals else 'missed' for drop in drops)
    return found


def intervals(record: Record, begin: int) -> dict[str, np.ndarray]:
    """Return the time (s) from each message to the next, from an instant (ns) on."""
    instants = {name: [heard.published for heard in record.messages(name, begin)]
                for name in ('cmd_vel', 'odom', 'joint_states')}
    for label, frame in (('odom -> base_link', BASE_LINK), ('world -> brick', BRICK)):
        # Several steps may come in one message.
        instants[label] = sorted(
            {then for then, _ in record.frames[frame].published_between(begin)})
    return {label: np.diff(published) * SECONDS_PER_NS for label, published in instants.items()}


# -------------------------------------------------------------------------------- how it reports

def report(found: dict[str, Any]) -> str:
    """Make a table for the terminal of what `measure` has found."""
    lines = ['processor time, % of a core      idle  catching']
    for title, names in (*((name, (name,)) for name in NODES),
                         ('the three of ours', OURS), ('all five', NODES)):
        lines.append(f'  {title:26}' + ''.join(
            f'{sum(100.0 * found[window][name] for name in names):{width}.1f}'
            for window, width in (('idle', 9), ('catching', 10))))
    lines += ['', 'intervals, ms        nominal     mean      p01      p50      p99      max']
    for topic, times in found['intervals'].items():
        nominal = STEP_NS * 1e-6 if topic == 'world -> brick' else 10.0
        p01, p50, p99 = 1e3 * np.percentile(times, (1, 50, 99))
        lines.append(f'  {topic:18}{nominal:8.1f}{1e3 * np.mean(times):9.3f}{p01:9.3f}{p50:9.3f}'
                     f'{p99:9.3f}{1e3 * max(times):9.2f}')
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
    parser.add_argument('--seconds', type=float, default=60.0, metavar='T',
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
            found = measure(options.seconds, options.drops)
        print(report(found))
        plots.latency(found['latency'], options.output / 'latency.png')
        print(f'\n{options.output / "latency.png"}')
    except KeyboardInterrupt:
        print('benchmark: stopped, and nothing written', file=sys.stderr)
        return 0
    except (DomainError, OSError, psutil.Error, TimeoutError, ValueError) as error:
        print(f'benchmark: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
