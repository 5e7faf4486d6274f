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

from collections.abc import Callable, Sequence
import contextlib
from importlib import import_module
from importlib.util import find_spec
from math import cos, dist, inf, nan, pi, sin
import os
from pathlib import Path
from random import Random
import re
import signal
import sys
from tempfile import TemporaryDirectory
from time import monotonic, time_ns
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, Quaternion, Twist
from live_graph import LiveGraph, NodeProcess
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosidl_parser.definition import AbstractGenericString, AbstractNestedType, Array, BasicType
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformListener
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.driving import within_arena
from turtle_brick.core.geometry import Pose, rotate
from turtle_brick.core.parameters import default_path, load
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.ros.tf import AHEAD, latest, pose_of
from turtle_brick.tools.graph import executable, write_parameters
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtle_referee.domains import reserved_domain
from turtlesim.msg import Pose as TurtlePoseMessage
from visualization_msgs.msg import Marker, MarkerArray

PARAMETERS = load()
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)

OURS = ('turtle_robot', 'arena', 'catcher', *(['viewer'] if find_spec('viser') else []))
NODES = {'turtlesim': ('turtlesim', 'turtlesim_node'),
         'robot_state_publisher': ('robot_state_publisher', 'robot_state_publisher'),
         **{name: ('turtle_brick', name) for name in OURS}}

STAGES = ('idle', 'hovering', 'falling', 'carrying', 'tilting', 'leveling', 'floating',
          'unreachable')
BLOWS = {'kill': None, 'freeze 0.3': 0.3, 'freeze 2': 2.0}
"""What a node is dealt: None is an end by SIGKILL and a new start, a number the time (s)
between SIGSTOP and SIGCONT."""

RECOVERY = 30.0
"""How long (s) anything may take."""

START_TIME = 5.0
"""Time (s) after which a new process is known to all: DDS says each 3 s who there is, and what it
says at the start may be lost, chiefly on those who know a dead process by the same ports."""

EASY_HEIGHT, EASY_MARGIN = 4.5, 0.6
"""From which height (m) an easy brick falls, and how much nearer it is than what is promised."""

BATCH, PAUSE = 1000, 0.005
"""Messages between two easy bricks, and the time (s) between two of them."""

FLOOD = 10.0
"""Warnings per second of a node that are too many."""

BAD_WORDS = re.compile(r'Traceback|terminate called|Segmentation|core dumped|Exception ignored')
WARNING = re.compile(r'WARN|ERROR|FATAL')


class Fault(Exception):
    """Something did not go as it should; the text says what."""


class Scene:
    """The graph as processes, and somebody who sees and asks what anyone can."""

    def __init__(self, random: Random) -> None:
        """
        Start all nodes in a ROS domain of their own, and wait until they play together.

        :param random: where chance comes from
        """
        self.random = random
        self._stack = contextlib.ExitStack()
        self.domain_id = self._stack.enter_context(reserved_domain())
        self._files = Path(self._stack.enter_context(TemporaryDirectory(prefix='chaos_')))
        self.look()
        write_parameters(self._files / 'robot.yaml', self.live.robot_parameters())
        self.processes: dict[str, NodeProcess] = {}
        self.mark()
        try:
            for name in NODES:
                self.start(name)
            self.recover()
        except BaseException:
            self.close()
            raise

    def look(self) -> None:
        """Begin to look, with nothing heard."""
        self.live = live = LiveGraph(self.domain_id, quiet=True)
        self.buffer = Buffer()
        self.listener = TransformListener(self.buffer, live.listener)
        self.bricks = live.record('brick_marker', Marker, LATCHED)
        self.verdicts = live.record('catcher_marker', Marker)
        self.tilts = live.record('tilt', Tilt)
        self.goals = live.record('goal_pose', PoseStamped)
        self.slow = ''
        """What has not come as often as it should."""
        self.rates = {live.record('turtle1/pose', TurtlePoseMessage): 62.5,
                      live.record('turtle1/cmd_vel', Twist): 100.0,
                      live.record('odom', Odometry): 100.0,
                      live.record('joint_states', JointState): 100.0,
                      live.record_transforms('platform'): 100.0,
                      live.record_transforms('brick'): 250.0}

    def start(self, name: str) -> None:
        """Start a node."""
        arguments = {
            'turtlesim': ['-p', 'holonomic:=true'],
            'robot_state_publisher': ['--params-file', str(self._files / 'robot.yaml')],
            'turtle_robot': ['-r', 'cmd_vel:=turtle1/cmd_vel'],
            'viewer': ['-p', 'port:=0'],
        }.get(name, [])
        if name in OURS and name != 'viewer':
            arguments = [*arguments, '--params-file', str(default_path())]
        self.processes[name] = NodeProcess(
            [executable(*NODES[name]), '--ros-args', *arguments], self.domain_id)
        self._sure_at = monotonic() + START_TIME

    def close(self) -> None:
        """End everything."""
        for process in self.processes.values():
            process.kill()
        self.live.close()
        self._stack.close()

    # ------------------------------------------------------------------------ what is seen

    def mark(self) -> None:
        """Forget what the nodes have printed so far."""
        self._marked = monotonic()
        self._marks = {process: len(process.output) for process in self.processes.values()}

    def check(self) -> None:
        """Look for what has died, or prints what it shouldn't."""
        for name, process in self.processes.items():
            text = process.output[self._marks.get(process, 0):]
            if found := BAD_WORDS.search(text):
                raise Fault(f'{name} printed {text[found.start():][-500:]}')
            if not process.running:
                raise Fault(process.end_in_words())
            warnings = WARNING.findall(text)
            if name in OURS and len(warnings) > FLOOD * max(monotonic() - self._marked, 5.0):
                raise Fault(f'{name} warns all the time: {text[-500:]}')

    def until(self, condition: Callable[[], Any], what: str) -> None:
        """Let time pass until a condition holds, else raise a Fault."""
        def look() -> Any:
            self.check()
            return condition()

        try:
            self.live.wait_for(look, RECOVERY, what)
        except TimeoutError as error:
            raise Fault(
                f'{error}; {self.slow}; brick {self.phase} at {self.see("brick")}, platform '
                f'{self.see("platform")}, tilt {self.angle:g}, goal {self.goal}') from None

    def see(self, frame: str) -> Pose | None:
        """Return where a frame is in the world, None if that is not known."""
        found = latest(self.buffer, frame)
        return pose_of(found.transform) if found else None

    @property
    def place(self) -> tuple[float, float]:
        """Return where the platform is (m)."""
        platform = self.see('platform')
        return platform.position[:2] if platform else (inf, inf)

    @property
    def phase(self) -> str:
        """Return what the brick does."""
        return self.bricks.last.text if self.bricks.messages else 'unseen'

    @property
    def angle(self) -> float:
        """Return the angle that the platform is told to have (rad)."""
        return self.tilts.last.angle if self.tilts.messages else 0.0

    @property
    def goal(self) -> tuple[float, float]:
        """Return where the robot is sent at last (m)."""
        place = self.goals.last.pose.position if self.goals.messages else None
        return (place.x, place.y) if place else CENTER

    def is_level(self) -> bool:
        """Tell whether the platform is level, and is told to be so."""
        platform = self.see('platform')
        return (platform is not None and abs(self.angle) < 1e-6
                and rotate(platform.orientation, (0.0, 0.0, 1.0))[2] > 1.0 - 1e-6)

    def has_rates(self) -> bool:
        """Tell whether everything comes as often as it should, or nearly: machines are busy."""
        for recording in self.rates:
            recording.clear()
        begin = monotonic()
        self.live.pass_time(0.4)
        seconds = monotonic() - begin
        self.slow = ', '.join(
            f'{len(recording.messages) / seconds:.0f} of {rate:g} Hz'
            for recording, rate in self.rates.items()
            if len(recording.messages) < 0.6 * rate * seconds)
        return not self.slow

    def stands(self) -> bool:
        """Tell whether the robot stands still for a while."""
        before = self.place
        self.live.pass_time(0.3)
        return dist(before, self.place) < 1e-3

    def recover(self) -> None:
        """Wait until the graph is back, and no brick is under way on or to the platform."""
        self.until(self.has_rates, 'all rates')
        self.until(lambda: 'are in sight' in self.processes['catcher'].output,
                   'the catcher sees robot and brick')
        # What happens till then proves nothing: not a start, nor messages that say "in 1 s".
        self.live.pass_time(self._sure_at - monotonic())
        self.until(lambda: self.phase in ('hovering', 'floating', 'on the ground'),
                   'the brick off the platform')
        self.until(self.stands, 'the robot stands still')

    # ------------------------------------------------------------------------ what is done

    def ask(self, service: str, kind: type, request: Any, done: Callable[[], bool]) -> None:
        """Call a service until what it does is seen: answers may get lost in DDS."""
        def ask() -> bool:
            with contextlib.suppress(TimeoutError):
                self.live.call(service, kind, request, timeout=5.0)
            return done()

        self.until(ask, service)

    def put(self, x: float, y: float, z: float) -> None:
        """Have the brick hover somewhere (m)."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = x, y, z

        def is_there() -> bool:
            self.live.pass_time(0.3)
            brick = self.see('brick')
            return (self.phase == 'hovering' and brick is not None
                    and dist(brick.position, (x, y, z)) < 1e-3)

        self.ask('place', Place, request, is_there)

    def release(self, *place: float) -> None:
        """Put the brick somewhere (m), and let it go."""
        self.put(*place)
        for recording in (self.verdicts, self.tilts, self.goals):
            recording.clear()

        def is_gone() -> bool:
            self.live.pass_time(0.05)
            return self.phase != 'hovering'

        self.ask('drop', Trigger, Trigger.Request(), is_gone)

    def easy_place(self) -> tuple[float, float, float]:
        """Return where a brick may be released that is easily caught."""
        farthest = guaranteed_distance(EASY_HEIGHT, PARAMETERS) - EASY_MARGIN
        while True:
            distance, way = self.random.uniform(0.3, farthest), self.random.uniform(-pi, pi)
            place = (self.place[0] + distance * cos(way), self.place[1] + distance * sin(way))
            if within_arena(*place) == place:
                return (*place, EASY_HEIGHT)

    def play(self) -> None:
        """Drop an easy brick, and see it caught, carried to the center and tipped off."""
        self.release(*self.easy_place())
        self.until(lambda: self.phase in ('on the platform', 'on the ground', 'floating'),
                   'the easy brick is down')
        if self.verdicts.messages or self.phase == 'on the ground':
            raise Fault(f'an easy brick is {"refused" if self.verdicts.messages else "missed"}')
        self.until(lambda: self.phase == 'floating', 'the brick slides off')
        self.live.pass_time(0.1)  # What says where the platform is may be late.
        if dist(self.place, CENTER) > 0.05:
            raise Fault(f'the brick is tipped off at {self.place}, not in the center')
        self.until(self.is_level, 'the platform is level again')

    def go_to(self, stage: str) -> None:
        """Wait until a stage of the play is reached, with another brick."""
        if stage == 'hovering':
            self.put(*self.easy_place())
        elif stage == 'unreachable':
            x, y = max(((a, b) for a in (0.5, 10.5) for b in (0.5, 10.5)),
                       key=lambda corner: dist(corner, self.place))
            self.release(x, y, 3.0)
            self.until(lambda: self.verdicts.messages, '"Unreachable"')
        elif stage != 'idle':
            self.release(*self.easy_place())
            full = PARAMETERS.tilt_angle
            self.until({
                'falling': lambda: self.goals.messages,
                'carrying': lambda: self.phase != 'falling' and self.goal == CENTER,
                'tilting': lambda: self.angle > 0.3 * full,
                'leveling': lambda: self.phase == 'floating' and self.angle < 0.7 * full,
                'floating': lambda: self.phase == 'floating' and self.is_level(),
            }[stage], f'before the blow: {stage}')

    def deal(self, name: str, blow: float | None) -> None:
        """Kill a node and start it again, or let it stand still for some time (s)."""
        process = self.processes[name]
        if blow is None:
            process.kill()
            self.start(name)
        else:
            process.send(signal.SIGSTOP)
            self.live.pass_time(blow)
            process.send(signal.SIGCONT)

    def fire(self, count: int) -> None:
        """Send so many random messages and requests, as fast as users don't."""
        # What lingers in the spectator would be its own fault: it hears nothing, and begins anew.
        self.live.close()
        self.live = LiveGraph(self.domain_id, quiet=True)
        node, weights = self.live.listener, {'/tf': 5, '/tf_static': 2, 'place': 2}
        send = {topic: node.create_publisher(
            kind, topic, LATCHED if topic in ON_LATCHED else 100).publish
            for topic, kind in TOPICS.items()}
        send |= {service: node.create_client(kind, service).call_async
                 for service, kind in SERVICES.items()}
        self.live.pass_time(1.0)  # to be discovered
        names = self.random.choices(
            list(send), [weights.get(name, 1) for name in send], k=count)
        for name in names:
            send[name](random_message(name, self.random))
            self.live.pass_time(PAUSE)
            self.check()
        self.live.close()
        self.look()
        self._sure_at = monotonic() + AHEAD * 1e-9

    def calm_down(self) -> None:
        """Take the brick from wherever it was led, and level and center the robot."""
        self.until(self.has_rates, 'all rates')
        self.put(*CENTER, EASY_HEIGHT)
        self.recover()
        goal = PoseStamped()
        goal.header.frame_id = 'world'
        goal.pose.position.x, goal.pose.position.y = CENTER
        tilts = self.live.publisher('tilt', Tilt)
        goals = self.live.publisher('goal_pose', PoseStamped)

        def is_calm() -> bool:
            tilts.publish(Tilt(angle=0.0))
            goals.publish(goal)
            self.live.pass_time(0.5)
            return self.is_level() and dist(self.place, CENTER) < 0.05

        self.until(is_calm, 'the robot obeys')


# -------------------------------------------------------------------------- random messages

TOPICS = {'/tf': TFMessage, '/tf_static': TFMessage, 'goal_pose': PoseStamped, 'tilt': Tilt,
          'turtle1/pose': TurtlePoseMessage, 'turtle1/cmd_vel': Twist, 'odom': Odometry,
          'joint_states': JointState, 'brick_marker': Marker, 'catcher_marker': Marker,
          'walls': MarkerArray, 'robot_description': String}
SERVICES = {'place': Place, 'drop': Trigger}
ON_LATCHED = ('/tf_static', 'brick_marker', 'walls', 'robot_description')

FRAMES = ('world', 'odom', 'base_link', 'platform', 'brick', 'stem', 'wheel', 'post', 'foreign')
STRINGS = ('', '/platform', 'näme with blanks', 'Unreachable', '\n', '<robot/>', '%s%n{}',
           'x' * 100_000)
NUMBERS = (nan, inf, -inf, 3e38, -3e38, 1e-45, -0.0, 1e9)
BITS = {'uint8': (0, 2**8 - 1), 'int8': (-2**7, 2**7 - 1), 'uint32': (0, 2**32 - 1),
        'int32': (-2**31, 2**31 - 1)}


def random_message(name: str, random: Random) -> Any:
    """Return a message for a topic, or a request: some are sound, some have nothing right."""
    kind = TOPICS.get(name) or SERVICES[name].Request
    message = filled(kind, random, random.choice((0.0, 0.03, 0.3, 1.0)))
    if name.startswith('/tf'):
        for transform in message.transforms:
            if transform.child_frame_id.removeprefix('/') in ('odom', 'post'):
                # Of what is said on /tf_static once, tf2 believes for good who spoke last.
                transform.transform.translation.x = nan
    elif name == 'turtle1/cmd_vel':
        # After one that is not finite, turtlesim's pose is NaN for good, the real one's too.
        for vector in (message.linear, message.angular):
            vector.x, vector.y, vector.z = (
                random.choice((0.0, 1.0, -3.0, 1e308, -1e308, 5e-324)) for _ in range(3))
    elif name == 'joint_states':
        # The real robot_state_publisher dies of what is from before 1970.
        message.header.stamp.sec = max(message.header.stamp.sec, 0)
    return message


def filled(kind: type, random: Random, wildness: float) -> Any:
    """Return a message of a type, each value of which makes no sense with a probability."""
    wild = random.random() < wildness
    if kind is Time and not wild:
        offset = random.choice((0, 0, 0, -1, 1, 5, -3600, 3600)) * 10**9
        return Time(**dict(zip(('sec', 'nanosec'), divmod(time_ns() + offset, 10**9))))
    if kind is Quaternion and not wild:
        return random.choice((Quaternion(), Quaternion(), Quaternion(x=0.6, z=0.8, w=0.0)))
    message = kind()
    for name, slot in zip(message.get_fields_and_field_types(), kind.SLOT_TYPES):
        setattr(message, name, value_of(slot, random, wildness))
    return message


def value_of(slot: Any, random: Random, wildness: float) -> Any:
    """Return a value for a field of some type."""
    wild = random.random() < wildness
    if isinstance(slot, (Array, AbstractNestedType)):
        count = getattr(slot, 'size', None) or random.choice((0, 20) if wild else (1, 1, 2, 4))
        return [value_of(slot.value_type, random, wildness) for _ in range(count)]
    if isinstance(slot, AbstractGenericString):
        return random.choice(STRINGS if wild else FRAMES)
    if not isinstance(slot, BasicType):
        module = import_module('.'.join(slot.namespaces))
        return filled(getattr(module, slot.name), random, wildness)
    if slot.typename == 'boolean':
        return random.random() < 0.5
    if slot.typename in ('double', 'float'):
        return random.choice(NUMBERS) if wild else random.uniform(-1.0, 11.5)
    low, high = BITS[slot.typename]
    return random.choice((low, high)) if wild else random.randrange(max(low, 0), min(high, 12))


# ------------------------------------------------------------------------------- the trials

def kills(pattern: str) -> list[tuple[str, Callable[[Scene], None]]]:
    """Return a trial for each blow to each node at each stage whose name has a pattern."""
    def blow(scene: Scene, node: str, blow: str, stage: str) -> None:
        scene.go_to(stage)
        scene.deal(node, BLOWS[blow])
        scene.recover()
        scene.play()

    names = [(node, blow, stage) for node in NODES for blow in BLOWS for stage in STAGES]
    return [(', '.join(name), lambda scene, name=name: blow(scene, *name))
            for name in names if re.search(pattern, ', '.join(name))]


def messages(count: int) -> list[tuple[str, Callable[[Scene], None]]]:
    """Return a trial for each batch of so many random messages."""
    def fire(scene: Scene) -> None:
        scene.fire(BATCH)
        scene.calm_down()
        scene.play()

    return [(f'messages {begin} to {begin + BATCH}', fire) for begin in range(0, count, BATCH)]


def main(arguments: Sequence[str]) -> int:
    """Make the trials; after one that failed the next has a new graph."""
    what, how = [*arguments, ''][:2]
    if what not in ('kills', 'messages'):
        print(__doc__)
        return 2
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    scene, failed, random = None, 0, Random(0)
    trials = kills(how) if what == 'kills' else messages(int(how or 20_000))
    for name, trial in trials:
        begin = monotonic()
        try:
            scene = scene or Scene(random)
            scene.mark()
            trial(scene)
        except Fault as fault:
            failed += 1
            print(f'{name}: {fault}', flush=True)
            if scene:
                scene.close()
            scene = None
        else:
            print(f'{name}: ok after {monotonic() - begin:.1f} s', flush=True)
    if scene:
        scene.close()
    print(f'{len(trials)} trials, {failed} failed')
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
