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
to the center and tipped off. The status is 0 only if it did so each time.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from itertools import product
from math import cos, dist, inf, nan, pi, sin
import os
from random import Random
import re
import signal
import sys
from time import monotonic, time_ns
from typing import Any

from geometry_msgs.msg import Quaternion
from rclpy.node import Node
from rclpy.time import Time
from turtle_brick.core.parameters import load
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.ros.tf import AHEAD
from turtle_brick.tools.graph import Graph
from turtle_referee.constants import ARENA_SIZE, CENTER, NANO, NANOSECONDS
from turtle_referee.domains import reserved_domain
from turtle_referee.drops import DropWatch
from turtle_referee.geometry import inclination, Vector
from turtle_referee.hands import Hands
from turtle_referee.observer import how_to_hear, load_type, Observer
from turtle_referee.processes import Process
from turtle_referee.spinning import note_interrupts

PARAMETERS = load()

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

STAGES = ('idle', 'hovering', 'falling', 'carrying', 'tilting', 'leveling', 'floating',
          'unreachable')

RATES = {'pose': 62.5, 'cmd_vel': 100.0, 'odom': 100.0, 'joint_states': 100.0,
         'platform': 100.0, 'brick': 250.0}
"""How often (Hz) topics and frames are heard of."""

PART, SPAN = 0.6, 0.4
"""Which part of that is enough on a busy machine, and in what time (s)."""

RECOVERY = 30.0
"""How long (s) anything may take."""

START_TIME = 1.5 if 'FASTRTPS_DEFAULT_PROFILES_FILE' in os.environ else 5.0
"""Time (s) after which a new process is known to all: DDS says each 3 s who there is, each 0.3 s
with our profile, and what it says at the start may be lost, chiefly on those who know a dead
process by the same ports."""

EASY_HEIGHT, EASY_MARGIN = 8.0, 1.5
"""From which height (m) an easy brick falls, and how much nearer it is than what is promised."""

HOPELESS_HEIGHT = 12.0
"""From where (m) a brick falls too soon for a robot 7 m away. A fall from less may be over before
a busy machine has seen it, and is then refused by nobody."""

BATCH, PAUSE = 1000, 0.005
"""Messages between two easy bricks, and the time (s) between two of them."""

FLOOD = 10.0
"""Warnings per second of a node that are too many."""


class Fault(Exception):
    """Something did not go as it should; the text says what."""


class Scene(Graph):
    """The graph as processes, and somebody who sees and asks what anyone can."""

    def __init__(self, domain_id: int, random: Random, names: Iterable[str] = NODES) -> None:
        """
        Start nodes.

        :param domain_id: the ROS domain they are in
        :param random: where chance comes from
        :param names: of the nodes
        """
        super().__init__(domain_id)
        self.random = random
        self.description = self.parameter_file(self.robot_parameters())
        self.processes: dict[str, Process] = {}
        for name in names:
            self.start(name)

    def start(self, name: str) -> None:
        """Start a node."""
        package, executable, *arguments = NODES[name]
        for file in (self.params_file, self.description):
            arguments += ['--params-file', str(file)]
        self.processes[name] = self.add_process(
            package, executable, '--ros-args', *arguments, listener=lambda line: None)
        self.known_at = monotonic() + START_TIME

    # ------------------------------------------------------------------------ what is seen

    def look(self) -> None:
        """Begin anew to look, with nothing heard or printed so far, and wait until all speak."""
        for node in list(self.nodes):
            self.remove(node)
        self.observer = self.add(Observer, parameters=False)
        self.record = self.observer.record
        self.hands = Hands(self, self.observer)
        self.begin = monotonic()
        self.printed = {process: len(process.output) for process in self.processes.values()}
        self.until(lambda: not self.slow(), 'all rates')

    def check(self) -> None:
        """Look for what has died, or prints what it shouldn't."""
        for name, process in self.processes.items():
            text = process.output[self.printed.get(process, 0):]
            if found := re.search('Traceback|terminate called|Exception ignored', text):
                raise Fault(f'{name} printed {text[found.start():][-500:]}')
            if not process.running:
                raise Fault(process.end_in_words())
            warnings = len(re.findall('WARN|ERROR|FATAL', text))
            if 'turtle_brick' in NODES[name] and (
                    warnings > FLOOD * max(monotonic() - self.begin, 5.0)):
                raise Fault(f'{name} warns all the time: {text[-500:]}')

    def until(self, condition: Callable[[], Any], what: str) -> None:
        """Let time pass until a condition holds, else raise a Fault."""
        def look() -> Any:
            self.check()
            return condition()

        try:
            self.spin_until(look, RECOVERY, what)
        except TimeoutError as error:
            raise Fault(f'{error}; the robot is at {self.hands.robot()}, the brick {self.phase}; '
                        f'too slow: {self.slow() or "nothing"}') from None

    def slow(self) -> str:
        """Say what does not come as often as it should; nothing if all does."""
        # Not up to now: what a busy machine fetches late does not come late.
        begin = self.observer.fetched_at - round(SPAN * NANOSECONDS)
        counts = {name: len(frame.heard(begin)) for name, frame in self.record.frames.items()}
        counts |= {name: len(self.record.heard(name, begin)) for name in self.record.topics}
        return ', '.join(f'{name} {counts.get(name, 0) / SPAN:.0f} of {rate:g} Hz'
                         for name, rate in RATES.items()
                         if counts.get(name, 0) < PART * rate * SPAN)

    @property
    def phase(self) -> str:
        """Return what the brick does."""
        return next((heard.marker.text for heard in reversed(self.record.markers)
                     if heard.topic == '/brick_marker'), 'unseen')

    def is_level(self, angle: float = 1e-3) -> bool:
        """Tell whether the platform is inclined by less than an angle (rad)."""
        platform = self.record.platform(time_ns())
        return platform is not None and inclination(platform) < angle

    def recover(self) -> None:
        """Wait until the graph is back, and no brick is under way on or to the platform."""
        # What happens till then proves nothing.
        self.spin_for(self.known_at - monotonic())
        self.until(lambda: not self.slow(), 'all rates')
        self.until(lambda: 'are in sight' in self.processes['catcher'].output,
                   'the catcher sees robot and brick')
        self.until(lambda: self.phase in ('hovering', 'floating', 'on the ground'),
                   'the brick off the platform')
        self.until(self.hands.is_at_rest, 'the robot stands still')

    # ------------------------------------------------------------------------ what is done

    def put(self, place: Vector) -> None:
        """Have the brick hover somewhere (m): asked until it is seen, as answers may get lost."""
        def is_there() -> bool:
            self.hands.place(place, hovering=0.3)
            brick = self.record.brick(time_ns())
            return (self.phase == 'hovering' and brick is not None
                    and dist(brick.position, place) < 1e-3)

        self.until(is_there, 'place')

    def release(self, place: Vector) -> DropWatch:
        """Put the brick somewhere (m), let it go, and watch it from then on."""
        self.put(place)
        watch = DropWatch(self.record, time_ns(), place, self.record.platform(time_ns()))
        watch.asked = watch.begin
        self.observer.on_news = watch.look
        self.until(lambda: self.hands.ask('drop') and watch.released, 'drop')
        return watch

    def easy_place(self) -> Vector:
        """Return where a brick may be released that is easily caught."""
        x, y = self.hands.robot()
        farthest = guaranteed_distance(EASY_HEIGHT, PARAMETERS) - EASY_MARGIN
        while True:
            distance, way = self.random.uniform(0.3, farthest), self.random.uniform(-pi, pi)
            place = (x + distance * cos(way), y + distance * sin(way), EASY_HEIGHT)
            if 0.0 < min(place[:2]) and max(place[:2]) < ARENA_SIZE:
                return place

    def play(self) -> None:
        """Drop an easy brick, and see it caught, carried to the center and tipped off."""
        watch = self.release(self.easy_place())
        self.until(lambda: watch.down, 'the easy brick is down')
        if watch.refusals or not watch.caught:
            raise Fault(f'an easy brick is {"refused" if watch.refusals else "missed"}')
        self.until(lambda: watch.floated, 'the brick slides off')
        if self.hands.distance_to(CENTER) > 0.05:
            raise Fault(f'the brick is tipped off at {self.hands.robot()}, not in the center')
        self.until(lambda: watch.leveled, 'the platform is level again')

    def go_to(self, stage: str) -> None:
        """Wait until a stage of the play is reached, with another brick."""
        if stage == 'hovering':
            self.put(self.easy_place())
        elif stage != 'idle':
            edges = (0.5, ARENA_SIZE - 0.5)
            far = max(product(edges, edges), key=self.hands.distance_to)
            watch = self.release((*far, HOPELESS_HEIGHT) if stage == 'unreachable'
                                 else self.easy_place())
            self.until({
                'falling': lambda: watch.goal,
                'carrying': lambda: watch.caught,
                'tilting': lambda: watch.tilted,
                'leveling': lambda: (self.phase == 'floating'
                                     and self.is_level(0.7 * PARAMETERS.tilt_angle)),
                'floating': lambda: watch.leveled,
                'unreachable': lambda: watch.refusals,
            }[stage], f'before the blow: {stage}')

    def deal(self, name: str, blow: float | None) -> None:
        """Kill a node and start it again, or let it stand still for some time (s)."""
        process = self.processes[name]
        if blow is None:
            process.kill()
            self.start(name)
        else:
            process.send(signal.SIGSTOP)
            try:
                self.spin_for(blow)
            finally:
                process.send(signal.SIGCONT)

    def fire(self, count: int) -> None:
        """Send so many random messages and requests, as fast as users don't."""
        gun = self.add(Node, parameters=False, node_name='gun')
        topics = {name: load_type(kinds[0]) for name, kinds in gun.get_topic_names_and_types()
                  # a part that begins with _ is hidden: turtlesim's actions
                  if name not in ('/rosout', '/parameter_events') and '/_' not in name}
        services = {name: load_type(kinds[0]) for name, kinds in gun.get_service_names_and_types()
                    if name in ('/place', '/drop')}
        # Who speaks to late joiners, too, is heard by everybody.
        guns = {name: gun.create_publisher(kind, name, how_to_hear(latched=True))
                for name, kind in topics.items()}
        shots = [(name, kind, guns[name].publish) for name, kind in topics.items()]
        shots += [(name, kind.Request, gun.create_client(kind, name).call_async)
                  for name, kind in services.items()]
        self.until(lambda: all(one.get_subscription_count() == gun.count_subscribers(name)
                               for name, one in guns.items())
                   and all(client.service_is_ready() for client in gun.clients), 'all hear')
        weights = {'/tf': 5, '/tf_static': 2, '/place': 2}
        for name, kind, send in self.random.choices(
                shots, [weights.get(name, 1) for name, *_ in shots], k=count):
            send(random_message(name, kind(), self.random))
            self.spin_for(PAUSE)
            self.check()
        self.remove(gun)
        self.spin_for(AHEAD * NANO)  # which a message may be ahead
        self.look()

    def calm_down(self) -> None:
        """Take the brick from wherever it was led, and level and center the robot."""
        def is_calm() -> bool:
            self.observer.send_tilt(0.0)
            self.observer.send_goal(*CENTER)
            self.spin_for(0.5)
            return self.is_level() and self.hands.distance_to(CENTER) < 0.05

        self.put((*CENTER, EASY_HEIGHT))
        self.until(is_calm, 'the robot obeys')

    # -------------------------------------------------------------------------- the trials

    def stand_blow(self, node: str, blow: str, stage: str) -> None:
        """See that the graph comes back after one of BLOWS to a node at one of STAGES."""
        self.go_to(stage)
        self.deal(node, BLOWS[blow])
        self.recover()
        self.play()

    def stand_fire(self, count: int) -> None:
        """See that the graph comes back after so many random messages."""
        self.fire(count)
        self.calm_down()
        self.recover()
        self.play()


# -------------------------------------------------------------------------- random messages

NUMBERS = (nan, inf, -inf, 3e38, -3e38, 1e-45, -0.0, 1e9)
WILD = {'boolean': (False, True), 'double': NUMBERS, 'float': NUMBERS,
        'uint8': (0, 2**8 - 1), 'int8': (-2**7, 2**7 - 1), 'uint32': (0, 2**32 - 1),
        'int32': (-2**31, 2**31 - 1),
        'string': ('', '/platform', 'näme with blanks', 'Unreachable', '\n', '<robot/>',
                   '%s%n{}', 'x' * 100_000)}
FRAMES = ('world', 'odom', 'base_link', 'platform', 'brick', 'stem', 'wheel', 'post', 'foreign')
LENGTHS = [number / 2.0 for number in range(-2, 24)]
SOUND = {'boolean': (False, True), 'double': LENGTHS, 'float': LENGTHS, 'string': FRAMES}
"""Values of a type that make sense; those of whole numbers are 0 to 11."""


def random_message(name: str, message: Any, random: Random) -> Any:
    """Fill a message for a topic, or a request: some are sound, some have nothing right."""
    fill(message, random, random.choice((0.0, 0.03, 0.3, 1.0)))
    if name.startswith('/tf'):
        for transform in message.transforms:
            if transform.child_frame_id.removeprefix('/') in ('odom', 'post'):
                # Of what is said on /tf_static once, tf2 believes for good who spoke last.
                transform.transform.translation.x = nan
    elif name == '/turtle1/cmd_vel':
        # After one that is not finite, turtlesim's pose is NaN for good, the real one's too.
        for vector in (message.linear, message.angular):
            vector.x, vector.y, vector.z = (
                random.choice((0.0, 1.0, -3.0, 1e308, -1e308, 5e-324)) for _ in range(3))
    elif name == '/joint_states':
        # The real robot_state_publisher dies of what is from before 1970.
        message.header.stamp.sec = max(message.header.stamp.sec, 0)
    return message


def fill(message: Any, random: Random, wildness: float) -> Any:
    """Give a message values, each of which makes no sense with a probability; return it."""
    for name, kind in message.get_fields_and_field_types().items():
        setattr(message, name, value_of(kind, random, wildness))
    return message


def value_of(kind: str, random: Random, wildness: float) -> Any:
    """Return a value of a type as messages call it: 'double[36]', 'sequence<std_msgs/Header>'."""
    wild = random.random() < wildness
    if several := re.fullmatch(r'sequence<(.*)>|(.*)\[(\d+)\]', kind):
        count = several[3] or random.choice((0, 20) if wild else (1, 1, 2, 4))
        return [value_of(several[1] or several[2], random, wildness) for _ in range(int(count))]
    if kind == 'builtin_interfaces/Time' and not wild:
        offset = random.choice((0, 0, 0, -1, 1, 5, -3600, 3600))
        return Time(nanoseconds=time_ns() + offset * NANOSECONDS).to_msg()
    if kind == 'geometry_msgs/Quaternion' and not wild:
        return random.choice((Quaternion(), Quaternion(), Quaternion(x=0.6, z=0.8, w=0.0)))
    if '/' in kind:
        return fill(load_type(kind.replace('/', '/msg/'))(), random, wildness)
    return random.choice(WILD[kind] if wild else SOUND.get(kind, range(12)))


def trials(what: str, how: str) -> Iterator[tuple[str, Callable[[Scene], None]]]:
    """Yield the trials that are asked for: a name, and what the scene has to stand."""
    if what == 'kills':
        for node, blow, stage in product(NODES, BLOWS, STAGES):
            if re.search(how, name := f'{node}, {blow}, {stage}'):
                yield name, partial(Scene.stand_blow, node=node, blow=blow, stage=stage)
    else:
        for begin in range(0, int(how or 20_000), BATCH):
            yield f'messages {begin} to {begin + BATCH}', partial(Scene.stand_fire, count=BATCH)


def main(arguments: Sequence[str]) -> int:
    """Make the trials that are asked for; after one that failed the next has a new graph."""
    what, how = [*arguments, ''][:2]
    if what not in ('kills', 'messages'):
        print(__doc__)
        return 2
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    note_interrupts()  # SIGTERM too: each scene ends its processes
    scene, passed, failed, random = None, 0, 0, Random(0)
    with reserved_domain() as domain_id, ExitStack() as cleanup:
        for name, trial in trials(what, how):
            begin = monotonic()
            scene = scene or cleanup.enter_context(Scene(domain_id, random))
            try:
                scene.look()
                scene.recover()
                trial(scene)
                passed += 1
                print(f'{name}: ok after {monotonic() - begin:.1f} s', flush=True)
            except Fault as fault:
                print(f'{name}: {fault}', flush=True)
                cleanup.close()
                scene, failed = None, failed + 1
    print(f'{passed} of {passed + failed}')
    return 1 if failed else 0


if __name__ == '__main__':
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit('interrupted')
