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
The graph under fire: nodes killed and frozen, and random messages.

    python3 turtle_brick/test/chaos.py kills [PATTERN]    each node x kill or freeze x stage
    python3 turtle_brick/test/chaos.py messages [COUNT]   on each topic and service

The nodes run as processes of their own, and are seen from outside. After each blow, or a thousand
messages, the graph has to come back by itself, and the next easy brick has to be caught, carried
to the center and tipped off. The first trial in which it did not ends the program with a status
that is not 0.
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
from turtle_brick.core.latency import MEMORY
from turtle_brick.ros.tf import MAX_AHEAD_NS
from turtle_brick.tools.graph import Graph
from turtle_referee.graph_client.client import GraphClient
from turtle_referee.graph_client.constants import ARENA_SIZE, CENTER, SECONDS_PER_NS, NS_PER_SECOND
from turtle_referee.graph_client.domains import reserved_domain
from turtle_referee.graph_client.drops import DropWatch
from turtle_referee.graph_client.geometry import inclination, Vector
from turtle_referee.graph_client.observer import subscription_qos, load_type, Observer
from turtle_referee.graph_client.processes import Process
from turtle_referee.graph_client.spinning import handle_interrupts

NODES = {
    'turtlesim': ('turtlesim', 'turtlesim_node', '-p', 'holonomic:=true'),
    'robot_state_publisher': ('robot_state_publisher', 'robot_state_publisher'),
    'turtle_robot': ('turtle_brick', 'turtle_robot', '-r', 'cmd_vel:=turtle1/cmd_vel'),
    'arena': ('turtle_brick', 'arena'),
    'catcher': ('turtle_brick', 'catcher'),
    **({'viewer': ('turtle_brick', 'viewer', '-p', 'port:=0')} if find_spec('viser') else {}),
}
"""Each node's package, executable and arguments."""

BLOWS = {'kill': None, 'freeze 0.3': 0.3, 'freeze 2': 2.0}
"""What a node is dealt: None is an end by SIGKILL and a new start, a number the time (s)
between SIGSTOP and SIGCONT."""

STAGES: dict[str, Callable[[Any, DropWatch], Any]] = {
    'idle': lambda scene, watch: True,
    'hovering': lambda scene, watch: True,
    'falling': lambda scene, watch: watch.goal,
    'carrying': lambda scene, watch: watch.caught,
    'tilting': lambda scene, watch: watch.tilted,
    'leveling': lambda scene, watch: scene.phase == 'floating' and scene.is_level(0.5),
    'floating': lambda scene, watch: watch.leveled,
    'unreachable': lambda scene, watch: watch.refusals,
}
"""When each is reached, by the scene and the last drop."""

RECOVERY = 60.0
"""How long (s) anything may take."""

START_TIME = 1.5 if 'FASTRTPS_DEFAULT_PROFILES_FILE' in os.environ else 5.0
"""Time (s) after which a new process is known to all: DDS says each 3 s who there is, each 0.3 s
with our profile, and what it says at the start may be lost."""

EASY_HEIGHT, EASY_REACH, HOPELESS_HEIGHT = 8.0, 2.0, 12.0
"""From where bricks fall (m), and how far an easy one is from the robot (m) at most. A hopeless
one is far away, and falls so long that a busy machine sees it."""

BATCH, PAUSE = 1000, 0.005
"""Messages between two easy bricks, and the time (s) between two of them."""

SPARED = ('/rosout', '/parameter_events', '/turtle1/cmd_vel', '/joint_states')
"""What is not fired at: turtlesim's pose stays NaN for good after one, and of a stamp before 1970
robot_state_publisher dies, the real ones too."""


class Scene(Graph):
    """The graph as processes, and somebody who sees and asks what anyone can."""

    def __init__(self, domain_id: int, random: Random, names: Iterable[str] = NODES) -> None:
        """Start nodes in a ROS domain; what comes by chance comes from `random`."""
        super().__init__(domain_id)
        self.random = random
        self.parameters = (self.params_file, self.parameter_file(self.robot_parameters()))
        self.processes: dict[str, Process] = {}
        for name in names:
            self.start(name)

    def start(self, name: str) -> None:
        """Start a node."""
        package, executable, *arguments = NODES[name]
        for file in self.parameters:
            arguments += ['--params-file', str(file)]
        self.processes[name] = self.add_process(
            package, executable, '--ros-args', *arguments, listener=lambda line: None)
        self.known_at = monotonic() + START_TIME

    def look(self) -> None:
        """Begin anew to look, with nothing heard so far."""
        for node in list(self.nodes):
            self.remove(node)
        self.observer = self.add(Observer, parameters=False)
        self.record = self.observer.record
        self.client = GraphClient(self, self.observer)

    def until(self, condition: Callable[[], Any], what: str) -> None:
        """Let time pass until a condition holds, while every node lives."""
        def look() -> Any:
            for process in self.processes.values():
                assert process.running, process.exit_message()
                assert 'Traceback' not in process.output, process.output[-500:]
            return condition()

        self.spin_until(look, RECOVERY, what)

    @property
    def phase(self) -> str:
        """Return what the brick does."""
        return next((heard.marker.text for heard in reversed(self.record.markers)
                     if heard.topic == '/brick_marker'), 'unseen')

    def is_level(self, tolerance: float) -> bool:
        """Tell whether the platform is inclined by less than an angle (rad)."""
        platform = self.record.platform(time_ns())
        return platform is not None and inclination(platform) < tolerance

    def recover(self) -> None:
        """Wait until the graph is back, and no brick is under way on or to the platform."""
        self.spin_for(self.known_at - monotonic())  # what happens till then proves nothing
        self.look()
        self.until(lambda: self.client.is_complete() and self.client.is_at_rest()
                   and 'are in sight' in self.processes['catcher'].output
                   and self.phase in ('hovering', 'floating', 'grounded'),
                   'all speak, the robot rests, and the brick is off the platform')

    def put(self, place: Vector) -> None:
        """Have the brick hover somewhere (m): asked again where an answer gets lost."""
        self.until(lambda: self.client.place(place, hovering=0.3).accepted, 'place')

    def release(self, place: Vector) -> DropWatch:
        """Put the brick somewhere (m), let it go, and watch it from then on."""
        self.put(place)
        watch = DropWatch(self.record, time_ns(), place, self.record.platform(time_ns()))
        watch.asked = watch.begin
        self.observer.after_fetch = watch.look
        self.until(lambda: self.client.ask('drop') and watch.released, 'drop')
        return watch

    def easy_place(self) -> Vector:
        """Return where a brick may be released that is easily caught."""
        while True:
            x, y = (self.random.uniform(0.0, ARENA_SIZE) for _ in range(2))
            if 0.3 < self.client.distance_to((x, y)) < EASY_REACH:
                return x, y, EASY_HEIGHT

    def play(self, blow: float | None = None) -> None:
        """
        Drop an easy brick, and see it caught, carried to the center and tipped off.

        :param blow: by when (s) a node had died or stood still, if one has. For MEMORY the catcher
            reckons with the delays that it saw: after it, another one is dropped for one refused.
        """
        watch = self.release(self.easy_place())
        self.until(lambda: watch.down, 'the easy brick is down')
        if watch.refusals and blow is not None:
            self.spin_for(blow + MEMORY - monotonic())
            return self.play()
        assert watch.caught and not watch.refusals, 'an easy brick is refused or missed'
        self.until(lambda: watch.floated, 'the brick slides off')
        assert self.client.distance_to(CENTER) < 0.05, 'it is tipped off elsewhere'
        self.until(lambda: watch.leveled, 'the platform is level again')

    def go_to(self, stage: str) -> None:
        """Wait until a stage of the play is reached, with another brick."""
        if stage == 'hovering':
            self.put(self.easy_place())
        elif stage != 'idle':
            edges = (0.5, ARENA_SIZE - 0.5)
            far = max(product(edges, edges), key=self.client.distance_to)
            watch = self.release((*far, HOPELESS_HEIGHT) if stage == 'unreachable'
                                 else self.easy_place())
            self.until(lambda: STAGES[stage](self, watch), f'before the blow: {stage}')

    def deal(self, name: str, blow: float | None) -> None:
        """Kill a node and start it again, or let it stand still for some time (s)."""
        process = self.processes[name]
        if blow is None:
            process.kill()
            self.start(name)
        else:
            process.send(signal.SIGSTOP)
            self.spin_for(blow)
            process.send(signal.SIGCONT)

    def stand_blow(self, node: str, blow: str, stage: str) -> None:
        """See that the graph comes back after one of BLOWS to a node at one of STAGES."""
        self.go_to(stage)
        self.deal(node, BLOWS[blow])
        self.recover()
        self.play(monotonic())

    def stand_fire(self, count: int) -> None:
        """See that the graph comes back after so many random messages, faster than any user's."""
        def is_calm() -> bool:
            self.observer.send_tilt(0.0)
            self.observer.send_goal(*CENTER)
            self.spin_for(0.5)
            return self.is_level(1e-3) and self.client.distance_to(CENTER) < 0.05

        gun = self.add(Node, parameters=False, node_name='gun')
        # Who speaks to late joiners, too, is heard by everybody. A part that begins with _ is
        # hidden: turtlesim's actions.
        guns = [gun.create_publisher(load_type(kinds[0]), name, subscription_qos(latched=True))
                for name, kinds in gun.get_topic_names_and_types()
                if name not in SPARED and '/_' not in name]
        clients = [self.observer.client(name) for name in ('place', 'drop')]
        self.until(lambda: all(each.get_subscription_count() == gun.count_subscribers(
            each.topic_name) for each in guns), 'all hear')
        shots = [(each.publish, each.msg_type) for each in guns]
        shots += [(client.call_async, client.srv_type.Request) for client in clients]
        for send, kind in self.random.choices(shots, k=count):
            send(filled(kind(), self.random))
            self.spin_for(PAUSE)
        self.remove(gun)
        self.spin_for(MAX_AHEAD_NS * SECONDS_PER_NS)  # which a message may be ahead
        self.look()
        self.until(lambda: self.client.is_complete()
                   and self.observer.count_subscribers('tilt'), 'all are there')
        self.put((*CENTER, EASY_HEIGHT))  # away from wherever it was led
        self.until(is_calm, 'the robot obeys')
        self.recover()
        self.play()


# -------------------------------------------------------------------------- random messages

NUMBERS = [*(number / 2.0 for number in range(-2, 24)), nan, inf, -3e38, 1e-45]
# Not odom and post: of what is said on /tf_static once, tf2 believes for good who spoke last.
FRAMES = ['world', 'base_link', 'platform', 'brick', 'stem', 'wheel', 'foreign']
VALUES = {'boolean': [False, True], 'double': NUMBERS, 'float': NUMBERS,
          'string': [*FRAMES, '', '/platform', 'näme with blanks\n', '%s%n{}<robot/>',
                     'x' * 100_000]}
"""What is said of a type, most of which makes sense."""


def filled(message: Any, random: Random) -> Any:
    """Give a message random values, and return it."""
    for name, kind in message.get_fields_and_field_types().items():
        setattr(message, name, value_of(kind, random))
    return message


def value_of(kind: str, random: Random) -> Any:
    """Return a value of a type as messages call it: 'double[36]', 'sequence<std_msgs/Header>'."""
    if several := re.fullmatch(r'sequence<(.*)>|(.*)\[(\d+)\]', kind):
        count = several[3] or random.choice((0, 1, 1, 2, 4, 20))
        return [value_of(several[1] or several[2], random) for _ in range(int(count))]
    if kind == 'builtin_interfaces/Time':
        offset = random.choice((0, 0, 0, 0, -1, 1, 5, -3600, 3600, -1_700_000_000))
        return Time(nanoseconds=time_ns() + offset * NS_PER_SECOND).to_msg()
    if '/' in kind:
        return filled(load_type(kind.replace('/', '/msg/'))(), random)
    return random.choice(VALUES.get(kind, [*range(12), 127]))


# ------------------------------------------------------------------------------ the program

def main(what: str = '', how: str = '') -> None:
    """Make the trials that are asked for, up to the first that fails."""
    if what == 'kills':
        trials = [(Scene.stand_blow, trial) for trial in product(NODES, BLOWS, STAGES)
                  if re.search(how, ', '.join(trial))]
    elif what == 'messages':
        trials = [(Scene.stand_fire, (BATCH,))] * (int(how or 20_000) // BATCH)
    else:
        sys.exit(__doc__)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    handle_interrupts()  # SIGTERM too: the scene ends its processes
    with reserved_domain() as domain_id, Scene(domain_id, Random(0)) as scene:
        scene.recover()
        for number, (stand, trial) in enumerate(trials, 1):
            print(f'{number} of {len(trials)}: {trial}', flush=True)
            stand(scene, *trial)
    print(f'{len(trials)} of {len(trials)} stood')


if __name__ == '__main__':
    main(*sys.argv[1:])
