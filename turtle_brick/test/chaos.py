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
The graph under fire: nodes killed and frozen, random messages, and a long day of drops.

    python3 turtle_brick/test/chaos.py kills      every node x every stage x kill -9, freezes
    python3 turtle_brick/test/chaos.py messages   random messages on every topic and service
    python3 turtle_brick/test/chaos.py soak       a drop every 4 s for half an hour

The nodes run as processes of their own. What becomes of them is seen from outside: through
topics, services and TF, in what they print, and in /proc. After each blow the graph has to come
back by itself, and the next easy brick has to be caught, carried to the center and tipped off.
The status is 0 only if it did so each time.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
import contextlib
from dataclasses import asdict, dataclass
import json
from math import cos, dist, pi, sin
import os
from pathlib import Path
from random import Random
import re
import signal
import sys
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any

from chaos_messages import FORESIGHT, Injector
from chaos_soak import soak
from geometry_msgs.msg import PoseStamped, Twist
from live_graph import NodeProcess
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from steadiness import STALL
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException, TransformListener
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.driving import within_arena
from turtle_brick.core.geometry import Pose, rotate
from turtle_brick.core.parameters import default_path, load
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.physics import Phase
from turtle_brick.tools.interrupts import INTERRUPTS
from turtle_brick.ros.tf import pose_of
from turtle_brick.tools.graph import executable, Graph
from turtle_brick.view.display import phase_of
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtle_referee.domains import reserved_domain
from turtle_referee.stalls import StallWatch
from turtlesim.msg import Pose as TurtlePose
from visualization_msgs.msg import Marker
import yaml

PARAMETERS = load()

OURS = ('turtle_robot', 'arena', 'catcher', 'viewer')
NODES = {'turtlesim': ('turtlesim', 'turtlesim_node'),
         'robot_state_publisher': ('robot_state_publisher', 'robot_state_publisher'),
         **{name: ('turtle_brick', name) for name in OURS}}

RATES = {'turtle1/pose': 62.5, 'turtle1/cmd_vel': 100.0, 'odom': 100.0, 'joint_states': 100.0,
         'base_link': 100.0, 'platform': 100.0, 'brick': 250.0}
"""Of topics and frames (Hz)."""

STAGES = ('idle', 'hovering', 'falling', 'carrying', 'tilting', 'leveling', 'floating',
          'unreachable')
BLOWS = {'kill': None, 'freeze 0.3': 0.3, 'freeze 2': 2.0}
"""What a node is dealt: None is an end by SIGKILL and a new start, a number the time (s)
between SIGSTOP and SIGCONT."""

GLANCE = 0.01
"""How often (s) a condition is looked at."""

UP_TIME = 30.0
"""How long (s) the graph may take to come up."""

RECOVERY = 25.0
"""How long (s) after a blow the graph may take to be at rest again, without a brick on it."""

DISCOVERY = 3.5
"""Time (s) after which a new process is known to all: DDS says each 3 s who there is, and what it
says at the start may be lost, chiefly on those who know a dead process by the same ports."""

STARTING = 1.5
"""How long (s) a node takes to start."""

PLAY_TIME = 20.0
"""How long (s) each part of catching, carrying and tipping off may take."""

EASY_HEIGHT = 4.5
"""From which an easy brick falls (m)."""

EASY_MARGIN = 0.6
"""How much nearer (m) it is than what is promised."""

CALL_TIME = 10.0
"""How long (s) it may take until what a service was asked for is seen."""

FAR = 100.0
"""How far (m) from the origin a brick takes too long to come down."""

FLOOD = 10.0
"""Warnings per second of a node that are too many."""

BAD_WORDS = re.compile(r'Traceback|terminate called|Segmentation|core dumped|Exception ignored')
WARNING = re.compile(r'WARN|ERROR|FATAL')

INJECTION = 200
"""Messages per second."""

BATCH = 1000
"""Messages between two easy bricks."""


class Fault(Exception):
    """Something did not go as it should; the text says what."""


class CountingListener(TransformListener):
    """A TransformListener that counts the transforms to each frame."""

    counts: Counter[str] = Counter()

    def callback(self, data: TFMessage) -> None:
        """Take in a message of /tf."""
        self.counts.update(transform.child_frame_id for transform in data.transforms)
        super().callback(data)


class Spectator(Node):
    """See what anyone can see of the graph, and ask of it what anyone can ask."""

    def __init__(self, **node_options: Any) -> None:
        """Begin to look."""
        super().__init__('spectator', **node_options)
        self.counts: Counter[str] = Counter()
        self.phase: Phase | None = None
        self.angle = 0.0
        self.tilts = 0
        """How often the platform has begun to tilt: a busy machine may tell of it afterwards."""
        self.sent: list[tuple[float, float]] = [CENTER]
        """Where the robot has been sent, one after another."""
        self.verdicts = 0
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for kind, topic in ((TurtlePose, 'turtle1/pose'), (Twist, 'turtle1/cmd_vel'),
                            (Odometry, 'odom'), (JointState, 'joint_states')):
            self.create_subscription(
                kind, topic, lambda _, topic=topic: self.counts.update((topic,)), 100, raw=True)
        self.create_subscription(Marker, 'brick_marker', self.on_brick, latched)
        self.create_subscription(Marker, 'catcher_marker', self.on_verdict, 10)
        self.create_subscription(Tilt, 'tilt', self.on_tilt, 100)
        self.create_subscription(PoseStamped, 'goal_pose', self.on_goal, 10)
        self.goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self.tilt_publisher = self.create_publisher(Tilt, 'tilt', 10)
        self.place_client = self.create_client(Place, 'place')
        self.drop_client = self.create_client(Trigger, 'drop')
        self.buffer = Buffer(node=self)
        self.listener = CountingListener(self.buffer, self)
        self.listener.counts = self.counts

    def on_brick(self, message: Marker) -> None:
        """Tell from its color what the brick does."""
        self.phase = phase_of(message) or self.phase

    def on_verdict(self, message: Marker) -> None:
        """Count how often the brick was called unreachable."""
        self.verdicts += message.text == 'Unreachable'

    def on_tilt(self, message: Tilt) -> None:
        """Take note of the angle that the platform is told to have."""
        self.tilts += self.angle == 0.0 != message.angle
        self.angle = message.angle

    def on_goal(self, message: PoseStamped) -> None:
        """Take note of where the robot is sent."""
        self.sent.append((message.pose.position.x, message.pose.position.y))

    @property
    def goal(self) -> tuple[float, float]:
        """Return where the robot is sent at last."""
        return self.sent[-1]

    def see(self, frame: str) -> Pose | None:
        """Return where a frame is in the world, None if that is not known."""
        with contextlib.suppress(TransformException):
            return pose_of(self.buffer.lookup_transform('world', frame, Time()).transform)
        return None


class Scene:
    """The graph as processes, and a spectator."""

    def __init__(self, random: Random) -> None:
        """
        Start all nodes in a ROS domain of their own, and wait until they play together.

        :param random: says where easy bricks fall
        """
        self.random = random
        self._stack = contextlib.ExitStack()
        self.domain_id = self._stack.enter_context(reserved_domain())
        self.look()
        self.processes: dict[str, NodeProcess] = {}
        self._sure_at = 0.0
        self.mark()
        self._files = Path(self._stack.enter_context(TemporaryDirectory(prefix='chaos_')))
        (self._files / 'robot.yaml').write_text(yaml.safe_dump(
            {'/**': {'ros__parameters': self.graph.robot_parameters()}}), encoding='utf-8')
        self.names = [name for name in NODES if name != 'viewer' or can_view()]
        try:
            for name in self.names:
                self.start(name)
            self._sure_at = 0.0  # Nobody has died in this domain.
            self.recover(UP_TIME)
        except BaseException:
            self.close()
            raise

    def look(self) -> None:
        """Bring a spectator, and an executor with it, which may not survive that its nodes go."""
        self.graph = Graph(self.domain_id, quiet=True)
        self.spectator = self.graph.add(Spectator, parameters=False)

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
            [executable(*NODES[name]), '--ros-args', *arguments], self.domain_id,
            {'QT_QPA_PLATFORM': 'offscreen', 'RCUTILS_COLORIZED_OUTPUT': '0'})
        self._sure_at = monotonic() + STARTING + DISCOVERY

    def close(self) -> None:
        """End everything."""
        for process in self.processes.values():
            process.kill()
        self.graph.close()
        self._stack.close()

    # ------------------------------------------------------------------------ what is seen

    def mark(self) -> None:
        """Forget what the nodes have printed so far."""
        self._marked = monotonic()
        self._marks = {name: (process, len(process.output))
                       for name, process in self.processes.items()}
        self._ended: list[tuple[str, str]] = []

    def printed(self) -> Iterator[tuple[str, str]]:
        """Yield the name of each process since the last mark, and what it has printed since."""
        yield from self._ended
        for name, process in self.processes.items():
            marked, length = self._marks.get(name, (None, 0))
            yield name, process.output[length if marked is process else 0:]

    def check(self) -> None:
        """Look for what has died or logs what it shouldn't."""
        for name, text in self.printed():
            found = BAD_WORDS.search(text)
            if found:
                last = text[found.start():].strip().splitlines()[-1]
                raise Fault(f'{name} printed "{found.group()}": {last}')
        for name, process in self.processes.items():
            if not process.running:
                raise Fault(f'{name} ended with status {process.wait(1.0)}')

    def check_flood(self) -> None:
        """Look for a node of ours that warns all the time."""
        seconds = max(monotonic() - self._marked, 1.0)
        for name, text in self.printed():
            warnings = len(WARNING.findall(text))
            if name in OURS and warnings > FLOOD * seconds:
                raise Fault(f'{name} logged {warnings / seconds:.0f} warnings per second, such as '
                            f'{next(line for line in text.splitlines() if WARNING.search(line))}')

    def last_lines(self, count: int = 4) -> list[str]:
        """Return the last lines that our nodes have printed since the last mark."""
        return [f'{name}: {line[:300]}' for name, text in self.printed() if name in OURS
                for line in text.splitlines()[-count:]]

    def until(self, condition: Callable[[], Any], timeout: float, what: str) -> Any:
        """Let time pass until a condition holds, and return what it returned; else a Fault."""
        deadline = monotonic() + timeout
        while not (found := condition()):
            self.check()
            if monotonic() > deadline:
                raise Fault(f'{what}: not within {timeout:g} s ({self.situation()})')
            self.graph.spin_for(GLANCE)
        return found

    def situation(self) -> str:
        """Say what there is to be seen."""
        see, seen = self.spectator.see, self.spectator
        places = ', '.join(
            '{} at ({:.4g}, {:.4g}, {:.4g})'.format(frame, *pose.position) if pose else
            f'no {frame}' for frame, pose in (('platform', see('platform')),
                                              ('brick', see('brick'))))
        return (f'{places}, brick {seen.phase.value if seen.phase else "unseen"}, '
                f'tilt {seen.angle:.4g}, goal ({seen.goal[0]:.4g}, {seen.goal[1]:.4g})')

    def is_level(self) -> bool:
        """Tell whether the platform is level, and is told to be so."""
        platform = self.spectator.see('platform')
        return (platform is not None and abs(self.spectator.angle) < 1e-6
                and rotate(platform.orientation, (0.0, 0.0, 1.0))[2] > 1.0 - 1e-6)

    def wait_for_rates(self, timeout: float) -> None:
        """Wait until everything comes as often as it should, or nearly: machines are busy."""
        counts = self.spectator.counts

        def slow() -> list[str]:
            counts.clear()
            begin = monotonic()
            self.graph.spin_for(0.4)
            seconds = monotonic() - begin
            return [f'{name} at {counts[name] / seconds:.0f} Hz' for name, rate in RATES.items()
                    if counts[name] < 0.6 * rate * seconds]

        deadline = monotonic() + timeout
        while found := slow():
            self.check()
            if monotonic() > deadline:
                raise Fault(f'not at its rate: {", ".join(found)}')

    def wait_for_rest(self, timeout: float) -> None:
        """Wait until the robot has stood still for a while."""
        seen = (None, 0.0)

        def at_rest() -> bool:
            nonlocal seen
            platform = self.spectator.see('platform')
            if platform is None:
                return False
            if seen[0] is None or dist(platform.position[:2], seen[0]) > 1e-3:
                seen = (platform.position[:2], monotonic())
            return monotonic() - seen[1] > 0.25

        self.until(at_rest, timeout, 'the robot stands still')

    def recover(self, timeout: float = RECOVERY) -> None:
        """Wait until the graph is back, and no brick is under way on or to the platform."""
        self.wait_for_rates(timeout)
        self.until(lambda: 'are in sight' in self.processes['catcher'].output, timeout,
                   'the catcher sees robot and brick')
        # What happens till then proves nothing: not a start, nor messages that say "in 5 s".
        self.graph.spin_for(self._sure_at - monotonic())
        self.until(lambda: self.spectator.phase not in (None, Phase.FALLING, Phase.RIDING),
                   timeout, 'stuck: the brick gets off the platform')
        self.wait_for_rest(timeout)

    # ------------------------------------------------------------------------ what is done

    def call(self, client: Any, request: Any, done: Callable[[], bool], what: str) -> None:
        """Call a service of the arena and wait for what it does: answers may get lost in DDS."""
        self.until(client.service_is_ready, UP_TIME, f'{client.srv_name} is there')
        future = client.call_async(request)

        def is_done() -> bool:
            if future.done() and not future.result().success:
                raise Fault(f'{client.srv_name}: {future.result().message}')
            return done()

        self.until(is_done, CALL_TIME, what)

    def place(self, x: float, y: float, z: float) -> None:
        """Have the brick hover somewhere."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = x, y, z

        def is_there() -> bool:
            brick = self.spectator.see('brick')
            return (self.spectator.phase is Phase.HOVERING and brick is not None
                    and dist(brick.position, (x, y, z)) < 1e-3)

        self.call(self.spectator.place_client, request, is_there,
                  f'the brick hovers at ({x:.2f}, {y:.2f}, {z:.2f})')

    def drop(self) -> None:
        """Let the hovering brick go."""
        self.call(self.spectator.drop_client, Trigger.Request(),
                  lambda: self.spectator.phase is not Phase.HOVERING, 'the brick is let go')

    def easy_place(self) -> tuple[float, float, float]:
        """Return where a brick may be released that is easily caught."""
        x, y, _ = self.spectator.see('platform').position
        farthest = guaranteed_distance(EASY_HEIGHT, PARAMETERS) - EASY_MARGIN
        while True:
            distance, way = self.random.uniform(0.3, farthest), self.random.uniform(-pi, pi)
            place = (x + distance * cos(way), y + distance * sin(way))
            if within_arena(*place) == place:
                return (*place, EASY_HEIGHT)

    def hard_place(self) -> tuple[float, float, float]:
        """Return where a brick is out of reach when it is released."""
        x, y, _ = self.spectator.see('platform').position
        corner = max(((a, b) for a in (0.5, 10.5) for b in (0.5, 10.5)),
                     key=lambda corner: dist(corner, (x, y)))
        return (*corner, 3.0)

    def play(self) -> None:
        """Drop an easy brick, and see it caught, carried to the center and tipped off."""
        seen = self.spectator
        self.place(*self.easy_place())
        verdicts, tilts = seen.verdicts, seen.tilts
        self.drop()
        self.until(lambda: seen.phase in (Phase.RIDING, Phase.GROUNDED), PLAY_TIME,
                   'the easy brick is down')
        if seen.verdicts != verdicts:
            raise Fault(f'an easy brick is called Unreachable ({self.situation()})')
        if seen.phase is Phase.GROUNDED:
            raise Fault(f'an easy brick is missed ({self.situation()})')
        self.until(lambda: seen.tilts > tilts, PLAY_TIME, 'the platform tilts')
        x, y, _ = seen.see('platform').position
        if dist((x, y), CENTER) > 0.05:
            raise Fault(f'the brick is tipped off at ({x:.2f}, {y:.2f}), not in the center')
        self.until(lambda: seen.phase is Phase.FLOATING, PLAY_TIME, 'the brick slides off')
        self.until(self.is_level, PLAY_TIME, 'the platform is level again')
        self.check()

    def go_to(self, stage: str) -> None:
        """Wait until a stage of the play is reached, with another brick."""
        seen = self.spectator
        if stage == 'idle':
            return
        if stage == 'unreachable':
            self.place(*self.hard_place())
            verdicts = seen.verdicts
            self.drop()
            self.until(lambda: seen.verdicts > verdicts, PLAY_TIME, '"Unreachable"')
            return
        self.place(*self.easy_place())
        if stage == 'hovering':
            return
        self.drop()
        tilts = seen.tilts

        def is_over() -> bool:
            """Tell whether it has all happened, and was heard of too late."""
            return seen.tilts > tilts and seen.phase is Phase.FLOATING and self.is_level()

        for name, reached in (
                ('falling', lambda: seen.phase is Phase.FALLING and seen.goal != CENTER),
                ('carrying', lambda: seen.phase is Phase.RIDING and seen.goal == CENTER),
                ('tilting', lambda: seen.angle > 0.3 * PARAMETERS.tilt_angle),
                ('leveling', lambda: seen.phase is Phase.FLOATING
                 and 0.0 < seen.angle < 0.7 * PARAMETERS.tilt_angle),
                ('floating', self.is_level)):
            self.until(lambda: reached() or is_over(), PLAY_TIME, f'before the blow: {name}')
            if is_over() and stage != 'floating':
                self.go_to(stage)
                return
            if name == stage:
                return

    def deal(self, name: str, blow: float | None) -> None:
        """Kill a node and start it again, or let it stand still for some time (s)."""
        process = self.processes[name]
        if blow is None:
            process.kill()
            self._ended.append((name, process.output))
            self.start(name)
        else:
            process.send(signal.SIGSTOP)
            self.graph.spin_for(blow)
            process.send(signal.SIGCONT)

    def fire(self, count: int, pattern: str = '') -> dict[str, int]:
        """
        Send random messages; return how many to which topic.

        :param count: how many
        :param pattern: a regular expression that their names are to match
        """
        # With all it has heard: what lingers in it would be the spectator's own fault.
        self.graph.close()
        self.graph = Graph(self.domain_id, quiet=True)
        injector = self.graph.add(Injector, parameters=False, random=self.random,
                                  pattern=pattern)
        self.graph.spin_for(1.0)  # to be discovered
        rest = 0.0
        while (left := count - injector.sent.total()) > 0:
            before = monotonic()
            for _ in range(min(int(rest), 10, left)):
                injector.inject()
            self.graph.spin_for(GLANCE)
            rest = rest % 1.0 + (monotonic() - before) * INJECTION
            self.check()
        # A server waits 0.1 s for each client that is gone before its answer.
        self.until(lambda: not injector.waits(), RECOVERY, 'all calls are answered')
        self.graph.close()
        self._sure_at = monotonic() + FORESIGHT
        self.look()
        return injector.sent

    def calm_down(self) -> None:
        """Wait until the catcher is done with what it was led to; level and center the robot."""
        seen = self.spectator
        self.wait_for_rates(RECOVERY)
        # A brick may well be placed beyond the stars, and falls until doomsday.
        brick = seen.see('brick')
        if brick is None or max(map(abs, brick.position)) > FAR:
            self.place(*CENTER, EASY_HEIGHT)
        self.recover()
        deadline = monotonic() + RECOVERY
        level, goal = Tilt(angle=0.0), PoseStamped()
        goal.header.frame_id = 'world'
        goal.pose.position.x, goal.pose.position.y = CENTER

        def is_calm() -> bool:
            platform = seen.see('platform')
            return (self.is_level() and platform is not None
                    and dist(platform.position[:2], CENTER) < 0.05)

        while not is_calm():
            seen.tilt_publisher.publish(level)
            seen.goal_publisher.publish(goal)
            self.graph.spin_for(1.0)
            self.check()
            if monotonic() > deadline:
                raise Fault(f'the robot does not obey ({self.situation()})')
        self.wait_for_rest(RECOVERY)


def can_view() -> bool:
    """Tell whether there is what the viewer's page is drawn with."""
    import importlib.util
    return importlib.util.find_spec('viser') is not None


# ------------------------------------------------------------------------------- the trials

@dataclass
class Cell:
    """What came of a trial."""

    name: str
    fault: str = ''
    seconds: float = 0.0
    stall: float = 0.0
    """The longest time (s) for which the machine stood still meanwhile."""
    log: Sequence[str] = ()


class Chaos:
    """Trials, one after another, in one graph as long as it lives."""

    def __init__(self, seed: int) -> None:
        """Begin with no graph."""
        self.random = Random(seed)
        self.cells: list[Cell] = []
        self.watch = StallWatch(STALL)
        self._scene: Scene | None = None

    def __enter__(self) -> Chaos:
        """Return itself; in the end the graph ends."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the graph."""
        self.watch.close()
        self.end()

    def end(self) -> None:
        """End the graph."""
        if self._scene is not None:
            self._scene.close()
            self._scene = None

    def scene(self) -> Scene:
        """Return the graph, a new one if there is none."""
        if self._scene is None:
            self._scene = Scene(self.random)
        return self._scene

    def trial(self, name: str, do: Callable[[Scene], None]) -> Cell:
        """Make a trial; after one that failed the next has a new graph."""
        cell = Cell(name)
        self.cells.append(cell)
        begin = monotonic()
        try:
            scene = self.scene()
            scene.mark()
            begin = monotonic()
            do(scene)
            scene.check()
            scene.check_flood()
        except Fault as fault:
            cell.fault = str(fault)
            cell.log = self._scene.last_lines() if self._scene else ()
            self.end()
        cell.seconds = monotonic() - begin
        cell.stall = self.watch.longest(begin)
        print(f'{name:44s} {cell.seconds:5.1f} s  {cell.fault or "ok"}'
              + (f'  [the machine stood still for {cell.stall:.2f} s]' if cell.stall else ''),
              flush=True)
        for line in cell.log:
            print(f'    {line}', flush=True)
        return cell

    def kills(self, pattern: str = '') -> None:
        """Deal every blow to every node at every stage."""
        for node in self.scene().names:
            for blow, value in BLOWS.items():
                for stage in STAGES:
                    name = f'{node}, {blow}, {stage}'
                    if re.search(pattern, name):
                        self.trial(name, lambda scene: self.blow(scene, node, value, stage))

    @staticmethod
    def blow(scene: Scene, node: str, blow: float | None, stage: str) -> None:
        """Deal a blow at a stage, and see the graph come back and catch."""
        scene.go_to(stage)
        scene.deal(node, blow)
        scene.recover()
        scene.play()

    def messages(self, count: int, pattern: str = '') -> None:
        """Send random messages, and have an easy brick caught after each batch."""
        sent: Counter[str] = Counter()

        def batch(scene: Scene) -> None:
            sent.update(scene.fire(min(BATCH, count), pattern))
            scene.calm_down()
            scene.play()

        for number in range(-(-count // BATCH)):
            self.trial(f'messages {number * BATCH} ...', batch)
        print(', '.join(f'{topic} {number}' for topic, number in sorted(sent.items())))

    def soak(self, minutes: float, every: float) -> None:
        """Drop bricks at random places for a long time; see promises, memory and files."""
        def day(scene: Scene) -> None:
            faults = soak(scene, minutes * 60.0, every, self.watch)
            if faults:
                raise Fault('; '.join(faults))

        self.trial(f'soak of {minutes:g} min', day)

    def report(self) -> int:
        """Print what came of it; return the status."""
        failed = [cell for cell in self.cells if cell.fault]
        rows: dict[str, dict[str, str]] = {}
        for cell in self.cells:
            row, _, stage = cell.name.rpartition(', ')
            if row:
                rows.setdefault(row, {})[stage] = 'FAILED' if cell.fault else 'ok'
        if rows:
            print(f'\n{"":34s}' + ''.join(f'{stage:>12s}' for stage in STAGES))
        for row, found in rows.items():
            print(f'{row:34s}' + ''.join(f'{found.get(stage, "-"):>12s}' for stage in STAGES))
        print(f'\n{len(self.cells)} trials, {len(failed)} failed')
        for cell in failed:
            print(f'{cell.name}: {cell.fault}')
        return 1 if failed else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description='The graph under fire.')
    parser.add_argument('what', nargs='?', default='all',
                        choices=('kills', 'messages', 'soak', 'all'))
    parser.add_argument('--seed', type=int, default=0, help='of all that is random')
    parser.add_argument('--messages', type=int, default=20_000, help='how many')
    parser.add_argument('--minutes', type=float, default=30.0, help='how long a soak takes')
    parser.add_argument('--every', type=float, default=4.0, help='seconds between two drops')
    parser.add_argument('--cells', default='', metavar='PATTERN',
                        help='only the kills, or only the topics, whose name has this')
    parser.add_argument('--json', type=Path, metavar='FILE', help='where to write the results')
    options = parser.parse_args(arguments)
    INTERRUPTS.take_over()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with TemporaryDirectory(prefix='chaos_log_') as logs, Chaos(options.seed) as chaos:
        os.environ['ROS_LOG_DIR'] = logs
        with contextlib.suppress(KeyboardInterrupt):
            if options.what in ('kills', 'all'):
                chaos.kills(options.cells)
            if options.what in ('messages', 'all'):
                chaos.messages(options.messages, options.cells)
            if options.what in ('soak', 'all'):
                chaos.soak(options.minutes, options.every)
        if options.json:
            options.json.write_text(json.dumps([asdict(cell) for cell in chaos.cells], indent=1),
                                    encoding='utf-8')
        return chaos.report()


if __name__ == '__main__':
    sys.exit(main())
