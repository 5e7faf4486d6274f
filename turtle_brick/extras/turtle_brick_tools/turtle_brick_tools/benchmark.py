# SPDX-License-Identifier: Apache-2.0

"""
benchmark: measure processor time, message intervals and reaction times in the live graph.

The machine must be otherwise idle. The results are taken as follows:

* `ros2 launch turtle_brick turtle_arena.launch.py view:=none` runs in a separate ROS domain.
* Processor time is the sum of a process's user and system times, measured in two periods. In the
  idle period, the brick hovers, the robot is at rest, and no client subscribes to fast topics
  (100 Hz or more). In the catching period, a client drops several bricks and records all topics.
* Message intervals are measured in another idle period, with the client connected. An interval is
  the difference between consecutive source timestamps, which the publisher's middleware sets.
* Reaction times are measured from the release of the brick. At the release, the robot is at rest
  at a random distance from the brick and must drive to catch it. The release time is the timestamp
  of the last brick position before the fall. The decision time is the publication time of the
  catcher's goal. The motion time is that of the first turtle pose that shows motion.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
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
from turtle_brick_tools import positive_int
from turtle_brick_tools.demo import random_brick
from turtle_graph.client.client import GraphClient
from turtle_graph.client.domains import DomainError, reserved_domain
from turtle_graph.client.drops import DropWatch
from turtle_graph.client.observer import Observer
from turtle_graph.client.processes import Process
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Record
from turtle_graph.client.spinning import handle_signals, NodeSpinner

LAUNCH = ('ros2', 'launch', 'turtle_brick', 'turtle_arena.launch.py', 'view:=none')

OURS = ('turtle_robot', 'arena', 'catcher')
"""Nodes in this package."""

NODES = (*OURS, 'turtlesim_node', 'robot_state_publisher')
"""All nodes in the graph."""

START_TIMEOUT = 60.0
"""Timeout (s) for starting and discovering the graph."""

WARM_UP_TIME = 3.0
"""Time (s) for which the complete graph runs before the first measurement."""

LEAD_TIME_NS = 100_000_000
"""Time (ns) from the start of the analyzed period to the drop request."""

MOTION_THRESHOLD = 1e-6
"""Maximum change (m) in position that does not count as motion."""


def reaction_times(record: Record, begin: int, end: int) -> dict[str, float] | None:
    """
    Find the delays between the release of the brick and the first motion of the robot.

    :param begin: a time (ns) shortly before the release
    :param end: a time (ns) after the first motion
    :return: the time (s) from the release to the end of each delay in `plots.LINKS`, or None if
        the brick did not fall or the robot did not move
    """
    bricks = record.frames[BRICK].published_between(begin, end)
    heights = [sample.pose.position[2] for _, sample in bricks]
    falls = np.flatnonzero(np.diff(heights) < 0.0)
    if not falls.size or falls[0] + 2 >= len(bricks):
        return None
    # The fall starts at the physics step of the last sample before the height decreases.
    release = bricks[falls[0]][1].stamp
    goals = (goal.published for goal in record.messages('goal_pose', release, end))
    moving = (command.published for command in record.messages('cmd_vel', release, end)
              if command.message.linear.x or command.message.linear.y)
    ends = {
        'seen': bricks[falls[0] + 2][0],
        'decided': next(goals, None),
        'commanded': next(moving, None),
        'moved': first_motion([(pose.published, (pose.message.x, pose.message.y))
                               for pose in record.messages('pose', release, end)]),
        'known': first_motion([(published, sample.pose.position[:2]) for published, sample
                               in record.frames[BASE_LINK].published_between(release, end)])}
    if None in ends.values():
        return None
    return {link: (time - release) * SECONDS_PER_NS for link, time in ends.items()}


def first_motion(positions: Sequence[tuple[int, Any]]) -> int | None:
    """Return the publication time (ns) of the first position that differs from positions[0]."""
    return next((published for published, position in positions
                 if dist(position, positions[0][1]) > MOTION_THRESHOLD), None)


def message_intervals(record: Record, begin: int) -> dict[str, np.ndarray]:
    """Return the intervals (s) between messages published after `begin` (ns), keyed by topic."""
    published = {name: [message.published for message in record.messages(name, begin)]
                 for name in ('cmd_vel', 'odom', 'joint_states')}
    for label, frame in (('odom -> base_link', BASE_LINK), ('world -> brick', BRICK)):
        # A message with the transforms of several physics steps is counted once.
        times = {time for time, _ in record.frames[frame].published_between(begin)}
        published[label] = sorted(times)
    return {label: np.diff(times) * SECONDS_PER_NS for label, times in published.items()}


def graph_processes(launch: psutil.Process) -> dict[str, psutil.Process]:
    """Return the node processes that a launch process started, keyed by executable name."""
    return {Path(word).name: process for process in launch.children(recursive=True)
            for word in process.cmdline()[:2]  # python3 may precede the executable.
            if Path(word).name in NODES}


def processor_usage(nodes: dict[str, psutil.Process],
                    action: Callable[[], Any]) -> dict[str, float]:
    """Return the average number of processor cores that each process uses while `action` runs."""
    def used_times() -> dict[str, float]:
        return {name: sum(process.cpu_times()[:2]) for name, process in nodes.items()}

    begin, before = monotonic(), used_times()
    action()
    duration, after = monotonic() - begin, used_times()
    return {name: (after[name] - before[name]) / duration for name in nodes}


def measure(seconds: float, drop_count: int) -> dict[str, Any]:
    """Measure the graph during two idle periods (`seconds` each) and `drop_count` drops."""
    parameters, random = load(), Random(1)
    make_observer = partial(Observer, name='benchmark',
                            profile=Profile.from_parameters(parameters))
    drops: list[DropWatch] = []

    def connect(spinner: NodeSpinner) -> GraphClient:
        client = GraphClient(spinner, spinner.node)
        spinner.spin_until(lambda: not client.missing(), START_TIMEOUT, 'the graph is complete')
        return client

    def drop_bricks() -> None:
        for _ in range(drop_count):
            # At these distances, the robot must move to catch the brick and has time to do so.
            position = random_brick(random, client, parameters, 0.5, 0.9)
            client.place(position).check()
            drops.append(client.drop(position))

    with Process(LAUNCH) as launch:
        with NodeSpinner(make_observer) as spinner:
            connect(spinner)
            spinner.spin_for(WARM_UP_TIME)  # Do not measure the startup of the graph.
        nodes = graph_processes(psutil.Process(launch.pid))
        print('Measuring the idle graph', file=sys.stderr, flush=True)
        results: dict[str, Any] = {'idle': processor_usage(nodes, lambda: sleep(seconds))}
        with NodeSpinner(make_observer) as spinner:
            client = connect(spinner)
            print(f'Measuring {drop_count} drops', file=sys.stderr, flush=True)
            results['catching'] = processor_usage(nodes, drop_bricks)
            print('Measuring message intervals', file=sys.stderr, flush=True)
            begin = time_ns()
            spinner.spin_for(seconds)
            client.observer.update()
            results['intervals'] = message_intervals(client.record, begin)
            times = [reaction_times(client.record, drop.begin - LEAD_TIME_NS, drop.end)
                     for drop in drops]
    results['latency'] = [delays for delays in times if delays is not None]
    if not results['latency']:
        raise ValueError(f'the robot responded to none of the {drop_count} drops')
    results['outcomes'] = Counter(map(outcome, drops))
    return results


def outcome(drop: DropWatch) -> str:
    """Return 'caught', 'refused' or 'missed' for a drop."""
    if drop.caught:
        return 'caught'
    return 'refused' if drop.refusals else 'missed'


def report(results: dict[str, Any]) -> str:
    """Return the results of `measure` as text tables."""
    lines = ['processor time, % of a core      idle  catching']
    rows = {name: (name,) for name in NODES}
    for title, names in {**rows, 'turtle_brick nodes': OURS, 'all nodes': NODES}.items():
        idle = sum(100.0 * results['idle'][name] for name in names)
        catching = sum(100.0 * results['catching'][name] for name in names)
        lines.append(f'  {title:26}{idle:9.1f}{catching:10.1f}')
    lines += ['', 'intervals, ms        nominal     mean      p01      p50      p99      max']
    for topic, times in results['intervals'].items():
        nominal = STEP_NS * 1e-6 if topic == 'world -> brick' else 10.0
        p01, p50, p99 = 1e3 * np.percentile(times, (1, 50, 99))
        lines.append(f'  {topic:18}{nominal:8.1f}{1e3 * np.mean(times):9.3f}{p01:9.3f}{p50:9.3f}'
                     f'{p99:9.3f}{1e3 * max(times):9.2f}')
    count = len(results['latency'])
    lines += ['', f'time since the release, ms ({count} drops)       p50      p01      p99']
    for link, title in (('decided', 'decision (goal published)'),
                        ('commanded', 'first command to move'),
                        ('moved', 'first motion (pose of turtlesim)'),
                        ('known', 'first motion in TF')):
        p01, p50, p99 = 1e3 * np.percentile([delays[link] for delays in results['latency']],
                                            (1, 50, 99))
        lines.append(f'  {title:38}{p50:9.1f}{p01:9.1f}{p99:9.1f}')
    lines.append('  drops, all within reach: ' + ', '.join(
        f'{count} {outcome}' for outcome, count in sorted(results['outcomes'].items())))
    return '\n'.join(lines)


def main(args: Sequence[str] | None = None) -> int:
    """Run the benchmark and return the exit status."""
    parser = argparse.ArgumentParser(
        prog='benchmark', description='Measure processor time, message intervals and reaction '
        'times in the live graph. The machine must be otherwise idle.')
    parser.add_argument('--seconds', type=float, default=60.0, metavar='T',
                        help='duration of each of the two idle periods (s, default: 60)')
    parser.add_argument('--drops', type=positive_int, default=20, metavar='N',
                        help='number of drops (default: 20)')
    parser.add_argument('--output', type=Path, default=Path('.'), metavar='DIR',
                        help='directory for latency.png (default: current directory)')
    options = parser.parse_args(args)
    from turtle_brick_tools import plots  # Importing matplotlib takes half a second.
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    handle_signals(signal.default_int_handler)
    try:
        options.output.mkdir(parents=True, exist_ok=True)
        with reserved_domain() as domain:
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            results = measure(options.seconds, options.drops)
        print(report(results))
        plots.latency(results['latency'], options.output / 'latency.png')
        print(f'\n{options.output / "latency.png"}')
    except KeyboardInterrupt:
        print('benchmark: interrupted; no file was written', file=sys.stderr)
        return 0
    except (DomainError, OSError, psutil.Error, TimeoutError, ValueError) as error:
        load, cores = os.getloadavg()[0], os.cpu_count() or 1
        cause = (f'. The load of this machine was {load:.1f} with {cores} processors in the last '
                 'minute. Close other programs and try again.') if load > cores else ''
        print(f'benchmark: {error}{cause}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
