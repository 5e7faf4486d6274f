# SPDX-License-Identifier: Apache-2.0

"""
demo: run the whole graph in one process and drop bricks.

By default, the demo drops two bricks: one that can be caught and one that cannot.

The exit status is 0 if the catcher accepted every brick for which a catch is guaranteed, and the
robot caught every accepted brick and tipped it off the platform, while all nodes ran and the page
responded. Otherwise, it is 1.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from gc import freeze
from http.client import HTTPConnection, HTTPException
from math import cos, inf, pi, sin
import os
from random import Random
import socket
import sys
from typing import Any
import webbrowser

from ament_index_python.packages import PackageNotFoundError
from rclpy.node import Node
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import load, Parameters
from turtle_brick.core.reachability import resting_height
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE, nearest_in_arena
from turtle_brick_tools import positive_int
from turtle_brick_tools.graph import Graph
from turtle_brick_tools.simulation import guaranteed_distance, guaranteed_distance_to, make_world
from turtle_graph.client.client import GraphClient
from turtle_graph.client.domains import (DomainError, DOMAINS, is_empty, LAST_DOMAIN,
                                         reserved_domain, restrict_to_localhost)
from turtle_graph.client.drops import DropWatch
from turtle_graph.client.observer import Observer
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Record
from turtle_graph.client.spinning import handle_interrupts

START_TIMEOUT = 30.0
"""Timeout (s) for starting the graph."""

BROWSER_TIMEOUT = 8.0
"""Time (s) to wait for a browser to open the viewer page before the first drop."""

PAGE_TIMEOUT = 5.0
"""Timeout (s) for a response of the viewer page."""

HOVERING_TIME = 1.0
"""Time (s) for which each brick hovers before the drop, so that users can see the brick."""

DISCOVERY_TIME = 5.0
"""Time (s) to wait for the discovery of other robots. Discovery usually takes less than 1 s, but a
lost announcement is repeated only after 3 s."""

KEPT_MESSAGES = 1000
"""Maximum number of earlier messages kept per topic when a drop starts."""

FIRST_PORT = 8080
"""Port of the page, or if it is not free, the first of the ports to try."""

ROBOT_TOPICS = ('turtle1/pose', 'turtle1/cmd_vel', 'cmd_vel', 'odom', 'brick_marker')
"""Topics published only by turtlesim, a robot or an arena."""


@contextmanager
def choose_domain() -> Iterator[bool]:
    """Select a ROS domain, and yield whether the domain may contain other nodes."""
    restrict_to_localhost()
    local = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') == 'LOCALHOST'
    given = os.environ.get('ROS_DOMAIN_ID')
    if given:
        if not given.isdecimal() or int(given) > LAST_DOMAIN:
            raise DomainError(f'ROS_DOMAIN_ID is {given!r:.40}, but must be a whole number '
                              f'from 0 to {LAST_DOMAIN}')
        yield not local or not is_empty(int(given))
        return
    # Skip the default domain 0 because another graph could be launched in it later.
    with reserved_domain(DOMAINS[1:]) as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        print(f'Using ROS domain {domain}. In another terminal: export ROS_DOMAIN_ID={domain}',
              flush=True)
        yield not local


def check_for_other_robots() -> None:
    """Raise DomainError if another robot is running in the ROS domain."""
    with Graph() as graph, suppress(TimeoutError):
        node = graph.add(Node, parameters=False, node_name='other_robot_check')
        graph.spin_until(lambda: any(map(node.count_publishers, ROBOT_TOPICS)), DISCOVERY_TIME, '')
        published = filter(node.count_publishers, ROBOT_TOPICS)
        raise DomainError(
            f'another robot is running in ROS domain {os.environ.get("ROS_DOMAIN_ID") or 0} '
            f'(published topics: {", ".join(published)}); stop it, or '
            'choose another ROS_DOMAIN_ID')


def faults(watch: DropWatch, guaranteed: float) -> list[str]:
    """Return the faults in a drop, given the `guaranteed_distance` (m) for the brick."""
    result = []
    if watch.down is None:
        result.append('the brick did not land')
    if len(watch.refusals) > 1:
        result.append('reported as Unreachable more than once')
    if not watch.refusals and not watch.caught:
        result.append('neither reported as Unreachable nor caught')
    if watch.refusals and watch.caught:
        result.append('reported as Unreachable, but caught')
    if watch.refusals and watch.distance <= guaranteed:
        result.append(f'reported as Unreachable within the guaranteed {guaranteed:.2f} m')
    if watch.caught and watch.floated is None:
        result.append('caught, but not tipped off')
    return result


def random_brick(random: Random, client: GraphClient, parameters: Parameters, nearest: float,
                 farthest: float) -> Vector:
    """Return a position (m). `nearest` and `farthest` are factors for `guaranteed_distance`."""
    robot = client.robot_position()
    assert robot is not None
    while True:
        z = resting_height(parameters) + random.uniform(3.0, 6.0)
        distance = random.uniform(nearest, farthest) * guaranteed_distance(z, parameters)
        angle = random.uniform(-pi, pi)
        x, y = robot[0] + distance * cos(angle), robot[1] + distance * sin(angle)
        if nearest_in_arena(x, y) == (x, y):
            return x, y, z


def bricks(options: argparse.Namespace, client: GraphClient,
           parameters: Parameters) -> Iterator[Vector]:
    """Yield the brick positions (m) selected by the command-line options."""
    if options.drops:
        random = Random(options.seed)
        for _ in range(options.drops):
            yield random_brick(random, client, parameters, 0.2, 1.2)
    elif options.place:
        yield from options.place
    else:
        yield parameters.brick_start
        # This corner of the arena is visible from the initial camera position.
        yield (ARENA_SIZE - 0.5, ARENA_SIZE - 0.5, resting_height(parameters) + 1.0)


def forget_old_messages(record: Record) -> None:
    """Keep only the newest messages of each topic and the newest transforms of each frame."""
    lists: list[list[Any]] = list(record.topics.values())
    for frame in record.frames.values():
        lists += [frame.samples, frame.published, frame.sequence_numbers]
    for entries in lists:
        del entries[:-KEPT_MESSAGES]


def run_scenario(graph: Graph, options: argparse.Namespace, parameters: Parameters,
                 page_port: int | None = None) -> bool:
    """
    Start all nodes in an empty graph, drop bricks, and return whether the demo succeeded.

    :param page_port: port on which the viewer page must still respond after the last drop
    """
    graph.add_turtlesim()
    graph.add_robot_state_publisher()
    graph.add_robot()
    graph.add_arena()
    graph.add_catcher()
    observer = graph.add(Observer, parameters=False, name='demo',
                         profile=Profile.from_parameters(parameters))
    client = GraphClient(graph, observer)
    graph.spin_until(lambda: not client.missing(), START_TIMEOUT,
                     'turtlesim, robot, arena and catcher are connected')
    watches, faulty = [], 0
    for brick in bricks(options, client, parameters):
        client.place(brick, HOVERING_TIME).check()
        forget_old_messages(observer.record)
        # Without freeze(), a garbage collection could stop all nodes for 0.3 s during the fall.
        freeze()
        watch = client.drop(brick)
        watches.append(watch)
        drop_faults = faults(watch, guaranteed_distance_to(brick, parameters))
        for fault in drop_faults:
            print(f'FAULT: {fault}', flush=True)
        if drop_faults:
            faulty += 1
    if page_port is not None and not responds(page_port):
        faulty += 1
        print(f'FAULT: the page http://127.0.0.1:{page_port} does not respond', flush=True)
    caught = [watch.caught for watch in watches]
    if not (options.drops or options.place) and caught != [True, False]:
        faulty += 1
        print('FAULT: not exactly the first brick was caught', flush=True)
    refused = [watch for watch in watches if watch.refusals]
    print(f'{len(watches)} dropped: {sum(caught)} caught, {len(refused)} Unreachable, '
          f'{faulty} faulty', flush=True)
    graph.remove(observer)  # Stop recording messages.
    return faulty == 0


def free_port(first: int) -> int:
    """Return the lowest free TCP port from `first` on, or raise ValueError."""
    for port in range(first, 65536):
        with suppress(OSError), socket.create_server(('127.0.0.1', port)):
            return port
    raise ValueError(f'no port from {first} to 65535 is free for the page')


def responds(port: int) -> bool:
    """Return whether a page on a port of this machine responds."""
    with suppress(OSError, HTTPException), closing(
            HTTPConnection('127.0.0.1', port, timeout=PAGE_TIMEOUT)) as connection:
        connection.request('GET', '/')
        return connection.getresponse().status == 200
    return False


def start_viewer(graph: Graph) -> int:
    """Start the viewer, open its page if a display is available, and return the page's port."""
    port = free_port(FIRST_PORT)
    graph.add_process('turtle_graph', 'viewer', '--ros-args', '-p', f'port:={port}')
    address = f'http://127.0.0.1:{port}'
    graph.spin_until(lambda: responds(port), START_TIMEOUT, f'the page {address} responds')
    display = os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')
    if display and sys.stdout.isatty() and webbrowser.open(address):
        wait_for_browser(graph)
    return port


def wait_for_browser(graph: Graph) -> None:
    """Wait until a browser shows the page, because only then the viewer subscribes to odom."""
    node = graph.add(Node, parameters=False, node_name='browser_check')
    with suppress(TimeoutError):
        graph.spin_until(lambda: node.count_subscribers('odom'), BROWSER_TIMEOUT, '')
    graph.remove(node)


def is_interactive() -> bool:
    """Return whether the demo is running in a terminal."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def run(options: argparse.Namespace, parameters: Parameters) -> int:
    """Run the demo in the selected ROS domain and return the exit status."""
    with Graph() as graph:
        page_port = None if options.no_view else start_viewer(graph)
        good = run_scenario(graph, options, parameters, page_port)
        if is_interactive():
            print('The graph keeps running until you press Ctrl-C.')
            with suppress(KeyboardInterrupt):
                graph.spin_until(lambda: False, inf, 'Ctrl-C')
    return 0 if good else 1


def parse(args: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        prog='demo', description='Run the whole graph in one process and drop bricks.')
    positions = parser.add_mutually_exclusive_group()
    positions.add_argument(
        '--place', nargs=3, type=float, action='append', metavar=('X', 'Y', 'Z'), default=[],
        help='drop a brick from this position (m, world frame) instead of the two default '
        'positions; repeatable')
    positions.add_argument(
        '--drops', type=positive_int, metavar='N',
        help='drop N bricks from random positions instead of the two default positions')
    parser.add_argument('--seed', type=int, default=1, metavar='N',
                        help='seed for the random positions (default: 1)')
    parser.add_argument('--no-view', action='store_true', help='do not start the browser viewer')
    return parser.parse_args(args)


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo and return the exit status."""
    options = parse(args)
    handle_interrupts()
    try:
        parameters = load()
        world = make_world(parameters)
        for position in options.place:
            world.brick = position  # The setter checks the position.
        with choose_domain() as shared:
            if shared:
                check_for_other_robots()
            return run(options, parameters)
    except KeyboardInterrupt:
        return 0
    except (PackageNotFoundError, RuntimeError, TimeoutError, ValueError) as error:
        # rclpy raises a RuntimeError whose message ends with locations in the source code of rcl.
        print(f'demo: {error.args[0].partition(", at /")[0]}', file=sys.stderr)
        return 1


if __name__ == '__main__':
    sys.exit(main())
