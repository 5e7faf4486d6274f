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
demo: the whole graph in one process, and bricks that are dropped into it.

Without arguments two bricks are placed and dropped, one that can be caught and one that can't.
What happens is told by the nodes, in their log. With --arenas N this goes on in N arenas at the
same time, each in a process and a namespace of its own.

The status is 0 only if everything went as it should: what was said to be reachable was caught and
tipped off, and what can be caught in time was not called Unreachable.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from gc import freeze
from math import cos, inf, pi, sin
import os
from random import Random
import re
import signal
import subprocess
import sys
import webbrowser

from ament_index_python.packages import PackageNotFoundError
from rclpy.node import Node
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import load, ParameterError, Parameters
from turtle_brick.core.reachability import COMMAND_LATENCY, guaranteed_distance, resting_height
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE, within_arena
from turtle_brick.tools.graph import Graph
from turtle_brick.tools.simulation import at_least_one, promised_distance
from turtle_referee.graph_client.client import GraphClient
from turtle_referee.graph_client.domains import (DomainError, DOMAINS, is_empty, LAST_DOMAIN,
                                                 reserved_domain, restrict_to_localhost)
from turtle_referee.graph_client.drops import DropWatch
from turtle_referee.graph_client.observer import Observer
from turtle_referee.graph_client.profile import Profile
from turtle_referee.graph_client.spinning import INTERRUPTED, LONGEST_WAIT, handle_interrupts

START_TIME = 30.0  # how long (s) the graph may take to come up
BROWSER_TIME = 8.0  # how long (s) a browser may take to show the page before the first brick
HOVERING_TIME = 1.0  # how long (s) a brick hovers before it is dropped, for people to see it

DISCOVERY_TIME = 5.0
"""How long (s) somebody else in the domain has to be found: it takes some tenths of a second, or,
where the first announcement is lost, until the next one, which comes every 3 s."""

ROBOT_TOPICS = ('turtle1/pose', 'turtle1/cmd_vel', 'cmd_vel', 'odom', 'brick_marker')
"""What nobody publishes but turtlesim, a robot and an arena."""


# ---------------------------------------------------------------------------------- its domain

@contextmanager
def chosen_domain() -> Iterator[bool]:
    """
    Take the ROS domain that the environment names, else one that nobody on this machine is in.

    :return: Whether somebody else may be in it.
    :raises DomainError: there is none, or the environment names none that can be
    """
    restrict_to_localhost()
    local = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') == 'LOCALHOST'
    named = os.environ.get('ROS_DOMAIN_ID')
    if named:
        if not named.isdecimal() or int(named) > LAST_DOMAIN:
            raise DomainError(f'ROS_DOMAIN_ID is {named!r:.40}, but must be a whole number '
                              f'from 0 to {LAST_DOMAIN}')
        yield not local or not is_empty(int(named))
        return
    # Not 0, where whoever has chosen no domain is: a launch there would mix with this graph.
    with reserved_domain(DOMAINS[1:]) as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        print(f'In ROS domain {domain}; in another terminal: export ROS_DOMAIN_ID={domain}',
              flush=True)
        yield not local


def look_out(namespaces: Sequence[str]) -> None:
    """Raise DomainError if another robot is found where a graph is to be."""
    topics = [f'{name}/{topic}' for name in namespaces for topic in ROBOT_TOPICS]
    with Graph() as graph, suppress(TimeoutError):
        lookout = graph.add(Node, parameters=False, node_name='lookout')
        graph.spin_until(lambda: any(map(lookout.count_publishers, topics)), DISCOVERY_TIME, '')
        raise DomainError(
            f'another robot is in ROS domain {os.environ.get("ROS_DOMAIN_ID") or 0} (somebody '
            f'publishes {", ".join(filter(lookout.count_publishers, topics))}): end it, or choose '
            'another ROS_DOMAIN_ID')


# ------------------------------------------------------------------------------- what is dropped

def faults(watch: DropWatch, promised: float) -> list[str]:
    """Return what went wrong, in words, where a catch is promised up to a distance (m)."""
    return [fault for fault, is_so in (
        ('it has not come down', watch.down is None),
        ('called Unreachable more than once', len(watch.refusals) > 1),
        ('not called Unreachable, but not caught', not watch.refusals and not watch.caught),
        ('called Unreachable, but caught', watch.refusals and watch.caught),
        (f'called Unreachable within the promised {promised:.2f} m',
         watch.refusals and watch.distance <= promised),
        ('caught, but not tipped off', watch.caught and watch.floated is None)) if is_so]


def random_brick(random: Random, client: GraphClient, parameters: Parameters, nearest: float,
                 farthest: float) -> Vector:
    """Return a place for a brick, between two parts of how far (m) from the robot is promised."""
    robot = client.robot_position()
    assert robot is not None
    while True:
        z = resting_height(parameters) + random.uniform(3.0, 6.0)
        distance = random.uniform(nearest, farthest) * guaranteed_distance(z, parameters)
        angle = random.uniform(-pi, pi)
        x, y = robot[0] + distance * cos(angle), robot[1] + distance * sin(angle)
        if within_arena(x, y) == (x, y):
            return x, y, z


def bricks(options: argparse.Namespace, client: GraphClient,
           parameters: Parameters) -> Iterator[Vector]:
    """Yield where bricks are to be dropped from."""
    if options.drops:
        random = Random(f'{options.namespace}{options.seed}')
        for _ in range(options.drops):
            yield random_brick(random, client, parameters, 0.2, 1.2)
    elif options.place:
        yield from options.place
    else:
        yield parameters.brick_start
        # In the far corner, so that whoever looks from the near one sees it.
        yield (ARENA_SIZE - 0.5, ARENA_SIZE - 0.5, resting_height(parameters) + 1.0)


def play(graph: Graph, options: argparse.Namespace, parameters: Parameters) -> bool:
    """Start every node in an empty graph, drop the bricks; tell whether all went as it should."""
    graph.add_turtlesim()
    graph.add_robot_state_publisher()
    graph.add_robot()
    graph.add_arena()
    catcher = graph.add_catcher().catcher
    observer = graph.add(Observer, parameters=False, name='demo',
                         profile=Profile.from_parameters(parameters))
    client = GraphClient(graph, observer)
    graph.spin_until(client.is_complete, START_TIME,
                     'turtlesim, robot, arena and catcher see each other')
    freeze()  # else the garbage collector goes through every module, for tens of milliseconds
    title = f'{options.namespace}: ' * bool(options.namespace)
    watches, bad = [], 0
    for brick in bricks(options, client, parameters):
        client.place(brick, HOVERING_TIME).check()
        watches.append(watch := client.drop(brick))
        # Where the commands take longer than on an idle machine, less is promised.
        excess = catcher.decision.latency - COMMAND_LATENCY if catcher.decision else 0.0
        found = faults(watch, promised_distance(brick, parameters, excess))
        bad += bool(found)
        print(*(f'{title}FAULT: {fault}\n' for fault in found), sep='', end='', flush=True)
    caught = [watch.caught for watch in watches]
    # In one piece: several processes may write here.
    print(f'{title}{len(watches)} dropped: {sum(caught)} caught, '
          f'{sum(bool(watch.refusals) for watch in watches)} Unreachable, {bad} at fault\n',
          end='', flush=True)
    graph.remove(observer)  # which keeps all that it hears
    return not bad and bool(options.drops or options.place or caught == [True, False])


# --------------------------------------------------------------------------------- the program

def show_page(graph: Graph) -> None:
    """Start the viewer, which tells its address; open that on a person's screen."""
    title = f'{graph.namespace}: ' * bool(graph.namespace)
    viewer = graph.add_process('turtle_brick', 'viewer',
                               listener=lambda line: sys.stderr.write(title + line))

    def await_words(pattern: str, timeout: float) -> re.Match[str] | None:
        with suppress(TimeoutError):
            graph.spin_until(lambda: re.search(pattern, viewer.output) or not viewer.running,
                             timeout, 'the viewer says so')
        return re.search(pattern, viewer.output)

    address = await_words(r'Viewer: (http\S+)', START_TIME)
    display = os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')
    if address and display and sys.stdout.isatty() and webbrowser.open(address[1]):
        await_words('Viewer: a browser shows the page', BROWSER_TIME)


def run(options: argparse.Namespace) -> int:
    """Run the demo in one arena; return its exit status."""
    with Graph(namespace=options.namespace, tf_inside=bool(options.namespace)) as graph:
        if not options.no_view:
            show_page(graph)
        good = play(graph, options, load())
        if sys.stdin.isatty() and sys.stdout.isatty():
            print('The graph stays up until Ctrl-C.')
            graph.spin_until(lambda: False, inf, 'Ctrl-C')
    return 0 if good else 1


def run_arenas(names: Sequence[str], args: Sequence[str]) -> int:
    """Run the demo in several namespaces at the same time, each in a process of its own."""
    command = [sys.executable, '-m', 'turtle_brick.tools.demo', *args, '--namespace']
    # What is ignored now is so in the processes until they call handle_interrupts: they are ended
    # from here, and Python says nothing about a Ctrl-C while it starts.
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    arenas = [subprocess.Popen([*command, name]) for name in names]
    signal.signal(signal.SIGINT, handler)
    try:
        while any(arena.poll() is None for arena in arenas):
            if INTERRUPTED.wait(LONGEST_WAIT):
                raise KeyboardInterrupt
    finally:
        for arena in arenas:
            arena.terminate()
        for arena in arenas:
            arena.wait()
    return 1 if any(arena.returncode for arena in arenas) else 0


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo; return its exit status."""
    args = sys.argv[1:] if args is None else args
    parser = argparse.ArgumentParser(prog='demo', description=__doc__.split('\n\n')[0].strip())
    parser.add_argument(
        '--place', nargs=3, type=float, action='append', metavar=('X', 'Y', 'Z'), default=[],
        help='drop a brick from here (m, in the world) instead of the usual two; repeatable')
    parser.add_argument('--drops', type=at_least_one, metavar='N',
                        help='drop N random bricks instead')
    parser.add_argument(
        '--seed', type=int, default=1, metavar='N', help='of the random bricks (default: 1)')
    parser.add_argument(
        '--arenas', type=at_least_one, default=1, metavar='N',
        help='N arenas side by side, each in a namespace of its own, arena_1, arena_2, ...; '
        'each takes half a core or more')
    parser.add_argument(
        '--no-view', action='store_true', help='do not show the graph in a browser')
    parser.add_argument('--namespace', default='', help=argparse.SUPPRESS)
    options = parser.parse_args(args)
    handle_interrupts()
    try:
        if options.namespace:
            return run(options)
        names = [f'arena_{number + 1}' for number in range(options.arenas)]
        with chosen_domain() as shared:
            if shared:
                look_out(names if len(names) > 1 else [''])
            return run_arenas(names, args) if len(names) > 1 else run(options)
    except KeyboardInterrupt:
        return 0
    except (DomainError, PackageNotFoundError, ParameterError, TimeoutError, ValueError) as error:
        print(f'demo: {error.args[0]}', file=sys.stderr)
        return 1


if __name__ == '__main__':
    sys.exit(main())
