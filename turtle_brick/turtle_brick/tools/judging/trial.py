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
The programme of the referee: it lets a graph show, one after another, all that can be judged.

The robot rests, drives in eight directions and tilts its platform; bricks are placed, dropped out
of reach and within reach. Every wait has an end: a graph that does not answer costs some seconds.
"""

from collections.abc import Callable
from math import cos
from math import hypot
from math import pi
from math import sin
from math import sqrt
from time import monotonic
from time import time_ns
from typing import Any
from typing import NamedTuple

from rclpy.client import Client
from turtle_brick.geometry import Vector
from turtle_brick.step_clock import NANOSECONDS
from turtle_brick.tools.graph import Graph
from turtle_brick.tools.judging.drops import DropWatch
from turtle_brick.tools.judging.names import CENTER
from turtle_brick.tools.judging.names import NUMBERS
from turtle_brick.tools.judging.observer import answer
from turtle_brick.tools.judging.observer import Observer
from turtle_brick.tools.judging.record import Ask
from turtle_brick.tools.judging.record import Drive
from turtle_brick.tools.judging.record import plateau
from turtle_brick.tools.judging.robot_model import RobotModel
from turtle_brick.tools.judging.stalls import StallWatch
from turtle_brick.turtlesim_kinematics import ARENA_SIZE

IDLE = 3.0
"""How long (s) the robot is watched at rest."""

LEG = 1.5
"""Length (m) of each of the eight legs."""

SHORTEST_LEG = 0.3
"""Length (m) of a leg of the slowest robots."""

PATIENCE = 3.0
"""How long (s) something may take that should be done at once."""

REST = 0.3
"""How long (s) a robot stands still that is at rest."""

TILTS = (0.5, -0.4, 0.25, 0.0)
"""The angles (rad) that are asked for."""

LATE = 0.01
"""How late (s) the machine may wake somebody up to be on time."""

DROPS = (
    ('the brick is out of reach by far', 0.25, 0.7, -0.25),
    ('the brick is above the robot', 0.00, 0.0, 0.3),
    ('the brick is in reach', 0.10, 0.4, 0.15),
    ('the brick is just out of reach', 0.65, 0.6, -0.05),
    ('the brick is just in reach', 0.40, 0.8, 0.03),
    ('both may be right', 0.90, 0.5, None),
    ('the brick is in reach', 0.60, 0.7, 0.10),
)
"""What is dropped: why, its direction (turns), how long (s) the robot would drive at its greatest
speed until its platform is below the brick, and the time (s) that is left over: on top of the
time to react if positive, missing to a robot that sets off at once if negative. None: half of the
time to react is left, so that nobody can say from outside whether the brick can be caught."""

RIM = 0.3
"""How far (m) inside the arena bricks are dropped."""


class Placing(NamedTuple):
    """Where a brick is dropped from, and whether it can be caught."""

    words: str
    place: Vector
    reachable: bool | None
    """None where both may be right."""


class Trial:
    """All that is asked of a graph."""

    def __init__(self, graph: Graph, observer: Observer, reaction: float,
                 say: Callable[[str], None], limit: float = 150.0) -> None:
        """
        Ask for nothing yet.

        :param graph: spins the observer
        :param observer: hears and asks
        :param reaction: time (s) that an implementation may need from release to motion
        :param say: told what is being done
        :param limit: time (s) after which nothing new is begun
        """
        self.graph = graph
        self.observer = observer
        self.record = observer.record
        self.reaction = reaction
        self.say = say
        self.end = monotonic() + limit

    def run(self) -> None:
        """Go through the whole programme."""
        offset = time_ns() - round(monotonic() * NANOSECONDS)
        begin, watch = monotonic(), StallWatch(LATE)
        try:
            if self.meet():
                self.rest()
                self.drive()
                self.tilt()
                self.drop_all()
        finally:
            self.record.stalls = [
                (round(start * NANOSECONDS) + offset, round(end * NANOSECONDS) + offset)
                for start, end in watch.stalls(begin)]
            watch.close()

    def until(self, condition: Callable[[], Any], timeout: float) -> bool:
        """Wait until a condition holds; tell whether it does."""
        try:
            self.graph.spin_until(condition, timeout, '')
        except TimeoutError:
            return False
        return True

    # ------------------------------------------------------------------------------- the start

    def meet(self, patience: float = 10.0) -> bool:
        """Wait until the graph is there; tell whether there is anything."""
        record = self.record
        self.say('looking for the graph')

        def complete() -> bool:
            topics = ('pose', 'cmd_vel', 'odom', 'joint_states', 'robot_description')
            return bool(all(record.topics[name] for name in topics) and record.frame('brick')
                        and record.frame('platform') and record.markers
                        and self.has('place') and self.has('drop')
                        and self.observer.hears_goals())

        self.until(complete, patience)
        self.read_numbers()
        return bool(record.frames or any(record.topics.values()) or self.has('place'))

    def has(self, service: str) -> bool:
        """Tell whether a service is there."""
        try:
            return self.observer.client(service).service_is_ready()
        except LookupError:
            return False

    def read_numbers(self) -> None:
        """Ask the nodes for the numbers that were not given, and the URDF for the rest."""
        numbers = self.record.profile.numbers
        own = (self.observer.get_name(), self.observer.get_namespace())
        if set(NUMBERS) - set(numbers):
            asked = [self.observer.ask_parameters(f'{namespace.rstrip("/")}/{name}')
                     for name, namespace in self.observer.get_node_names_and_namespaces()
                     if (name, namespace) != own]
            self.until(lambda: all(one.done() for one in asked), PATIENCE)
            for one in asked:
                values = one.result().values if one.done() and one.result() else []
                for name, value in zip(NUMBERS, values):
                    number = {2: value.integer_value, 3: value.double_value}.get(value.type, 0.0)
                    if 0.0 < number < 1e9:
                        numbers.setdefault(name, float(number))
        model = self.model()
        if model is not None:
            for name, value in model.numbers(self.record.profile.frames['platform']).items():
                if value > 0.0 and name not in numbers:
                    numbers[name] = value
                    self.record.profile.guessed.add(name)

    def model(self) -> RobotModel | None:
        """Return the robot's model, None where there is none."""
        return RobotModel.of(self.record)

    # ------------------------------------------------------------------------------- the robot

    def robot(self) -> tuple[float, float] | None:
        """Return where the robot is in the world (m), None where nobody says."""
        if self.record.topics['pose']:
            pose = self.record.topics['pose'][-1].message
            return pose.x, pose.y
        base = self.record.pose(self.record.profile.frames['base_link'], time_ns())
        return base.position[:2] if base else None

    def is_at_rest(self) -> bool:
        """Tell whether the robot has stood still for a while."""
        since = time_ns() - round(REST * NANOSECONDS)
        poses = self.record.heard('pose', since)
        if len(poses) < 3:
            return False
        track = [(one.published, (one.message.x, one.message.y, 0.0)) for one in poses]
        return plateau(track, 1e-3, 0) == track[0][0]

    def number(self, name: str) -> float:
        """Return a number of the robot, a usual one where none is known."""
        return self.record.profile.numbers.get(name, {
            'platform_height': 1.0, 'platform_radius': 0.5, 'wheel_radius': 0.2,
            'max_velocity': 1.0, 'gravity_accel': 9.81}[name])

    def rest(self) -> None:
        """Watch the robot at rest."""
        self.say('at rest')
        begin = time_ns()
        self.graph.spin_for(IDLE)
        self.record.idle.append((begin, time_ns()))

    def go(self, goal: tuple[float, float]) -> Drive | None:
        """Send the robot somewhere and wait until it rests; return the drive, if it is known."""
        start = self.robot()
        if start is None:
            return None
        begin = time_ns()
        self.observer.send_goal(*goal)
        # It has to set off first: what rests in the beginning has not arrived.
        far = hypot(goal[0] - start[0], goal[1] - start[1]) > 0.02

        def set_off() -> bool:
            robot = self.robot()
            return robot is not None and hypot(robot[0] - start[0], robot[1] - start[1]) > 0.01

        if not far or self.until(set_off, PATIENCE):
            way = hypot(goal[0] - start[0], goal[1] - start[1])
            self.until(self.is_at_rest, way / self.number('max_velocity') * 2.0 + PATIENCE)
        drive = Drive(begin, time_ns(), start, goal)
        self.record.drives.append(drive)
        return drive

    def drive(self) -> None:
        """Drive eight legs, each in another direction, that end where they began."""
        leg = min(LEG, max(SHORTEST_LEG, self.number('max_velocity')))
        where = self.robot()
        if where is None or not self.until(self.observer.hears_goals, PATIENCE):
            self.record.notes.append('nobody hears goal_pose, or says where the robot is')
            return
        center = self.go(CENTER)
        for number in range(8):
            start = self.robot()
            if start is None or center is None:
                return
            angle = number * pi / 4.0
            self.say(f'driving {45 * number} degrees')
            drive = self.go((start[0] + leg * cos(angle), start[1] + leg * sin(angle)))
            robot = self.robot()
            if drive is None or robot is None or hypot(
                    robot[0] - start[0], robot[1] - start[1]) < 0.01:
                self.record.notes.append('the robot does not drive')
                return
        self.go(CENTER)

    def tilt(self) -> None:
        """Tilt the platform to and fro."""
        self.say('tilting')
        for angle in TILTS:
            begin = time_ns()
            try:
                self.until(lambda: self.observer.tilt_type() is not None, 0.0)
                self.observer.send_tilt(angle)
            except LookupError as error:
                self.record.tilts.append(Ask(begin, time_ns(), angle, False, False, str(error)))
                return
            self.graph.spin_for(0.6)
            self.record.tilts.append(Ask(begin, time_ns(), angle))

    # ------------------------------------------------------------------------------- the brick

    def call(self, client: Client, request: Any, what: Any) -> Ask:
        """Call a service, and return what it said."""
        begin = time_ns()
        future = client.call_async(request)
        if not self.until(future.done, PATIENCE):
            return Ask(begin, time_ns(), what, False, False, 'no answer')
        return answer(begin, what, future.result())

    def place(self, place: Vector) -> bool:
        """Place the brick; tell whether it was done, as far as one is told."""
        try:
            if not self.until(lambda: self.has('place'), PATIENCE):
                raise LookupError('there is no service place')
            ask = self.call(self.observer.client('place'),
                            self.observer.request_place(place), place)
        except LookupError as error:
            ask = Ask(time_ns(), time_ns(), place, False, False, str(error))
        if ask.answered:
            self.graph.spin_for(0.5)
        self.record.places.append(ask._replace(end=time_ns()))
        return ask.answered and ask.accepted

    def drop_from(self, place: Vector, watch_end: Callable[[DropWatch], bool] | None = None,
                  told: Callable[[DropWatch], None] = lambda watch: None) -> DropWatch | None:
        """
        Place the brick, drop it and wait until all is over.

        :param place: where (m)
        :param watch_end: tells when it is over; None: when a caught brick was tipped off and the
            platform is level, or 0.6 s after any other has come down
        :param told: called whenever something has been heard
        :return: What became of it, None if it could not be placed.
        """
        if not self.place(place):
            return None
        now = time_ns()
        watch = DropWatch(self.record, now, place, self.record.platform(now - 20_000_000))

        def look() -> None:
            watch.look()
            told(watch)

        self.observer.on_news = look
        try:
            ask = self.let_go(watch)
            if not ask.answered or not self.until(lambda: watch.released, PATIENCE):
                return watch
            fall = sqrt(2.0 * max(place[2], 0.1) / self.number('gravity_accel'))
            self.until(lambda: watch.down, fall * 1.5 + PATIENCE)
            if watch.caught:
                across = ARENA_SIZE / self.number('max_velocity')
                self.until(lambda: watch.tilted, across * 1.5 + PATIENCE)
                self.until(lambda: watch.floated, 2.0 * PATIENCE)
                self.until(lambda: watch.levelled and self.is_at_rest(), PATIENCE)
            else:
                self.graph.spin_for(0.6)
                self.until(self.is_at_rest, PATIENCE)
        finally:
            self.observer.on_news = lambda: None
            watch.end = time_ns()
            self.record.drops.append(watch)
        return watch

    def let_go(self, watch: DropWatch) -> Ask:
        """Ask for the drop."""
        watch.asked = time_ns()
        try:
            ask = self.call(self.observer.client('drop'), self.observer.request_drop(), 'drop')
        except LookupError as error:
            ask = Ask(watch.asked, time_ns(), 'drop', False, False, str(error))
        if ask.answered:
            watch.answered = ask.end
        watch.ask = ask
        return ask

    def placings(self) -> list[Placing]:
        """Return from where bricks are dropped around the robot at the center."""
        speed, radius = self.number('max_velocity'), self.number('platform_radius')
        gravity, rest = self.number('gravity_accel'), self.number('platform_height')
        found = []
        for words, turn, way, left in DROPS:
            distance = radius + way * speed if way else 0.3 * radius
            if distance > ARENA_SIZE / 2.0 - RIM:
                distance = ARENA_SIZE / 2.0 - RIM
                way = (distance - radius) / speed
            spare = self.reaction / 2.0 if left is None else (
                left if left < 0.0 else self.reaction + left)
            time = max(way + spare, 0.1)
            angle = 2.0 * pi * turn
            # With half a brick to spare, whose height nobody knows yet.
            height = rest + self.half_height() + gravity * time * time / 2.0
            place = (CENTER[0] + distance * cos(angle), CENTER[1] + distance * sin(angle), height)
            found.append(Placing(words, place, None if left is None else left > 0.0))
        return found

    def half_height(self) -> float:
        """Return half the brick's height (m), as its marker has it; 0 where none tells."""
        size = brick_size(self.record)
        return size[2] / 2.0 if size else 0.0

    def drop_all(self) -> None:
        """Drop one brick after another."""
        frame = self.record.frame('brick')
        if frame is None:
            self.record.notes.append('there is no brick')
        failures = 0
        for placing in self.placings():
            if monotonic() > self.end or failures > 1:
                self.record.notes.append(f'not dropped any more: {placing.words}')
                continue
            self.say(f'{placing.words}, at ({placing.place[0]:.2f}, {placing.place[1]:.2f}, '
                     f'{placing.place[2]:.2f})')
            robot = self.robot()
            if robot and hypot(robot[0] - CENTER[0], robot[1] - CENTER[1]) > 0.02:
                self.go(CENTER)
            watch = self.drop_from(placing.place)
            failures += watch is None or watch.released is None
            if watch is None:
                continue
            watch.should = placing.reachable
            if watch.floated and not any(one.left_alone for one in self.record.drops):
                # Where it floats, it stays, wherever the robot goes.
                watch.left_alone = time_ns()
                self.go((CENTER[0] + 0.8, CENTER[1]))
                watch.end = time_ns()


def brick_size(record: Any) -> Vector | None:
    """Return the size (m) of the brick along its axes as its marker has it, None without one."""
    frame = record.profile.frames['brick']
    for heard in reversed(record.markers):
        marker = heard.marker
        if marker.header.frame_id.lstrip('/') == frame and marker.type == marker.CUBE:
            return marker.scale.x, marker.scale.y, marker.scale.z
    for heard in reversed(record.markers):
        if 'brick' in heard.topic + heard.marker.ns and heard.marker.type == heard.marker.CUBE:
            return heard.marker.scale.x, heard.marker.scale.y, heard.marker.scale.z
    return None
