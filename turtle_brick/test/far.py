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
from collections.abc import Callable
from contextlib import ExitStack
from fcntl import ioctl
import heapq
from math import cos, hypot, inf, pi, sin
import os
from pathlib import Path
from random import Random
import re
import select
import signal
import socket
import struct
import subprocess
import sys
from time import monotonic

HERE = Path(__file__).resolve()

TUNSETIFF, SIOCSIFFLAGS, SIOCSIFADDR, SIOCSIFNETMASK = 0x400454ca, 0x8914, 0x8916, 0x891c
"""Requests of ioctl, see netdevice(7) and Linux' if_tun.h."""

TAP_WITHOUT_HEADER, UP, MULTICAST = 0x1002, 0x1, 0x1000
"""Flags of an interface."""

HOSTS = 3
ROBOT, ARENA, CATCHER = range(HOSTS)

START_TIME = 60.0
"""How long (s) the graph may take to come up."""

LONGEST = 40.0
"""How long (s) anything else may take: several heartbeats, and the way across the arena."""

HOVERING = 1.0
"""Time (s) for which a brick hovers before it is dropped."""


# --------------------------------------------------------------------------- hosts and the switch

def be_host(number: int, line: socket.socket) -> None:
    """Make this process's network that of a host, hand its cable over the line; wait for EOF."""
    tap = os.open('/dev/net/tun', os.O_RDWR)
    ioctl(tap, TUNSETIFF, struct.pack('16sH', b'tap', TAP_WITHOUT_HEADER))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        for request, address in ((SIOCSIFADDR, f'10.0.0.{number + 1}'),
                                 (SIOCSIFNETMASK, '255.255.255.0')):
            ioctl(control, request, struct.pack(
                '16sHH4s8x', b'tap', socket.AF_INET, 0, socket.inet_aton(address)))
        for name in (b'lo', b'tap'):
            ioctl(control, SIOCSIFFLAGS, struct.pack('16sH', name, UP | MULTICAST))
    socket.send_fds(line, [b'cable'], [tap])
    line.recv(1)


class Host:
    """A network of its own in which programs can run."""

    def __init__(self, number: int) -> None:
        """Begin with no program."""
        self._line, other = socket.socketpair()
        self._holder = subprocess.Popen(
            ['unshare', '--net', sys.executable, str(HERE), '--host', str(number),
             str(other.fileno())], pass_fds=[other.fileno()])
        other.close()
        _, (self.cable, *_), _, _ = socket.recv_fds(self._line, 5, 1)

    def command(self, *command: str) -> list[str]:
        """Return the command that runs a command there."""
        return ['nsenter', f'--net=/proc/{self._holder.pid}/ns/net', *command]

    def close(self) -> None:
        """End the network."""
        os.close(self.cable)
        self._line.close()
        self._holder.wait()


class Switch:
    """Pass frames on from each cable to the others, late or not at all."""

    def __init__(self, cables: list[int], delay: float, jitter: float, loss: float) -> None:
        """Hold each frame back for a random time (s), and lose some (part of all)."""
        self._cables = cables
        self._delay, self._jitter, self._loss = delay, jitter, loss
        self._random = Random(1)
        self._known: dict[bytes, int] = {}
        """On which cable an address is."""
        self._late: list[tuple[float, int, int, bytes]] = []
        """When a frame is due (s), its number, its cable, and itself."""
        self._count = 0

    def work(self, until: Callable[[], bool]) -> None:
        """Pass frames on until a condition holds, which is asked about ten times per second."""
        while not until():
            end = monotonic() + 0.1
            while (now := monotonic()) < end:
                while self._late and self._late[0][0] <= now:
                    _, _, cable, frame = heapq.heappop(self._late)
                    os.write(cable, frame)
                due = self._late[0][0] if self._late else end
                ready, _, _ = select.select(self._cables, [], [], max(min(due, end) - now, 0.0))
                for cable in ready:
                    self._take(cable, os.read(cable, 2048), monotonic())

    def _take(self, source: int, frame: bytes, now: float) -> None:
        """Send a frame on its way to whom it is for: to all, where that is not known."""
        self._known[frame[6:12]] = source
        goal = self._known.get(frame[:6])
        for cable in self._cables if goal is None else [goal]:
            if cable != source and self._random.random() >= self._loss:
                delay = max(self._random.gauss(self._delay, self._jitter), 0.0)
                self._count += 1
                heapq.heappush(self._late, (now + delay, self._count, cable, frame))


# ------------------------------------------------------------------------------------- the bricks

def judge(drops: int) -> int:
    """
    Drop bricks from 0.6 to 1.0 of what is promised with the latency that the catcher told last.

    :return: the status: 0 if each was caught or refused. What became of each is printed, and a row
        of the table.
    """
    # Not at the top: the switch needs no ROS.
    from live_graph import LATCHED, LiveGraph
    from rcl_interfaces.msg import Log
    from std_msgs.msg import String
    from std_srvs.srv import Trigger
    from tf2_ros import Buffer
    from turtle_brick.core.driving import within_arena
    from turtle_brick.core.parameters import load
    from turtle_brick.core.reachability import COMMAND_LATENCY, guaranteed_distance, resting_height
    from turtle_brick.physics import Phase
    from turtle_brick.ros.tf import GuardedListener, latest, PLATFORM
    from turtle_brick_interfaces.srv import Place
    from turtle_referee.spinning import note_interrupts
    from visualization_msgs.msg import Marker
    parameters, random = load(), Random(1)
    outcomes: list[str] = []
    latencies: list[float] = []
    inside = 0

    def promised(height: float, latency: float) -> float:
        # An order goes over a link, the motion comes back over another one, and the release is
        # seen one link later.
        return guaranteed_distance(height, parameters, 1.5 * (latency - COMMAND_LATENCY))

    note_interrupts()
    with LiveGraph(None) as live:
        live.add_arena()
        buffer = Buffer()
        listener = GuardedListener(buffer, live.listener)
        markers = live.record('brick_marker', Marker, LATCHED)
        states = live.record('catcher_state', String, LATCHED)
        log = live.record('/rosout', Log, LATCHED)

        def is_in(*phases: Phase) -> bool:
            return markers.last.text in [phase.value for phase in phases]

        def verdict() -> re.Match[str] | None:
            said = [re.search('commands take ([0-9.]+) s here', line.msg) for line in log.messages]
            return next(filter(None, said), None)

        live.wait_for(lambda: states.last and markers.last and latest(buffer, PLATFORM),
                      START_TIME, 'robot, arena and catcher are there')
        # Where frames get lost, the catcher may hear of its robot later than this one does.
        live.wait_for(lambda: any('are in sight' in line.msg for line in log.messages),
                      START_TIME, 'the catcher hears the robot')
        latency = COMMAND_LATENCY
        for number in range(drops + 1):
            live.wait_for(lambda: re.match('waiting|unreachable', states.last.data), LONGEST,
                          'the catcher waits')
            robot = latest(buffer, PLATFORM).transform.translation
            while True:
                z = resting_height(parameters) + random.uniform(3.0, 7.0)
                # The first one tells how long the commands take.
                way = random.uniform(0.6, 1.0) * promised(z, latency) if number else 0.6
                angle = random.uniform(-pi, pi)
                x, y = robot.x + way * cos(angle), robot.y + way * sin(angle)
                if within_arena(x, y) == (x, y):
                    break
            request = Place.Request()
            request.location.x, request.location.y, request.location.z = x, y, z
            assert live.call('place', Place, request).success
            live.spin_for(HOVERING)
            robot = latest(buffer, PLATFORM).transform.translation
            log.clear()
            assert live.call('drop', Trigger).success
            live.wait_for(lambda: is_in(Phase.RIDING, Phase.GROUNDED), LONGEST,
                          'the brick comes down')
            caught = is_in(Phase.RIDING)
            told = live.wait_for(verdict, LONGEST, 'the catcher says what it does')
            print(f'  {told.string}', flush=True)
            latency = float(told[1])
            if caught:
                live.wait_for(lambda: is_in(Phase.FLOATING), LONGEST, 'the brick is tipped off')
            outcome = (('caught' if caught else 'missed') if 'can be caught' in told.string
                       else 'caught although refused' if caught else 'refused')
            if number:
                distance, limit = hypot(x - robot.x, y - robot.y), promised(z, latency)
                outcomes.append(outcome)
                latencies.append(latency)
                inside += outcome == 'refused' and distance <= limit
                print(f'  {distance:.2f} m, promised {limit:.2f} m: {outcome}', flush=True)
        listener.unregister()
    broken = len([one for one in outcomes if one not in ('caught', 'refused')])
    print(f'| {len(outcomes)} | {min(latencies):.2f}–{max(latencies):.2f} s | '
          f'{outcomes.count("caught")} | {outcomes.count("refused")} | {inside} | {broken} |',
          flush=True)
    return 1 if broken else 0


# ------------------------------------------------------------------------------------ the program

def run_robot() -> None:
    """Run turtlesim, robot_state_publisher and turtle_robot until SIGTERM."""
    from turtle_brick.tools.graph import Graph
    from turtle_referee.spinning import note_interrupts
    note_interrupts()
    with Graph() as graph:
        graph.add_turtlesim()
        graph.add_robot_state_publisher()
        graph.add_robot()
        graph.spin_until(lambda: False, inf, 'the end')


def spread(options: argparse.Namespace) -> int:
    """Run the graph on three hosts and drop bricks; return the status of the judge."""
    from ament_index_python.packages import get_package_share_directory
    from turtle_referee.processes import close_all, Process
    file = Path(get_package_share_directory('turtle_brick'), 'config', 'turtle.yaml')
    # Shared memory would go past the links.
    os.environ.update(ROS_DOMAIN_ID='0', ROS_AUTOMATIC_DISCOVERY_RANGE='SUBNET',
                      FASTDDS_BUILTIN_TRANSPORTS='UDPv4')
    with ExitStack() as stack:
        hosts = [Host(number) for number in range(HOSTS)]
        for host in hosts:
            stack.callback(host.close)
        processes = [
            Process(hosts[ROBOT].command(sys.executable, str(HERE), '--robot')),
            Process(hosts[CATCHER].command(sys.executable, '-m', 'turtle_brick.catcher',
                                           '--ros-args', '--params-file', str(file)))]
        stack.callback(close_all, processes)
        judging = Process(
            hosts[ARENA].command(sys.executable, str(HERE), '--judge', *sys.argv[1:]),
            listener=sys.stdout.write)
        processes.append(judging)
        switch = Switch([host.cable for host in hosts], options.delay * 1e-3,
                        options.jitter * 1e-3, options.loss * 1e-2)
        switch.work(lambda: not judging.running)
        return judging.wait(1.0)


def main() -> int:
    """Run the program; return its exit status."""
    if sys.argv[1:2] == ['--host']:
        be_host(int(sys.argv[2]), socket.socket(fileno=int(sys.argv[3])))
        return 0
    parser = argparse.ArgumentParser(prog='far', description=__doc__.split('\n\n')[0].strip())
    parser.add_argument('--delay', type=float, default=30.0, metavar='MS',
                        help='mean delay of a frame, one way (ms)')
    parser.add_argument('--jitter', type=float, default=5.0, metavar='MS',
                        help='standard deviation of the delay (ms)')
    parser.add_argument('--loss', type=float, default=0.0, metavar='PERCENT',
                        help='how many frames get lost (%%)')
    parser.add_argument('--drops', type=int, default=40, metavar='N', help='how many bricks')
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
            os.execvp('unshare', ['unshare', '--user', '--map-root-user', '--net', sys.executable,
                                  str(HERE), *sys.argv[1:]])
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        return spread(options)
    except KeyboardInterrupt:
        return 1


if __name__ == '__main__':
    sys.exit(main())
