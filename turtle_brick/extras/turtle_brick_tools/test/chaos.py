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
Test whether the graph recovers from killed nodes, frozen nodes and random messages.

    python3 chaos.py kills [PATTERN]    each fault in each node at each stage
    python3 chaos.py messages [COUNT]   random messages on topics and services

The graph must recover from each fault and each series of 1000 random messages. The robot must then
catch a brick and tip it off its platform at the arena center. The test ends at the first failure.
"""

from collections.abc import Callable, Iterable
from importlib.util import find_spec
from itertools import product
from math import inf, nan
import os
from random import Random
import re
import signal
import sys
from time import monotonic, time_ns
from typing import Any

from rclpy.node import Node
from rclpy.time import Time
from std_msgs.msg import String
from turtle_brick.ros.tf import MAX_AHEAD_NS
from turtle_brick_tools.graph import Graph
from turtle_graph.client.client import GraphClient
from turtle_graph.client.domains import reserved_domain
from turtle_graph.client.drops import DropWatch
from turtle_graph.client.geometry import ARENA_SIZE, CENTER, inclination, Vector
from turtle_graph.client.observer import load_type, Observer, subscription_qos
from turtle_graph.client.processes import Process
from turtle_graph.client.record import NS_PER_SECOND, SECONDS_PER_NS
from turtle_graph.client.spinning import handle_interrupts

WINDOW = 10.0
"""Time (s) after a fault during which the catcher may refuse bricks that are easy to catch."""

TIMEOUT = 300.0
"""Timeout (s) for each event."""

NODES = {
    'turtlesim': ('turtlesim', 'turtlesim_node', '-p', 'holonomic:=true'),
    'robot_state_publisher': ('robot_state_publisher', 'robot_state_publisher'),
    'turtle_robot': ('turtle_brick', 'turtle_robot', '-r', 'cmd_vel:=turtle1/cmd_vel'),
    'arena': ('turtle_brick', 'arena'),
    'catcher': ('turtle_brick', 'catcher'),
    **({'viewer': ('turtle_graph', 'viewer', '-p', 'port:=0')} if find_spec('viser') else {}),
}
"""Package, executable and arguments of each node."""

FAULTS = {'kill': None, 'freeze 0.3': 0.3, 'freeze 2': 2.0}
"""Time (s) between SIGSTOP and SIGCONT for each fault, or None for SIGKILL and a restart."""

STAGES: dict[str, Callable[[Any, DropWatch], Any]] = {
    'idle': lambda scene, watch: True,
    'hovering': lambda scene, watch: True,
    'falling': lambda scene, watch: watch.goal,
    'carrying': lambda scene, watch: watch.caught,
    'tilting': lambda scene, watch: watch.tilted,
    'leveling': lambda scene, watch: scene.brick_state == 'floating' and scene.is_level(0.5),
    'floating': lambda scene, watch: watch.leveled,
    'unreachable': lambda scene, watch: watch.refusals,
}
"""Conditions that mark the start of each stage of a drop."""

UDP = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
"""Environment variables for the `kills` command. With the discovery range LOCALHOST, Fast DDS uses
shared memory. A process that had been frozen for 2 s stopped receiving messages in 3 of 240 trials
with shared memory, but never with UDP."""

START_TIME = 1.5 if 'FASTRTPS_DEFAULT_PROFILES_FILE' in os.environ else 5.0
"""Time (s) allowed for the discovery of a new process. DDS repeats the announcement of a process
every 3 s, or every 0.3 s with the project's DDS profile."""

EASY_HEIGHT, EASY_DISTANCE, UNREACHABLE_HEIGHT = 20.0, 2.0, 12.0
"""Height (m) of a brick that is easy to catch, its maximum distance (m) from the robot, and height
(m) of an unreachable brick. Even on a busy machine, the catcher detects a fall from 12 m."""

BATCH, PERIOD = 1000, 0.005
"""Number of random messages before each test catch, and interval (s) between messages."""

EXCLUDED = ('/rosout', '/parameter_events', '/turtle1/cmd_vel', '/joint_states')
"""Topics without random messages. The real turtlesim keeps a NaN from cmd_vel in its pose. The
real robot_state_publisher exits after receiving a joint state with a timestamp before 1970."""


class Scene(Graph):
    """A graph with a client in this process and nodes in other processes."""

    def __init__(self, domain_id: int, random: Random, names: Iterable[str] = NODES) -> None:
        super().__init__(domain_id)
        self.random = random
        self.parameters = (self.params_file, self.parameter_file(self.robot_parameters()))
        self.processes: dict[str, Process] = {}
        for name in names:
            self.start(name)

    def start(self, name: str) -> None:
        package, executable, *arguments = NODES[name]
        for file in self.parameters:
            arguments += ['--params-file', str(file)]
        self.processes[name] = self.add_process(
            package, executable, '--ros-args', *arguments, listener=lambda line: None)
        self.known_at = monotonic() + START_TIME

    def restart_observer(self) -> None:
        for node in [node for node in self.nodes if isinstance(node, Observer)]:
            self.remove(node)
        self.observer = self.add(Observer, parameters=False)
        self.record = self.observer.record
        self.states = self.observer.poller.record(
            String, 'brick_state', subscription_qos(latched=True))
        self.client = GraphClient(self, self.observer)

    def wait_until(self, condition: Callable[[], Any], what: str) -> None:
        """Wait until a condition holds. Fail if a node exits or prints a traceback."""
        def check() -> Any:
            for process in self.processes.values():
                assert process.running, process.exit_message()
                assert 'Traceback' not in process.output, process.output[-500:]
            return condition()

        self.spin_until(check, TIMEOUT, what)

    @property
    def brick_state(self) -> str:
        return self.states[-1].message.data if self.states else 'unknown'

    def is_level(self, tolerance: float) -> bool:
        platform = self.record.pose('platform', time_ns())
        return platform is not None and inclination(platform) < tolerance

    def recover(self) -> None:
        self.spin_for(self.known_at - monotonic())
        self.restart_observer()
        self.wait_until(lambda: not self.client.missing() and self.client.is_at_rest()
                        and 'Waiting for the brick' in self.processes['catcher'].output
                        and self.brick_state in ('hovering', 'floating', 'grounded'),
                        'the graph is complete, the robot is at rest, and it carries no brick')

    def place(self, position: Vector) -> None:
        self.wait_until(lambda: self.client.place(position, hovering=0.3).accepted, 'place')

    def release(self, position: Vector) -> DropWatch:
        self.place(position)
        watch = DropWatch(self.record, time_ns(), position)
        watch.requested = watch.begin
        self.observer.after_fetch = watch.update
        self.wait_until(lambda: self.client.call('drop') and watch.released, 'drop')
        return watch

    def easy_position(self) -> Vector:
        while True:
            x, y = (self.random.uniform(0.0, ARENA_SIZE) for _ in range(2))
            if 0.3 < self.client.distance_to((x, y)) < EASY_DISTANCE:
                return x, y, EASY_HEIGHT

    def drop_easy_brick(self, stage: str) -> DropWatch:
        """
        Drop bricks that are easy to catch until one drop reaches a given stage.

        The catcher may refuse bricks for WINDOW seconds after a fault. The robot may miss bricks
        while this machine is overloaded.
        """
        begin = monotonic()
        window_end, deadline = begin + WINDOW, begin + TIMEOUT
        while begin < deadline:
            begin = monotonic()
            watch = self.release(self.easy_position())
            self.wait_until(lambda: STAGES[stage](self, watch) or watch.down and not watch.caught,
                            f'the stage {stage}')
            if not watch.down or watch.caught:
                return watch
            if self.record.is_calm(watch.begin, time_ns()):
                assert watch.refusals, 'the robot missed an easy brick'
                assert begin < window_end, self.processes['catcher'].output[-1000:]
        raise TimeoutError('the robot catches no brick on the overloaded machine')

    def check_catch(self) -> None:
        watch = self.drop_easy_brick('carrying')
        self.wait_until(lambda: watch.floated, 'the brick slides off')
        assert self.client.distance_to(CENTER) < 0.05, 'the brick is not tipped off at the center'
        self.wait_until(lambda: watch.leveled, 'the platform is level again')

    def go_to(self, stage: str) -> None:
        if stage == 'hovering':
            self.place(self.easy_position())
        elif stage == 'unreachable':
            edges = (0.5, ARENA_SIZE - 0.5)
            farthest = max(product(edges, edges), key=self.client.distance_to)
            watch = self.release((*farthest, UNREACHABLE_HEIGHT))
            self.wait_until(lambda: STAGES[stage](self, watch), f'the stage {stage}')
        elif stage != 'idle':
            self.drop_easy_brick(stage)

    def inject(self, name: str, fault: float | None) -> None:
        process = self.processes[name]
        if fault is None:
            process.kill()
            self._processes.remove(process)  # The graph must not report the end of this process.
            self.start(name)
        else:
            process.send(signal.SIGSTOP)
            self.spin_for(fault)
            process.send(signal.SIGCONT)

    def check_fault(self, node: str, fault: str, stage: str) -> None:
        self.go_to(stage)
        self.inject(node, FAULTS[fault])
        self.recover()
        self.check_catch()

    def check_messages(self, count: int) -> None:
        def follows_commands() -> bool:
            self.observer.send_tilt(0.0)
            self.observer.send_goal(*CENTER)
            self.spin_for(0.5)
            return self.is_level(1e-3) and self.client.distance_to(CENTER) < 0.05

        sender = self.add(Node, parameters=False, node_name='sender')
        # Reliable, transient-local publishers are compatible with all subscriptions. Topics with
        # '/_' in their names belong to turtlesim's actions.
        publishers = [
            sender.create_publisher(load_type(types[0]), name, subscription_qos(latched=True))
            for name, types in sender.get_topic_names_and_types()
            if name not in EXCLUDED and '/_' not in name]
        clients = [self.observer.service_client(name) for name in ('place', 'drop')]
        self.wait_until(lambda: all(
            publisher.get_subscription_count() == sender.count_subscribers(publisher.topic_name)
            for publisher in publishers), 'all subscriptions are matched')
        targets = [(publisher.publish, publisher.msg_type) for publisher in publishers]
        targets += [(client.call_async, client.srv_type.Request) for client in clients]
        for send, kind in self.random.choices(targets, k=count):
            send(fill_randomly(kind(), self.random))
            self.spin_for(PERIOD)
        self.remove(sender)
        self.spin_for(MAX_AHEAD_NS * SECONDS_PER_NS)  # Let the clock pass all stored timestamps.
        self.restart_observer()
        self.wait_until(lambda: not self.client.missing()
                        and self.observer.count_subscribers('tilt'), 'the graph is complete')
        self.place((*CENTER, EASY_HEIGHT))  # The brick may be anywhere.
        self.wait_until(follows_commands, 'the robot follows commands')
        self.recover()
        self.check_catch()


NUMBERS = [*(number / 2.0 for number in range(-2, 24)), nan, inf, -3e38, 1e-45]
FRAMES = ['world', 'odom', 'base_link', 'post', 'platform', 'brick', 'stem', 'wheel', 'foreign']
VALUES = {'boolean': [False, True], 'double': NUMBERS, 'float': NUMBERS,
          'string': [*FRAMES, '', '/platform', 'näme with blanks\n', '%s%n{}<robot/>',
                     'x' * 100_000]}
"""Possible random values for each field type."""


def fill_randomly(message: Any, random: Random) -> Any:
    for name, kind in message.get_fields_and_field_types().items():
        setattr(message, name, random_value(kind, random))
    return message


def random_value(kind: str, random: Random) -> Any:
    """Return a random value for a field type such as 'double[36]'."""
    if array := re.fullmatch(r'sequence<(.*)>|(.*)\[(\d+)\]', kind):
        count = array[3] or random.choice((0, 1, 1, 2, 4, 20))
        return [random_value(array[1] or array[2], random) for _ in range(int(count))]
    if kind == 'builtin_interfaces/Time':
        offset = random.choice((0, 0, 0, 0, -1, 1, 5, -3600, 3600, -1_700_000_000))
        return Time(nanoseconds=time_ns() + offset * NS_PER_SECOND).to_msg()
    if '/' in kind:
        return fill_randomly(load_type(kind.replace('/', '/msg/'))(), random)
    return random.choice(VALUES.get(kind, [*range(12), 127]))


def main(command: str = '', argument: str = '') -> None:
    if command == 'kills':
        os.environ.update(UDP)
        trials = [(Scene.check_fault, trial) for trial in product(NODES, FAULTS, STAGES)
                  if re.search(argument, ', '.join(trial))]
    elif command == 'messages':
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        trials = [(Scene.check_messages, (BATCH,))] * (int(argument or 20_000) // BATCH)
    else:
        sys.exit(__doc__)
    handle_interrupts()
    with reserved_domain() as domain_id, Scene(domain_id, Random(0)) as scene:
        scene.recover()
        for number, (check, trial) in enumerate(trials, 1):
            print(f'{number} of {len(trials)}: {trial}', flush=True)
            check(scene, *trial)
    print(f'{len(trials)} of {len(trials)} passed')


if __name__ == '__main__':
    main(*sys.argv[1:])
