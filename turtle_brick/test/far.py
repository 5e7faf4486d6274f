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
far: spread the graph over three hosts with slow links between them, and drop bricks.

The hosts are network namespaces of this machine, joined by a switch that holds each frame back
for a while or loses it: turtlesim, robot_state_publisher and turtle_robot on the first, the arena
and who drops the bricks on the second, the catcher on the third. It needs no root, but a Linux
where anybody may have namespaces (`unshare --user`) and /dev/net/tun.

    python3 test/far.py --delay 30 --jitter 5 --loss 1 --drops 40
"""

import argparse
from collections import Counter
from collections.abc import Callable
import ctypes
from fcntl import ioctl
import heapq
from math import cos, inf, pi, sin
import os
from pathlib import Path
from random import Random
import select
import signal
import socket
import struct
import sys
from time import monotonic

from rcl_interfaces.msg import Log
from turtle_brick.core.parameters import default_path, load
from turtle_brick.core.reachability import COMMAND_LATENCY, guaranteed_distance, resting_height
from turtle_brick.core.turtlesim_kinematics import within_arena
from turtle_brick.tools.graph import Graph
from turtle_referee.graph_client.client import GraphClient
from turtle_referee.graph_client.observer import subscription_qos, Observer
from turtle_referee.graph_client.processes import close_all, Process
from turtle_referee.graph_client.spinning import handle_interrupts

HERE = Path(__file__).resolve()

CLONE_NEWNET = 0x40000000
"""Asks for a network of its own, see unshare(2)."""

TUNSETIFF, SIOCSIFFLAGS, SIOCSIFADDR, SIOCSIFNETMASK = 0x400454ca, 0x8914, 0x8916, 0x891c
"""Requests of ioctl, see netdevice(7) and Linux' if_tun.h."""

TAP_WITHOUT_HEADER, UP, MULTICAST = 0x1002, 0x1, 0x1000
"""Flags of an interface."""

START_TIME = 60.0
"""How long (s) the graph may take to come up."""

LONGEST = 40.0
"""How long (s) anything else may take: several heartbeats, and the way across the arena."""

HOVERING = 1.0
"""Time (s) for which a brick hovers before it is dropped."""


# --------------------------------------------------------------------------- hosts and the switch

def go_to_new_host(number: int) -> int:
    """Have this process, and those that it starts next, on a host of its own; return its cable."""
    if ctypes.CDLL(None).unshare(CLONE_NEWNET) != 0:
        raise OSError('unshare: no network namespace')
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


def switch(cables: list[int], delay: float, jitter: float, loss: float,
           until: Callable[[], bool]) -> None:
    """
    Pass frames on from each cable to the one they are for, to all where that is not known.

    :param delay: mean time (s) for which a frame is held back, and its standard deviation
    :param loss: part of the frames that get lost
    :param until: asked about ten times per second whether to end
    """
    random = Random(1)
    known: dict[bytes, int] = {}  # on which cable an address is
    late: list[tuple[float, int, int, bytes]] = []  # when due (s), number, cable, frame
    count = 0
    while not until():
        end = monotonic() + 0.1
        while (now := monotonic()) < end:
            while late and late[0][0] <= now:
                _, _, cable, frame = heapq.heappop(late)
                os.write(cable, frame)
            due = late[0][0] if late else end
            ready, _, _ = select.select(cables, [], [], max(min(due, end) - now, 0.0))
            for source in ready:
                frame = os.read(source, 2048)
                known[frame[6:12]] = source
                for cable in [known[frame[:6]]] if frame[:6] in known else cables:
                    if cable != source and random.random() >= loss:
                        count += 1
                        heapq.heappush(late, (monotonic() + max(random.gauss(delay, jitter), 0.0),
                                              count, cable, frame))


# ------------------------------------------------------------------------------------- the bricks

def promised(height: float, latency: float) -> float:
    """Return how far (m) a brick may be released at a height (m), with a latency (s) as told."""
    # An order goes over a link, the motion comes back over another one, and the release is seen
    # one link later.
    return guaranteed_distance(height, load(), 1.5 * (latency - COMMAND_LATENCY))


def place_near(robot: tuple[float, float], latency: float | None, random: Random
               ) -> tuple[float, float, float]:
    """Return where to release a brick (m), from 0.6 to 1.0 of what is promised; else near."""
    while True:
        z = resting_height(load()) + random.uniform(3.0, 7.0)
        way = 0.6 if latency is None else random.uniform(0.6, 1.0) * promised(z, latency)
        angle = random.uniform(-pi, pi)
        x, y = robot[0] + way * cos(angle), robot[1] + way * sin(angle)
        if within_arena(x, y) == (x, y):
            return x, y, z


def judge(drops: int) -> int:
    """
    Drop bricks, the first one only to be told how long the commands take.

    :return: the status: 0 if each was caught or refused. What became of each is printed, and a row
        of the table.
    """
    random = Random(1)
    outcomes: Counter[str] = Counter()
    latencies: list[float] = []
    handle_interrupts()
    with Graph() as graph:
        graph.add_arena()
        observer = graph.add(Observer, parameters=False)
        client = GraphClient(graph, observer, LONGEST)
        log = observer.listener.hear(Log, '/rosout', subscription_qos(latched=True))

        def told(words: str) -> str:
            return next((line.message.msg for line in log if words in line.message.msg), '')

        # Where frames get lost, the catcher may hear of its robot later than this one does.
        graph.spin_until(lambda: client.is_complete() and told('are in sight'), START_TIME,
                         'robot, arena and catcher are there')
        for number in range(drops + 1):
            client.until(client.is_at_rest, LONGEST)
            robot = client.robot_position()
            assert robot is not None
            place = place_near(robot, latencies[-1] if latencies else None, random)
            client.place(place, HOVERING).check()
            log.clear()
            watch = client.drop(place)
            assert watch.down, 'the brick does not come down'
            graph.spin_until(lambda: told('commands take'), LONGEST, 'a word of the catcher')
            sentence = told('commands take')
            print(f'  {sentence}', flush=True)
            latencies.append(float(sentence.split('commands take ')[1].split()[0]))
            outcome = (('caught' if watch.caught else 'missed') if 'can be caught' in sentence
                       else 'caught although refused' if watch.caught else 'refused')
            if number:
                limit = promised(place[2], latencies[-1])
                outcomes[outcome] += 1
                outcomes['inside'] += outcome == 'refused' and watch.distance <= limit
                print(f'  {watch.distance:.2f} m, promised {limit:.2f} m: {outcome}', flush=True)
    broken = drops - outcomes['caught'] - outcomes['refused']
    print(f'| {drops} | {min(latencies[1:]):.2f}–{max(latencies[1:]):.2f} s | '
          f'{outcomes["caught"]} | {outcomes["refused"]} | {outcomes["inside"]} | {broken} |',
          flush=True)
    return 1 if broken else 0


# ------------------------------------------------------------------------------------ the program

def run_robot() -> None:
    """Run turtlesim, robot_state_publisher and turtle_robot until SIGINT or SIGTERM."""
    handle_interrupts()
    with Graph() as graph:
        graph.add_turtlesim()
        graph.add_robot_state_publisher()
        graph.add_robot()
        graph.spin_until(lambda: False, inf, 'the end')


def spread(options: argparse.Namespace) -> int:
    """Run the graph on three hosts and drop bricks; return the status of the judge."""
    # Shared memory would go past the links.
    environment = {'ROS_DOMAIN_ID': '0', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
                   'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
    cables, processes = [], []
    try:
        for number, (listener, *program) in enumerate((
                (None, str(HERE), '--robot'),
                (None, '-m', 'turtle_brick.catcher', '--ros-args', '--params-file',
                 str(default_path())),
                (sys.stdout.write, str(HERE), '--judge', *sys.argv[1:])), 1):
            cables.append(go_to_new_host(number))
            processes.append(Process([sys.executable, *program], environment, listener))
        judging = processes[-1]
        switch(cables, options.delay * 1e-3, options.jitter * 1e-3, options.loss * 1e-2,
               lambda: not judging.running)
        return judging.wait(1.0)
    finally:
        close_all(processes)


def main() -> int:
    """Run the program; return its exit status."""
    parser = argparse.ArgumentParser(prog='far', description=__doc__.split('\n\n')[0].strip())
    for name, default, unit, what in (
            ('delay', 30.0, 'MS', 'mean delay of a frame, one way (ms)'),
            ('jitter', 5.0, 'MS', 'standard deviation of the delay (ms)'),
            ('loss', 0.0, 'PERCENT', 'how many frames get lost (%%)'),
            ('drops', 40, 'N', 'how many bricks')):
        parser.add_argument(f'--{name}', type=type(default), default=default, metavar=unit,
                            help=what)
    for part in ('--robot', '--judge'):
        parser.add_argument(part, action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    try:
        if options.robot:
            run_robot()
        if options.judge:
            return judge(options.drops)
        if os.environ.get('FAR_INSIDE') != '1':
            os.environ['FAR_INSIDE'] = '1'
            os.execvp('unshare', ['unshare', '--user', '--map-root-user', sys.executable,
                                  str(HERE), *sys.argv[1:]])
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        return spread(options)
    except KeyboardInterrupt:
        return 1


if __name__ == '__main__':
    sys.exit(main())
