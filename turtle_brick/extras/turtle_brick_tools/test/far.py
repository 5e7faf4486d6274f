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
Drop bricks in a ROS graph on three hosts with slow links between them.

    python3 far.py --delay 30 --jitter 5 --latency 0.2 --drops 40

The hosts are network namespaces on this machine. The first host runs the robot, the second runs
the catcher, and the third runs the arena. A software switch delays Ethernet frames. The program
requires user namespaces (`unshare --user`) and /dev/net/tun, but not root privileges.
"""

import argparse
from collections import Counter
from collections.abc import Callable
import ctypes
from dataclasses import replace
from fcntl import ioctl
import heapq
from math import dist, inf, nan
import os
from pathlib import Path
from random import Random
import select
import socket
import struct
import sys
from time import monotonic, time_ns

from rcl_interfaces.msg import Log
from std_msgs.msg import String
from turtle_brick.core.parameters import default_path, load
from turtle_brick_tools.demo import random_brick
from turtle_brick_tools.graph import Graph
from turtle_graph.client.client import GraphClient
from turtle_graph.client.observer import Observer, subscription_qos
from turtle_graph.client.processes import close_all, Process
from turtle_graph.client.record import Received
from turtle_graph.client.spinning import handle_interrupts, INTERRUPTED

HERE = Path(__file__).resolve()

CLONE_NEWNET = 0x40000000
"""Flag for a new network namespace, documented in unshare(2)."""

TUNSETIFF, SIOCSIFFLAGS, SIOCSIFADDR, SIOCSIFNETMASK = 0x400454ca, 0x8914, 0x8916, 0x891c
"""Request codes for ioctl, from netdevice(7) and the Linux header if_tun.h."""

TAP_WITHOUT_HEADER, UP, MULTICAST = 0x1002, 0x1, 0x1000
"""Flags of a network interface."""

TIMEOUT = 600.0
"""Timeout (s) for each event."""


def move_to_new_host(number: int) -> int:
    """Move this process and its future children to a new host. Return the host's tap device."""
    if ctypes.CDLL(None).unshare(CLONE_NEWNET) != 0:
        raise OSError('unshare: network namespaces are not permitted')
    tap = os.open('/dev/net/tun', os.O_RDWR)
    ioctl(tap, TUNSETIFF, struct.pack('16sH', b'tap', TAP_WITHOUT_HEADER))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        for request, address in ((SIOCSIFADDR, f'10.0.0.{number}'),
                                 (SIOCSIFNETMASK, '255.255.255.0')):
            ioctl(control, request, struct.pack(
                '16sHH4s8x', b'tap', socket.AF_INET, 0, socket.inet_aton(address)))
        for name in (b'lo', b'tap'):
            ioctl(control, SIOCSIFFLAGS, struct.pack('16sH', name, UP | MULTICAST))
    return tap


def switch(taps: list[int], delay: float, jitter: float, is_done: Callable[[], bool]) -> None:
    """
    Forward Ethernet frames to their destination, or to all hosts if the destination is unknown.

    :param delay: mean delay (s) of a frame, with the standard deviation `jitter` (s)
    :param is_done: function that returns True to stop the switch
    """
    random = Random(1)
    tap_of: dict[bytes, int] = {}  # The keys are MAC addresses.
    queue: list[tuple[float, int, int, bytes]] = []
    count = 0
    while not is_done():
        end = monotonic() + 0.1
        while (now := monotonic()) < end:
            while queue and queue[0][0] <= now:
                _, _, tap, frame = heapq.heappop(queue)
                os.write(tap, frame)
            due = queue[0][0] if queue else end
            ready, _, _ = select.select(taps, [], [], max(min(due, end) - now, 0.0))
            for source in ready:
                frame = os.read(source, 2048)
                tap_of[frame[6:12]] = source
                for tap in [tap_of[frame[:6]]] if frame[:6] in tap_of else taps:
                    if tap != source:
                        count += 1
                        heapq.heappush(queue, (monotonic() + max(random.gauss(delay, jitter), 0.0),
                                               count, tap, frame))


def latest(messages: list[Received]) -> str:
    return messages[-1].message.data if messages else ''


def outcome_of(decision: str, caught: bool) -> str:
    if decision.startswith('reachable'):
        return 'caught' if caught else 'missed'
    return 'caught although refused' if caught else 'refused'


def drop_bricks(options: argparse.Namespace) -> int:
    """
    Drop bricks, and print each result and a row for the table in figures.md.

    Bricks missed while this machine is overloaded do not count as drops.

    :return: exit status (0 if every counted brick was caught or refused)
    """
    random = Random(1)
    outcomes: Counter[str] = Counter()
    # The links also delay the transforms of the falling brick.
    parameters = replace(load(), command_latency=options.latency + options.delay * 1e-3)
    with Graph() as graph:
        graph.add_arena()
        observer = graph.add(Observer, parameters=False)
        client = GraphClient(graph, observer, TIMEOUT)
        qos = subscription_qos(latched=True)
        log = observer.poller.record(Log, '/rosout', qos)
        decisions, catcher_states, brick_states = (
            observer.poller.record(String, topic, qos)
            for topic in ('catcher_decision', 'catcher_state', 'brick_state'))
        # The catcher may discover the robot later than this client does.
        graph.spin_until(lambda: not client.missing() and any(
            'Waiting for the brick' in line.message.msg for line in log), TIMEOUT,
                         'robot, arena and catcher are running')
        while outcomes.total() < options.drops:
            graph.spin_until(lambda: latest(catcher_states) == 'waiting', TIMEOUT,
                             'the catcher is waiting')
            client.wait_until(client.is_at_rest, TIMEOUT)
            place = random_brick(random, client, parameters, 0.6, 1.0)
            distance = dist(place[:2], client.robot_position() or (nan, nan))
            client.place(place, hovering=1.0).check()
            decisions.clear()
            brick_states.clear()
            begin = time_ns()
            client.call('drop').check()
            graph.spin_until(
                lambda: latest(decisions) and latest(brick_states) in ('floating', 'grounded'),
                TIMEOUT, 'the catcher has decided and the brick has come to rest')
            caught = 'riding' in [state.message.data for state in brick_states]
            decision = latest(decisions)
            print(f'  {decision}', flush=True)
            outcome = outcome_of(decision, caught)
            if outcome == 'missed' and not observer.record.is_calm(begin, time_ns()):
                print('  missed, but not counted because the machine was overloaded', flush=True)
                continue
            outcomes[outcome] += 1
            print(f'  {distance:.2f} m: {outcome}', flush=True)
        late = [line.message.msg for line in log if 'to respond to a goal' in line.message.msg]
    for warning in late:
        print(f'  {warning}', flush=True)
    broken = options.drops - outcomes['caught'] - outcomes['refused']
    print(f'| {options.delay:g} ± {options.jitter:g} ms | {options.latency:g} s | '
          f'{outcomes["caught"]} | {outcomes["refused"]} | {broken} |', flush=True)
    return 1 if broken else 0


def run_robot() -> None:
    with Graph() as graph:
        graph.add_turtlesim()
        graph.add_robot_state_publisher()
        graph.add_robot()
        graph.spin_until(lambda: False, inf, 'the end')


def run_hosts(options: argparse.Namespace) -> int:
    # Shared memory would bypass the switch.
    environment = {'ROS_DOMAIN_ID': '0', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
                   'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
    taps, processes = [], []
    try:
        for number, (listener, *program) in enumerate((
                (None, str(HERE), '--robot'),
                (None, '-m', 'turtle_brick.catcher', '--ros-args', '--params-file',
                 str(default_path()), '-p', f'command_latency:={options.latency}'),
                (sys.stdout.write, str(HERE), '--client', *sys.argv[1:])), 1):
            taps.append(move_to_new_host(number))
            processes.append(Process([sys.executable, *program], environment, listener))
        client = processes[-1]
        switch(taps, options.delay * 1e-3, options.jitter * 1e-3,
               lambda: INTERRUPTED.is_set() or not client.running)
        return 1 if INTERRUPTED.is_set() else client.wait(1.0)
    finally:
        close_all(processes)


def main() -> int:
    parser = argparse.ArgumentParser(
        prog='far', description='Drop bricks in a graph on three hosts with slow links.')
    for name, default, text in (
            ('delay', 30.0, 'mean one-way delay of a frame (ms)'),
            ('jitter', 5.0, 'standard deviation of the delay (ms)'),
            ('latency', load().command_latency, 'command_latency of the catcher (s)'),
            ('drops', 40, 'number of bricks')):
        parser.add_argument(f'--{name}', type=type(default), default=default, help=text)
    for role in ('--robot', '--client'):
        parser.add_argument(role, action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    handle_interrupts()
    try:
        if options.robot:
            run_robot()
        if options.client:
            return drop_bricks(options)
        if os.environ.get('FAR_INSIDE') != '1':
            os.environ['FAR_INSIDE'] = '1'
            os.execvp('unshare', ['unshare', '--user', '--map-root-user', sys.executable,
                                  str(HERE), *sys.argv[1:]])
        return run_hosts(options)
    except KeyboardInterrupt:
        return 1


if __name__ == '__main__':
    sys.exit(main())
