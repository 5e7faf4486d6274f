# SPDX-License-Identifier: Apache-2.0
"""
Send a sequence of test requests to a running graph.

The robot waits, drives in eight directions and tilts its platform. Bricks are dropped within and
beyond the robot's reach. Every wait has a timeout, so a missing response costs only a few seconds.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from math import cos, pi, sin
from pathlib import Path
from time import monotonic, time_ns
from typing import Any, NamedTuple

from ament_index_python.packages import get_package_share_directory
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import parameter_value_to_python
from turtle_graph.client.client import GraphClient, TIMEOUT
from turtle_graph.client.drops import DropWatch
from turtle_graph.client.geometry import ARENA_SIZE, CENTER, Vector
from turtle_graph.client.observer import Observer
from turtle_graph.client.profiles import NUMBERS
from turtle_graph.client.record import EXTRAPOLATION_NS, LOADED, Request
from turtle_graph.client.spinning import Spinner
from turtle_graph.referee.rules.catcher_rules import is_text_visible
from turtle_graph.referee.rules.robot_model import model
from turtle_graph.referee.rules.rule import Failed, Open
import yaml

REACTION_TIME = 0.3
"""Maximum permitted time (s) between a brick's release and the robot's reaction."""
DISCOVERY_TIME = 10.0
"""Timeout (s) for discovering a running graph."""
COMPLETION_TIME = 20.0
"""Maximum time (s) between the discovery of one topic and of the next one."""
LAST_DROP_TIME = 50.0
"""Time limit (s) from the discovery of the graph to the start of the last drop."""
REPETITION_TIME = 20.0
"""Time limit (s) for each repetition on a busy machine."""
ATTEMPTS = 3
"""Maximum number of requests for the parameters of a node."""
TEXT_TIME = 4.0
"""Timeout (s) for the end of the text about the previous brick."""
LEG, MIN_LEG = 1.5, 0.3
"""Maximum and minimum length (m) of a drive. Slow robots drive shorter distances."""
REACH_NUMBERS = {*NUMBERS} - {'wheel_radius'}
"""Parameters that decide whether a brick can be caught."""
EDGE_DISTANCE = 0.3
"""Minimum distance (m) between a dropped brick and the edge of the arena."""


class PlannedDrop(NamedTuple):
    """Parameters from which the starting position of a drop is computed."""

    description: str
    direction: float  # Direction (in full turns) from the arena center to the brick.
    driving_time: float  # Time (s) until the platform can reach the brick at full speed.
    spare_time: float  # Fall time (s) minus driving time (s) of the platform's edge or center.


FAR_OUT = PlannedDrop('brick far out of reach', 0.25, 0.7, -0.25)
IN_REACH = PlannedDrop('brick in reach', 0.10, 0.4, REACTION_TIME + 0.15)


class Program(NamedTuple):
    """The requests that a trial sends."""

    idle: float = 3.0  # Time (s) for which the resting robot is observed.
    legs: int = 8  # Number of drives, which together form a closed polygon.
    tilts: Sequence[float] = (1.0, -0.4, 0.25, 0.0)  # Angles (rad) of the platform.
    drops: Sequence[PlannedDrop] = (
        FAR_OUT, PlannedDrop('brick above the robot', 0.10, 0.0, REACTION_TIME + 0.3), IN_REACH,
        PlannedDrop('brick just out of reach', 0.65, 0.6, -0.05),
        PlannedDrop('brick just in reach', 0.40, 0.8, REACTION_TIME + 0.03),
        PlannedDrop('brick that may be caught or refused', 0.90, 0.5, REACTION_TIME / 2.0),
        PlannedDrop('brick in reach', 0.60, 0.7, REACTION_TIME + 0.10))
    repetitions: int = 3  # Maximum number of repetitions on a busy machine.


PROGRAMS = {None: Program(), 1: Program(tilts=(), drops=()), 2: Program(drops=()),
            3: Program(legs=0), 4: Program(tilts=(), drops=()), 5: Program(legs=0, tilts=())}
"""The requests that the requirements of each hour of class need (None: all requirements)."""
STRUCTURE = Program(idle=0.5, legs=0, tilts=(), drops=())
"""No requests: only the names and the structure of the graph are observed."""


class Trial(GraphClient):
    """A client that tests a graph with a sequence of requests."""

    def __init__(self, graph: Spinner, observer: Observer, log: Callable[[str], None],
                 discovery_time: float = DISCOVERY_TIME,
                 is_alive: Callable[[], bool] = lambda: True,
                 program: Program = Program(), timeout: float = TIMEOUT) -> None:
        """Prepare a trial of a graph. `is_alive` returns whether the graph may still appear."""
        super().__init__(graph, observer, timeout)
        self.log = log
        self.discovery_time = discovery_time
        self.is_alive = is_alive
        self.program = program
        self.watches: dict[PlannedDrop, DropWatch] = {}

    def run(self) -> None:
        """Discover the graph and send all planned requests."""
        if not self.discover():
            return
        self.end = monotonic() + LAST_DROP_TIME
        now = time_ns()
        if self.program.drops and not self.record.pose('brick', now - 2 * EXTRAPOLATION_NS):
            self.place(self.start_of(FAR_OUT))  # Some arenas have no brick until one is placed.
        self.rest()
        self.drive()
        # The first drop leaves a brick on the ground, so that its inclination can be judged.
        self.drop_all(self.program.drops[:1])
        self.tilt()
        self.drop_all(self.program.drops[1:])
        for _ in range(self.program.repetitions):
            self.repeat()

    def repeat(self) -> None:
        """Repeat the trials in which other programs delayed the graph, with a time limit."""
        self.end = monotonic() + REPETITION_TIME
        calm = self.record.calm()
        spoiled = [drop for drop, watch in self.watches.items() if watch not in calm.drops]
        driven = any(drive.length >= MIN_LEG for drive in calm.drives)
        missing = [(calm.idle or not self.is_at_rest(), self.rest),
                   (not self.program.legs or driven, self.drive),
                   (not self.program.tilts or calm.tilts, self.tilt),
                   (not spoiled, lambda: self.drop_all(spoiled))]
        if not all(is_calm for is_calm, _ in missing):
            self.log(f'repeating trials because {LOADED}')
        for is_calm, trial in missing:
            if not is_calm:
                trial()

    def discover(self) -> bool:
        """Wait for all nodes of the graph to start, and return whether a graph was found."""
        self.log('looking for the graph')
        self.wait_until(lambda: self.record.publishers or not self.is_alive(), self.discovery_time)
        known = -1
        while known < len(self.record.publishers) and self.is_alive() and self.awaited():
            known = len(self.record.publishers)
            self.log(f'waiting for {", ".join(self.awaited())}')
            self.wait_until(lambda: not self.awaited() or not self.is_alive(),
                            min(self.discovery_time, COMPLETION_TIME))
        self.wait_until(lambda: not self.missing(), self.timeout)
        others = sorted(self.observer.other_namespaces())
        # Topics may have unusual names, and each node may be in a namespace of its own.
        if self.missing() and not (self.is_empty() and len(others) == 1):
            self.observer.recognize_names()
            self.wait_until(lambda: not self.missing(), self.timeout)
        if self.is_empty() or not self.is_alive():
            self.record.notes.append(
                f'found no graph in the namespace {self.observer.get_namespace()}, but nodes in '
                f'{", ".join(others)}; pass the namespace of the graph with --namespace' if others
                else 'found no graph: start it in this ROS domain, pass its namespace with '
                '--namespace, or pass its launch command after "--"')
            return False
        self.read_numbers()
        return True

    def awaited(self) -> list[str]:
        """Return what is missing, except for a brick that may first have to be placed."""
        later = ('tilt', *(('frame brick', 'markers') if self.has_service('place') else ()))
        return [name for name in self.missing() if name not in later]

    def is_empty(self) -> bool:
        """Return whether no graph was found (TF may come from other graphs and does not count)."""
        return not any(self.record.topics.values()) and not self.has_service('place')

    def read_numbers(self) -> None:
        """Add robot parameters from the nodes and the URDF to the profile."""
        numbers, clients = self.record.profile.numbers, self.observer.parameter_clients()
        values: dict[str, set[float]] = {name: set() for name in NUMBERS if name not in numbers}
        # Some nodes may have no parameter service, or may not respond.
        self.wait_until(lambda: all(client.service_is_ready() for client in clients), self.timeout)
        for _ in range(ATTEMPTS):
            # A node that lacks one of several requested parameters returns none of them.
            calls = [(name, self.observer.poller.call(client, GetParameters.Request(names=[name])))
                     for client in clients if client.service_is_ready()
                     for name in values]
            self.wait_until(lambda: all(responses for _, responses in calls), 2.0 * self.timeout)
            for name, responses in calls:
                for response in responses:
                    for value in map(parameter_value_to_python, response.message.values):
                        # In some workspaces, gravity_accel is negative.
                        if type(value) in (int, float) and 0.0 < abs(value) < 1e9:
                            values[name].add(abs(float(value)))
            if all(responses for _, responses in calls):
                break
        configured = configured_numbers()
        for name, known in values.items():
            if len(known) > 1:
                self.record.note(f'the nodes have different values of {name}: '
                                 f'{", ".join(f"{value:g}" for value in sorted(known))}')
            if known and configured.get(name) not in known:
                numbers[name] = min(known)
            elif name in configured:
                numbers[name] = configured[name]
        with suppress(Failed, Open):  # The assignment does not name a platform_radius parameter.
            robot = model(self.record)
            numbers.setdefault('platform_radius', robot.solid('platform', 'cylinder').size[0])

    def rest(self) -> None:
        """Observe the robot at rest."""
        self.log('at rest')
        begin = time_ns()
        self.graph.spin_for(self.program.idle)
        self.record.idle.append((begin, time_ns()))

    def drive(self) -> None:
        """Drive along all sides of a regular polygon, and return to the arena center."""
        if not self.program.legs:
            return
        leg = min(LEG, max(MIN_LEG, self.number('max_velocity')))
        self.return_to_center()
        for number in range(self.program.legs):
            direction = number / self.program.legs
            self.log(f'driving {360.0 * direction:.0f} degrees')
            drive = self.drive_to(offset_by(self.robot_position() or CENTER, direction, leg))
            if (drive is None or self.distance_to(drive.start) < 0.01 or not self.is_at_rest()
                    or monotonic() > self.end - LAST_DROP_TIME / 2.0):
                break
        self.return_to_center()

    def return_to_center(self) -> None:
        """Drive to the arena center unless the robot is already there."""
        if self.distance_to(CENTER) > 0.02:
            self.drive_to(CENTER)

    def tilt(self) -> None:
        """Tilt the platform to each planned angle."""
        if self.program.tilts:
            self.log('tilting')
        for angle in self.program.tilts:
            begin, is_sent = time_ns(), self.observer.send_tilt(angle)
            self.graph.spin_for(0.6 if is_sent else 0.0)
            self.record.tilts.append(Request(
                begin, time_ns(), angle, is_sent, 'no node subscribes to tilt', is_sent))

    def platform_height(self) -> float:
        """Return the height (m) of the platform: the parameter, the height in TF, or a guess."""
        platform = self.record.pose('platform', time_ns() - EXTRAPOLATION_NS)
        if 'platform_height' in self.record.profile.numbers or platform is None:
            return self.number('platform_height')
        return float(platform.position[2])

    def start_of(self, drop: PlannedDrop) -> Vector:
        """Return the starting position (m) of the brick for a planned drop."""
        speed, radius = self.number('max_velocity'), self.number('platform_radius')
        distance = min(radius + drop.driving_time * speed if drop.driving_time else 0.3 * radius,
                       ARENA_SIZE / 2.0 - EDGE_DISTANCE)
        # A catcher may promise only bricks that the center of the platform can reach.
        way = distance if drop.spare_time > 0.0 else max(distance - radius, 0.0)
        time = max(way / speed + drop.spare_time, 0.1)
        height = self.platform_height() + self.number('gravity_accel') * time ** 2 / 2.0
        return *offset_by(CENTER, drop.direction, distance), height

    def drop_all(self, drops: Sequence[PlannedDrop]) -> None:
        """Drop each brick after the robot has returned to the arena center."""
        for drop in drops:
            if monotonic() > self.end:
                self.record.note('some bricks were not dropped for lack of time')
                continue
            place = self.start_of(drop)
            self.log(f'{drop.description}, at ' + '({:.2f}, {:.2f}, {:.2f})'.format(*place))
            self.return_to_center()
            self.wait_until(lambda: not is_text_visible(self.record, time_ns()), TEXT_TIME)
            request = self.place(place)
            if not request.accepted:
                continue
            self.watches[drop] = watch = self.drop(request.value)
            both_may_be_right = 0.0 < drop.spare_time < REACTION_TIME or request.value != place
            known = REACH_NUMBERS <= set(self.record.profile.numbers)
            if known and not both_may_be_right:
                watch.should_be_caught = drop.spare_time > 0.0
            if watch.floated and not any(
                    earlier.floated for earlier in self.record.drops[:-1]):
                # A floating brick must not move with the robot.
                self.drive_to((CENTER[0] + 0.8, CENTER[1]))
                watch.end = time_ns()


def configured_numbers() -> dict[str, float]:
    """Return the robot's parameters in the config/turtle.yaml of the sourced workspace."""
    numbers: dict[str, float] = {}

    def collect(content: Any) -> None:
        for name, value in content.items() if isinstance(content, dict) else ():
            if name in NUMBERS and type(value) in (int, float) and value:
                numbers[name] = abs(float(value))
            collect(value)

    with suppress(LookupError, OSError, ValueError, yaml.YAMLError):
        share = Path(get_package_share_directory('turtle_brick'))
        for path in share.rglob('turtle.yaml'):
            collect(yaml.safe_load(path.read_text(encoding='utf-8')))
    return numbers


def offset_by(start: Sequence[float], direction: float, distance: float) -> tuple[float, float]:
    """Return the point at a distance (m) and in a direction (turns) from a starting point."""
    angle = 2.0 * pi * direction
    return start[0] + distance * cos(angle), start[1] + distance * sin(angle)
