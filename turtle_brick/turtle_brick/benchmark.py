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
benchmark: measure what the live graph costs, how regular it is and how quickly it reacts.

How it is measured:

* The graph is started twice: every node as a process of its own (the installed executables), and
  composed (one process, one executor; a turtlesim or robot_state_publisher that cannot be
  composed runs beside). Its floor is measured before and after it, in the same way, and the mean
  taken, since processors change their pace: bare nodes that publish and receive the same messages
  at the same rates and compute nothing (`turtle_brick.benchmark_nodes`). The ratio of the two is
  what the nodes' own work costs.
* Processor time is the user and system time that Linux books on a process and its threads
  (/proc/<pid>/stat) over a window, while nobody else listens to what comes 100 or 250 times per
  second: "idle", the brick hovering and the robot at rest, and "catching", one drop after another.
  Peak memory is VmHWM, start-up included.
* Intervals are taken in further windows, with a listener, which costs the publishers some time:
  idle, and under two busy loops beside. Their instants are those at which the middleware took a
  message over for publication (source_timestamp), not those of its arrival here. Given are the
  mean, the 1st, 50th and 99th percentile and the greatest.
* Drift is counted in steps of the physics: gaps between the stamps of the brick's transforms,
  and what the stamps fall behind the clock of their publication.
* Latency is taken from drops on a robot at rest, each from a random distance that asks for
  motion. The release is the stamp of the last position before the brick falls; the decision is
  the goal's publication; motion is the first pose of turtlesim that has changed.
* Headless drops are those of `sweep`, in this process, by its own processor time.
* Set-up, if asked for, is `source turtle_brick/scripts/env.bash` in a fresh clone with an empty
  HOME and environment, and once more. The package index's speed is part of it.

Everything runs in a ROS domain of its own. What other programs use meanwhile is measured too, and
said: above a twentieth of a core the numbers are not worth much. So is what the host of a virtual
machine keeps from it: while it does, everything comes late, and the percentiles show it.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from collections.abc import Sequence
from datetime import datetime
from datetime import timezone
from importlib.util import find_spec
import json
from math import cos
from math import hypot
from math import inf
from math import pi
from math import sin
import os
from pathlib import Path
import platform
from random import Random
import shutil
import signal
import subprocess
import sys
from tempfile import TemporaryDirectory
from threading import Event
from time import monotonic
from time import process_time
from time import time_ns
from typing import Any
from typing import NamedTuple
from xml.etree import ElementTree

from ament_index_python.packages import get_package_prefix
from ament_index_python.packages import get_package_share_path
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from rclpy.utilities import get_rmw_implementation_identifier
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.arena import STEP
from turtle_brick.benchmark_nodes import REMAP
from turtle_brick.catching import CENTRE
from turtle_brick.catching import guaranteed_distance
from turtle_brick.domains import reserved_domain
from turtle_brick.frames import BASE_LINK
from turtle_brick.frames import BRICK
from turtle_brick.frames import nanoseconds_of
from turtle_brick.geometry import Vector
from turtle_brick.graph import Graph
from turtle_brick.interrupts import INTERRUPTS
from turtle_brick.measuring import BrickSample
from turtle_brick.measuring import busy_time
from turtle_brick.measuring import chain
from turtle_brick.measuring import Drift
from turtle_brick.measuring import drift
from turtle_brick.measuring import Events
from turtle_brick.measuring import intervals
from turtle_brick.measuring import peak_memory
from turtle_brick.measuring import Place as RobotPlace
from turtle_brick.measuring import processor_model
from turtle_brick.measuring import processor_time
from turtle_brick.measuring import Spread
from turtle_brick.measuring import spread
from turtle_brick.measuring import stolen_time
from turtle_brick.node_tools import PollingNode
from turtle_brick.parameters import default_path
from turtle_brick.parameters import load
from turtle_brick.parameters import ParameterError
from turtle_brick.parameters import Parameters
from turtle_brick.sweeping import make
from turtle_brick.sweeping import Plan
from turtle_brick.sweeping import version
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtlesim.msg import Pose
from visualization_msgs.msg import Marker
import yaml

OURS = ('turtle_robot', 'arena', 'catcher')
FOREIGN = {'turtlesim': 'turtlesim_standin', 'robot_state_publisher': 'robot_state_publisher'}
"""The other nodes of the graph, and the Python package whose presence tells a stand-in."""

START_TIME = 60.0
"""How long (s) processes may take to start and to find each other."""

END_TIME = 10.0
"""How long (s) a process may take to end when it is asked to."""

FETCH_PERIOD = 0.1
"""Time (s) after which what is listened to is fetched."""

WARM_UP = 3.0
"""How long (s) a graph runs before it is measured."""

HOVERING = 0.5
"""How long (s) a brick hovers before it is dropped."""

LONGEST_DROP = 30.0
"""How long (s) a drop may take until the catcher waits again."""

OTHERS = 0.05
"""Cores in use by other programs from which on the numbers are worth little."""

BUSY_LOOPS = 2

SWEEP = Plan(grid=False, count=400, heights=(2.0, 10.0), seed=1)
"""The headless drops."""


class Process:
    """A program of its own, and what it uses."""

    def __init__(self, name: str, command: Sequence[str], log: Path,
                 environment: dict[str, str] | None = None) -> None:
        """
        Start it.

        :param name: what to call it
        :param command: its command line
        :param log: the file for all that it says
        :param environment: variables besides those of this process
        """
        self.name = name
        self._log = log
        with open(log, 'wb') as file:
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                env={**os.environ, **(environment or {})},
                # A Ctrl-C is for the process that started it, which then ends this one in order.
                start_new_session=True)

    @property
    def pid(self) -> int:
        """Return the process's id."""
        return self._process.pid

    def check(self) -> None:
        """
        See that it still runs.

        :raises RuntimeError: it does not; the text holds the last of what it said
        """
        if self._process.poll() is not None:
            said = self._log.read_text(errors='replace').strip().splitlines() or ['nothing']
            raise RuntimeError(f'{self.name} has ended with status {self._process.returncode}, '
                               f'and said last: {said[-1]}')

    def ask_to_end(self) -> None:
        """Ask it to end, as Ctrl-C does."""
        self._process.send_signal(signal.SIGINT)

    def see_end(self) -> None:
        """See that it ends, or end it."""
        try:
            self._process.wait(END_TIME)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Processes:
    """The programs of a graph; on leaving it, they are ended."""

    def __init__(self) -> None:
        """Begin with none."""
        self._files = TemporaryDirectory()
        self.all: list[Process] = []

    def __enter__(self) -> 'Processes':
        """Return the processes themselves."""
        return self

    def __exit__(self, *_: object) -> None:
        """End them all."""
        with INTERRUPTS.held():
            for process in self.all:
                process.ask_to_end()
            for process in self.all:
                process.see_end()
            self._files.cleanup()

    def start(self, name: str, *command: str) -> None:
        """Start one."""
        environment = {} if os.environ.get('DISPLAY') else {'QT_QPA_PLATFORM': 'offscreen'}
        with INTERRUPTS.held():
            self.all.append(Process(name, command, Path(self._files.name, f'{name}.log'),
                                    environment))

    def parameter_file(self, name: str, parameters: dict[str, Any]) -> str:
        """Write parameters for any node; return the file's path."""
        path = Path(self._files.name, f'{name}.yaml')
        path.write_text(yaml.safe_dump({'/**': {'ros__parameters': parameters}}),
                        encoding='utf-8')
        return str(path)

    def check(self) -> None:
        """See that all still run; RuntimeError if not."""
        for process in self.all:
            process.check()


def composable() -> list[str]:
    """Return the nodes that can be composed here: ours, and the stand-ins."""
    return [*OURS, *(name for name, module in FOREIGN.items() if find_spec(module) is not None)]


def start_graph(processes: Processes, watch: Graph, kind: str, composed: bool) -> None:
    """
    Start a graph.

    :param processes: what to add its processes to
    :param watch: knows the robot's description
    :param kind: 'real' or 'bare'
    :param composed: whether as many nodes as possible share a process
    """
    together = composable() if composed else []
    host = [sys.executable, '-m', 'turtle_brick.benchmark_nodes', kind]
    if together:
        processes.start('composed', *host, *together)
    for name in (*FOREIGN, *OURS):
        if name in together:
            continue
        if kind == 'bare':
            processes.start(name, *host, name, '--ros-args', *REMAP.get(name, ()))
            continue
        package = name if name in FOREIGN else 'turtle_brick'
        executable = 'turtlesim_node' if name == 'turtlesim' else name
        params_file = str(default_path())
        if name == 'turtlesim':
            params_file = processes.parameter_file(name, {'holonomic': True})
        elif name == 'robot_state_publisher':
            params_file = processes.parameter_file(name, {
                'robot_description': watch.robot_description(), 'publish_frequency': 1000.0})
        processes.start(name, str(Path(get_package_prefix(package), 'lib', package, executable)),
                        '--ros-args', '--params-file', params_file, *REMAP.get(name, ()))


class Recording:
    """Messages of a topic, as they were sent, and when."""

    def __init__(self, message_type: type) -> None:
        """Begin with none."""
        self._type = message_type
        self.published: list[int] = []
        self.received: list[int] = []
        self._data: list[bytes] = []

    def take(self, data: bytes, info: dict[str, int]) -> None:
        """Keep a message, with what rmw knows of its way."""
        self.published.append(info['source_timestamp'])
        self.received.append(info['received_timestamp'])
        self._data.append(data)

    def messages(self) -> Iterator[tuple[int, Any]]:
        """Yield the messages, each with the instant of its publication (ns)."""
        for published, data in zip(self.published, self._data):
            yield published, deserialize_message(data, self._type)


class Observer(PollingNode):
    """What places and drops bricks, and what listens when it is to."""

    TOPICS = {
        'cmd_vel': (Twist, 'turtle1/cmd_vel'),
        'odom': (Odometry, 'odom'),
        'joint_states': (JointState, 'joint_states'),
        'tf': (TFMessage, '/tf'),
        'pose': (Pose, 'turtle1/pose'),
        'goal': (PoseStamped, 'goal_pose'),
    }

    def __init__(self, **node_options: Any) -> None:
        """Listen to nothing but what tells how drops end: the platform's angle, the verdict."""
        super().__init__('benchmark', **node_options)
        self.place_client = self.create_client(Place, 'place')
        self.drop_client = self.create_client(Trigger, 'drop')
        self.create_subscription(Tilt, 'tilt', self._on_tilt, 10)
        self.create_subscription(Marker, 'catcher_marker', self._on_marker, 10)
        self.create_timer(FETCH_PERIOD, self.fetch)
        self._listening: list[Subscription] = []
        self.tilted = False
        self.levelled = False
        self.refused = False

    def is_complete(self) -> bool:
        """Tell whether every node of a graph has all that it publishes and hears."""
        return (self.count_publishers('/tf') == 3
                and self.count_subscribers('/tf') == 2
                and all(self.count_publishers(topic) == 1 for topic in (
                    'odom', 'turtle1/pose', 'turtle1/cmd_vel', 'joint_states', 'goal_pose'))
                and all(self.count_subscribers(topic) == 1 for topic in (
                    'turtle1/pose', 'turtle1/cmd_vel', 'joint_states', 'goal_pose'))
                and self.place_client.service_is_ready() and self.drop_client.service_is_ready())

    def is_alone(self) -> bool:
        """Tell whether no other node is left."""
        return self.count_publishers('/tf') == 0 and self.count_subscribers('/tf') == 0

    def record(self) -> dict[str, Recording]:
        """Listen to everything from now on."""
        recordings = {}
        for name, (message_type, topic) in self.TOPICS.items():
            recordings[name] = Recording(message_type)
            self._listening.append(self.poll(
                message_type, topic, recordings[name].take, QoSProfile(depth=2000), raw=True))
        return recordings

    def expect_drop(self) -> None:
        """Forget how the last drop ended."""
        self.tilted = self.levelled = self.refused = False

    def stop_listening(self) -> None:
        """Listen to nothing of it again."""
        self.fetch()
        for subscription in self._listening:
            self.destroy_subscription(subscription)
        self._listening.clear()

    def _on_tilt(self, message: Tilt) -> None:
        """Note that the platform has been tilted, or has come back."""
        if message.angle > 0.0:
            self.tilted = True
        elif self.tilted:
            self.levelled = True

    def _on_marker(self, message: Marker) -> None:
        """Note that the brick has been called unreachable."""
        self.refused = True


class Window(NamedTuple):
    """What was used in a stretch of time."""

    seconds: float
    cores: dict[str, float]
    """Of each process: processor time per time."""
    others: float
    """Of all programs that are not part of the benchmark."""


class Throw(NamedTuple):
    """A drop into the live graph."""

    begin: int
    """Shortly before it was asked for (ns), the brick hovering."""
    end: int
    """When all was over (ns)."""
    outcome: str
    """'caught', 'refused' or 'missed'."""


class Benchmark:
    """The measurements, one after another."""

    def __init__(self, options: argparse.Namespace, parameters: Parameters) -> None:
        """
        Measure nothing yet.

        :param options: of the command line
        :param parameters: the physical numbers
        """
        self.options = options
        self.parameters = parameters
        self.random = Random(1)
        self.others: list[float] = []

    def say(self, text: str) -> None:
        """Tell what is being done."""
        print(text, file=sys.stderr, flush=True)

    def run(self) -> dict[str, Any]:
        """Measure everything; return what was found."""
        found: dict[str, Any] = {'machine': machine()}
        begin, stolen = monotonic(), stolen_time()
        if self.options.setup is not None:
            self.say('set-up: a fresh clone')
            found['set_up'] = measure_set_up(self.options.setup)
        for name, composed in (('processes', False), ('composed', True)):
            self.say(f'{name}: the floor')
            before = self.with_graph('bare', composed, self.measure_floor)
            real = self.with_graph('real', composed, self.measure)
            self.say(f'{name}: the floor once more')
            after = self.with_graph('bare', composed, self.measure_floor)
            found[name] = {'floor': mean_floor(before, after), **real}
        self.say('headless: drops on one core')
        found['headless'] = measure_headless(self.parameters)
        found['others_cores'] = max(self.others)
        found['stolen_cores'] = (stolen_time() - stolen) / (monotonic() - begin)
        return found

    def with_graph(self, kind: str, composed: bool, measure: Any) -> dict[str, Any]:
        """Start a graph, measure it and end it."""
        with Graph(quiet=True) as watch, Processes() as processes:
            observer = watch.add(Observer, parameters=False)
            start_graph(processes, watch, kind, composed)
            self.await_in(watch, processes, observer.is_complete, START_TIME,
                          'the nodes find each other')
            recordings = observer.record()
            self.await_in(watch, processes, lambda: recordings['odom'].published, START_TIME,
                          'the robot moves or rests')
            observer.stop_listening()
            watch.spin_for(WARM_UP)
            return measure(watch, processes, observer)

    @staticmethod
    def await_in(watch: Graph, processes: Processes, condition: Any, timeout: float,
                 what: str) -> None:
        """Wait until a condition holds, with an eye on the processes."""
        def holds() -> bool:
            processes.check()
            return condition()
        watch.spin_until(holds, timeout, what)

    def measure_floor(self, watch: Graph, processes: Processes,
                      observer: Observer) -> dict[str, Any]:
        """Measure bare nodes, which nobody listens to."""
        window = self.window(processes, lambda: Event().wait(self.options.seconds))
        return {'cores': window.cores, 'memory': memory(processes)}

    def measure(self, watch: Graph, processes: Processes, observer: Observer) -> dict[str, Any]:
        """Measure the real nodes in every way."""
        seconds = self.options.seconds
        found: dict[str, Any] = {}
        self.say('  idle, nobody listening')
        found['idle'] = self.window(processes, lambda: Event().wait(seconds)).cores
        self.say('  catching, nobody listening')
        outcomes: Counter = Counter()

        def catch() -> None:
            end = monotonic() + seconds
            while monotonic() < end:
                outcomes[self.throw(watch, processes, observer).outcome] += 1

        found['catching'] = self.window(processes, catch).cores
        found['memory'] = memory(processes)
        self.say('  idle, listening')
        found['intervals'], found['drift'] = self.listen(watch, observer)
        self.say('  under two busy loops, listening')
        with Processes() as loops:
            for number in range(BUSY_LOOPS):
                loops.start(f'loop{number}', sys.executable, '-c', 'while True: pass')
            found['intervals_busy'], found['drift_busy'] = self.listen(watch, observer)
        self.say(f'  {self.options.drops} drops')
        found['latency'] = self.measure_latency(watch, processes, observer, outcomes)
        found['outcomes'] = dict(outcomes)
        return found

    def window(self, processes: Processes, action: Any) -> Window:
        """Return what is used while something happens."""
        def snapshot() -> tuple[float, float, float, dict[str, float]]:
            return (monotonic(), busy_time(), process_time(),
                    {process.name: processor_time(process.pid) for process in processes.all})

        begin, busy, own, used = snapshot()
        action()
        processes.check()
        end, busy_then, own_then, used_then = snapshot()
        seconds = end - begin
        cores = {name: (used_then[name] - used[name]) / seconds for name in used}
        others = (busy_then - busy - (own_then - own)) / seconds - sum(cores.values())
        self.others.append(max(others, 0.0))
        return Window(seconds, cores, others)

    def throw(self, watch: Graph, processes: Processes, observer: Observer) -> Throw:
        """
        Place a brick where it can be caught, drop it and wait until all is over.

        :param watch: the graph that the observer is in
        :param processes: the nodes
        :param observer: calls the services
        :return: How it went.
        :raises ValueError: a service has refused
        """
        x, y, z = self.brick()
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = x, y, z
        self.call(watch, processes, observer.place_client, request)
        watch.spin_for(HOVERING / 2.0)
        begin = time_ns()
        watch.spin_for(HOVERING / 2.0)
        observer.expect_drop()
        self.call(watch, processes, observer.drop_client, Trigger.Request())
        try:
            self.await_in(watch, processes, lambda: observer.levelled or observer.refused,
                          LONGEST_DROP, 'the drop ends')
        except TimeoutError:
            # Said to be reachable, and not caught: that happens where a machine has no time.
            return Throw(begin, time_ns(), 'missed')
        return Throw(begin, time_ns(), 'refused' if observer.refused else 'caught')

    def brick(self) -> Vector:
        """Return where to drop the next brick, so that the robot has to move and can make it."""
        z = self.parameters.brick_start[2]
        distance = self.random.uniform(0.5, 0.9) * guaranteed_distance(z, self.parameters)
        angle = self.random.uniform(-pi, pi)
        return CENTRE[0] + distance * cos(angle), CENTRE[1] + distance * sin(angle), z

    def call(self, watch: Graph, processes: Processes, client: Any, request: Any) -> None:
        """Call a service; ValueError with its reason if it refuses."""
        future = client.call_async(request)
        self.await_in(watch, processes, future.done, 10.0, f'{client.srv_name} answers')
        if not future.result().success:
            raise ValueError(f'{client.srv_name}: {future.result().message}')

    def listen(self, watch: Graph, observer: Observer) -> tuple[dict[str, Any], Drift]:
        """Return the spreads of all intervals over a window, and the drift of the physics."""
        recordings = observer.record()
        watch.spin_for(self.options.seconds)
        observer.stop_listening()
        steps: list[tuple[int, int]] = []
        instants: dict[str, list[int]] = {
            name: recordings[name].published for name in ('cmd_vel', 'odom', 'joint_states')}
        instants.update({'odom -> base_link': [], 'world -> brick': []})
        for published, message in recordings['tf'].messages():
            children = [transform.child_frame_id for transform in message.transforms]
            if BASE_LINK in children:
                instants['odom -> base_link'].append(published)
            if BRICK in children:
                instants['world -> brick'].append(published)
                steps += [(nanoseconds_of(transform.header.stamp), published)
                          for transform in message.transforms]
        return ({name: spread(intervals(published)) for name, published in instants.items()},
                drift(*zip(*steps), STEP))

    def measure_latency(self, watch: Graph, processes: Processes, observer: Observer,
                        outcomes: Counter) -> list[dict[str, float]]:
        """Return the chain of each of some drops, and count how they ended."""
        chains = []
        for _ in range(self.options.drops):
            recordings = observer.record()
            drop = self.throw(watch, processes, observer)
            observer.stop_listening()
            outcomes[drop.outcome] += 1
            links = chain(events(recordings, drop.begin, drop.end))
            if links is not None:
                chains.append(links)
        if not chains:
            raise RuntimeError('no drop was heard from its release to the first motion')
        return chains


def events(recordings: dict[str, Recording], begin: int, end: int) -> Events:
    """Return what was heard in a stretch of time (ns), as `measuring.chain` wants it."""
    def part(name: str) -> Iterator[tuple[int, Any]]:
        return ((published, message) for published, message in recordings[name].messages()
                if begin <= published <= end)

    brick: list[BrickSample] = []
    transforms: list[RobotPlace] = []
    for published, message in part('tf'):
        for transform in message.transforms:
            place = transform.transform.translation
            if transform.child_frame_id == BRICK:
                brick.append(BrickSample(
                    nanoseconds_of(transform.header.stamp), published, place.z))
            elif transform.child_frame_id == BASE_LINK:
                transforms.append(RobotPlace(published, place.x, place.y))
    return Events(
        brick=brick, goals=[published for published, _ in part('goal')],
        commands=[(published, hypot(message.linear.x, message.linear.y))
                  for published, message in part('cmd_vel')],
        poses=[RobotPlace(published, message.x, message.y)
               for published, message in part('pose')],
        transforms=transforms)


def mean_floor(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """Return the mean of two floors; of their peak memories the greater."""
    return {
        'cores': {name: (cores + after['cores'][name]) / 2.0
                  for name, cores in before['cores'].items()},
        'memory': {name: max(peak, after['memory'][name])
                   for name, peak in before['memory'].items()},
    }


def memory(processes: Processes) -> dict[str, int]:
    """Return the peak memory of each process so far, in bytes."""
    return {process.name: peak_memory(process.pid) for process in processes.all}


def measure_headless(parameters: Parameters) -> dict[str, float]:
    """Return how many drops a core makes per second, and at how many times real time."""
    simulated, drops = 0.0, 0
    begin = process_time()
    for one in SWEEP.chains():
        done, time = make(parameters, one, SWEEP.delays)
        drops += len(done)
        simulated += time
    cost = process_time() - begin
    return {'drops': drops, 'drops_per_second': drops / cost, 'real_time_factor': simulated / cost}


def measure_set_up(repository: Path) -> dict[str, float]:
    """
    Return how long (s) env.bash takes in a fresh clone, and once more.

    :param repository: what is cloned
    :return: 'cold' and 'warm'.
    :raises RuntimeError: it failed; the text holds the last of what it said
    """
    with TemporaryDirectory() as directory:
        clone, home = Path(directory, 'clone'), Path(directory, 'home')
        home.mkdir()
        subprocess.run(['git', 'clone', '--quiet', str(repository), str(clone)], check=True)
        kept = ('PATH', 'LANG', 'PYTHON')
        # What leads to the package index is the machine's, not the caller's.
        environment = {name: value for name, value in os.environ.items()
                       if name in kept or name.startswith('PIP_') or name.endswith('_proxy')}
        if os.environ.get('TURTLE_BRICK_HOME'):
            own = os.environ['TURTLE_BRICK_HOME']
            environment['PATH'] = os.pathsep.join(
                place for place in environment['PATH'].split(os.pathsep)
                if not place.startswith(own))
        environment['HOME'] = str(home)
        taken = {}
        for name in ('cold', 'warm'):
            begin = monotonic()
            done = subprocess.run(
                ['bash', '-c', 'source "$1" && python3 -c "import rclpy"', 'bash',
                 str(clone / 'turtle_brick' / 'scripts' / 'env.bash')],
                env=environment, cwd=directory, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            taken[name] = monotonic() - begin
            if done.returncode != 0:
                said = done.stdout.strip().splitlines() or ['nothing']
                raise RuntimeError(f'the {name} set-up failed, and said last: {said[-1]}')
        return taken


def machine() -> dict[str, Any]:
    """Return what the numbers were measured on and with."""
    def package_version(name: str) -> str:
        manifest = get_package_share_path(name) / 'package.xml'
        return ElementTree.parse(manifest).findtext('version')

    return {
        'processor': processor_model(),
        'cores': len(os.sched_getaffinity(0)),
        'system': platform.platform(),
        'python': platform.python_version(),
        'turtle_brick': version(),
        'rclpy': package_version('rclpy'),
        'middleware': get_rmw_implementation_identifier(),
        **{name: package_version(name) + ('' if find_spec(module) is None else ' (stand-in)')
           for name, module in FOREIGN.items()},
        'date': datetime.now(timezone.utc).strftime('%Y-%m-%d %H:%M UTC'),
        'load_average': os.getloadavg()[0],
    }


def report(found: dict[str, Any]) -> str:
    """
    Make a table of what was found.

    :param found: by `Benchmark.run`
    :return: The text for the terminal.
    """
    what = found['machine']
    lines = [
        f'turtle_brick {what["turtle_brick"]} on {what["cores"]} cores of {what["processor"]}, '
        f'Python {what["python"]}, rclpy {what["rclpy"]},',
        f'{what["middleware"]}, turtlesim {what["turtlesim"]}, '
        f'robot_state_publisher {what["robot_state_publisher"]}, {what["date"]}',
        f'{found["seconds"]:g} s per window; other programs used {found["others_cores"]:.2f} '
        'cores at most' + (
            ': TOO MUCH for numbers that are worth something'
            if found['others_cores'] > OTHERS else ''),
        f'the host of this virtual machine kept {found["stolen_cores"]:.3f} cores for itself',
        '', 'processor time, % of a core      idle  catching     floor  idle/floor   peak memory']

    def usage(name: str, which: Sequence[str], run: dict[str, Any]) -> str:
        idle, catching, floor = (sum(cores[one] for one in which) for cores in (
            run['idle'], run['catching'], run['floor']['cores']))
        most = sum(run['memory'][one] for one in which)
        return (f'  {name:26}{100 * idle:9.1f}{100 * catching:10.1f}{100 * floor:10.1f}'
                f'{idle / floor:12.2f}{most / 2 ** 20:11.0f} MB')

    run = found['processes']
    for name in (*OURS, *FOREIGN):
        lines.append(usage(name, [name], run))
    lines.append(usage('the three of ours', OURS, run))
    lines.append(usage('all five', [*OURS, *FOREIGN], run))
    run = found['composed']
    count = 5 - sum(name in run['idle'] for name in FOREIGN)
    lines.append(usage(f'{count} in one process', ['composed'], run))

    for name in ('processes', 'composed'):
        run = found[name]
        lines += ['', f'intervals, ms ({name})     nominal     mean      p01      p50      p99'
                  '      max   with two busy loops: p99      max']
        for topic, found_spread in run['intervals'].items():
            nominal = STEP * 1e-6 if topic.startswith('world') else 10.0
            busy = run['intervals_busy'][topic]
            lines.append(
                f'  {topic:26}{nominal:6.1f}{1e3 * found_spread.mean:9.3f}'
                f'{1e3 * found_spread.p01:9.3f}{1e3 * found_spread.p50:9.3f}'
                f'{1e3 * found_spread.p99:9.3f}{1e3 * found_spread.maximum:9.2f}'
                f'{1e3 * busy.p99:27.3f}{1e3 * busy.maximum:9.2f}')
        idle, busy = run['drift'], run['drift_busy']
        lines.append(
            f'  drift of the physics: {idle.total} steps of {idle.steps:,} '
            f'(published at most {1e3 * idle.latest:.1f} ms late), '
            f'with two busy loops {busy.total} of {busy.steps:,} ({1e3 * busy.latest:.1f} ms)')

    for name in ('processes', 'composed'):
        counts = ', '.join(f'{count} {outcome}'
                           for outcome, count in sorted(found[name]['outcomes'].items()))
        lines.append(f'  drops, all within reach ({name}): {counts}')
    lines += ['', f'latency from the release, ms ({found["drops"]} drops)     '
              'processes: p50      p01      p99    composed: p50      p01      p99']
    for name, words in (('decided', 'decision (goal published)'),
                        ('commanded', 'first command to move'),
                        ('moved', 'first motion (pose of turtlesim)'),
                        ('known', 'first motion in TF')):
        row = f'  {words:38}'
        for run, width in (('processes', 22), ('composed', 17)):
            of = spread([links[name] for links in found[run]['latency']])
            row += f'{1e3 * of.p50:{width}.1f}{1e3 * of.p01:9.1f}{1e3 * of.p99:9.1f}'
        lines.append(row)

    headless = found['headless']
    lines += ['', f'headless: {headless["drops_per_second"]:.0f} drops per second and core, '
              f'{headless["real_time_factor"]:.0f} times real time']
    if 'set_up' in found:
        lines.append(f'set-up: {found["set_up"]["cold"]:.0f} s in a fresh clone, '
                     f'{found["set_up"]["warm"]:.1f} s once made')
    return '\n'.join(lines)


def plain(value: Any) -> Any:
    """Return a value as JSON can hold it, numbers to seven digits."""
    if isinstance(value, (Spread, Drift)):
        return plain(value._asdict())
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return float(f'{value:.7g}') if isinstance(value, float) else value


def parse(args: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line; what is wrong with it ends the process with a sentence."""
    first, rest = __doc__.strip().split('\n\n', 1)
    parser = argparse.ArgumentParser(
        prog='benchmark', description=first.partition(': ')[2].capitalize(), epilog=rest,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=60.0, metavar='T',
                        help='length of each window (s, default: 60); there are twelve')
    parser.add_argument('--drops', type=int, default=20, metavar='N',
                        help='drops for the latency, each way (default: 20)')
    parser.add_argument('--output', type=Path, default=Path('.'), metavar='DIR',
                        help='where benchmark.json and latency.png go (default: here)')
    parser.add_argument('--no-figure', dest='figure', action='store_false',
                        help='make no latency.png')
    parser.add_argument('--setup', type=Path, metavar='REPOSITORY',
                        help='also measure the set-up, in a clone of this repository (some '
                        'minutes; needs the package index)')
    options = parser.parse_args(args)
    if not 1.0 <= options.seconds < inf:
        parser.error(f'--seconds {options.seconds:g}: at least 1')
    if options.drops < 1:
        parser.error(f'--drops {options.drops}: at least 1')
    if options.setup is not None:
        if not (options.setup / 'turtle_brick' / 'scripts' / 'env.bash').is_file():
            parser.error(f'--setup {options.setup}: there is no turtle_brick/scripts/env.bash')
        if shutil.which('git') is None:
            parser.error('--setup: this needs git')
    if options.output.exists() and not options.output.is_dir():
        parser.error(f'--output {options.output}: this is not a directory')
    return options


def main(args: Sequence[str] | None = None) -> int:
    """Run the benchmark; return its exit status."""
    options = parse(args)
    INTERRUPTS.take_over()
    try:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        with reserved_domain() as domain:
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            found = Benchmark(options, load()).run()
        found.update(seconds=options.seconds, drops=options.drops)
        options.output.mkdir(parents=True, exist_ok=True)
        (options.output / 'benchmark.json').write_text(
            json.dumps(plain(found), indent=1) + '\n', encoding='utf-8')
        print(report(found))
        print(f'\n{options.output / "benchmark.json"}')
        if options.figure:
            draw(found, options.output / 'latency.png')
    except KeyboardInterrupt:
        print('benchmark: stopped, and nothing written', file=sys.stderr)
        return 0
    except (OSError, ParameterError, RuntimeError, TimeoutError, ValueError) as error:
        print(f'benchmark: {error}', file=sys.stderr)
        return 1
    return 0


def draw(found: dict[str, Any], path: Path) -> None:
    """Make the figure of the chain from release to motion, if matplotlib is there."""
    if find_spec('matplotlib') is None:
        print('No figure: it needs matplotlib (apt: python3-matplotlib, pip: matplotlib).')
        return
    from turtle_brick.plots import latency
    latency(found['processes']['latency'], path)
    print(path)


if __name__ == '__main__':
    sys.exit(main())
