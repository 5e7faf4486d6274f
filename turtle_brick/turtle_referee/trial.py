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
The program of the referee: it lets a graph show, one after another, all that can be judged.

The robot rests, drives in eight directions and tilts its platform; bricks are placed, dropped out
of reach and within reach. Every wait has an end: a graph that does not answer costs some seconds.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from math import cos, pi, sin
from time import monotonic, time_ns
from typing import NamedTuple

from rcl_interfaces.srv import GetParameters
from rclpy.parameter import parameter_value_to_python
from turtle_referee.graph_client.client import GraphClient, PATIENCE
from turtle_referee.graph_client.constants import ARENA_SIZE, CENTER, REACTION
from turtle_referee.graph_client.geometry import Vector
from turtle_referee.graph_client.observer import Observer
from turtle_referee.graph_client.profile import NUMBERS
from turtle_referee.graph_client.record import Request
from turtle_referee.graph_client.spinning import Spinner
from turtle_referee.rules.robot_model import model
from turtle_referee.rules.rule import Broken

MEETING = 10.0  # how long (s) it may take to hear of everything in a graph that runs
LIMIT = 150.0  # time (s) after which nothing new is begun
LEG = 1.5  # length (m) of each leg
SHORTEST_LEG = 0.3  # length (m) of a leg of the slowest robots
RIM = 0.3  # how far (m) inside the arena bricks are dropped


class Drop(NamedTuple):
    """Where a brick is dropped from."""

    words: str
    turns: float  # its direction from the center
    way: float  # how long (s) the robot would drive at full speed until its platform is below it
    left: float  # the time (s) that is left over then, for a robot that sets off at once

    @property
    def should(self) -> bool | None:
        """Tell whether it can be caught; None where both may be right."""
        return None if 0.0 < self.left < REACTION else self.left > 0.0


FAR_OUT = Drop('the brick is out of reach by far', 0.25, 0.7, -0.25)
IN_REACH = Drop('the brick is in reach', 0.10, 0.4, REACTION + 0.15)


class Program(NamedTuple):
    """How much of each is asked for."""

    idle: float = 3.0  # how long (s) the robot is watched at rest
    legs: int = 8  # how many legs it drives, each in another direction, that end where they began
    tilts: Sequence[float] = (0.5, -0.4, 0.25, 0.0)  # the angles (rad) that are asked for
    drops: Sequence[Drop] = (
        FAR_OUT, Drop('the brick is above the robot', 0.00, 0.0, REACTION + 0.3), IN_REACH,
        Drop('the brick is just out of reach', 0.65, 0.6, -0.05),
        Drop('the brick is just in reach', 0.40, 0.8, REACTION + 0.03),
        Drop('both may be right', 0.90, 0.5, REACTION / 2.0),
        Drop('the brick is in reach', 0.60, 0.7, REACTION + 0.10))


class Trial(GraphClient):
    """All that is asked of a graph."""

    def __init__(self, graph: Spinner, observer: Observer, say: Callable[[str], None],
                 meeting: float = MEETING, is_alive: Callable[[], bool] = lambda: True,
                 program: Program = Program(), patience: float = PATIENCE) -> None:
        """Request for nothing yet, of a graph that may take a time (s) to be there while it lives."""
        super().__init__(graph, observer, patience)
        self.say = say
        self.meeting = meeting
        self.is_alive = is_alive
        self.program = program
        self.end = monotonic() + LIMIT

    def run(self) -> None:
        """Go through the whole program."""
        if self.meet():
            self.rest()
            self.drive()
            # The first brick lies on the ground then, and has the platform's angle there too.
            self.drop_all(self.program.drops[:1])
            self.tilt()
            self.drop_all(self.program.drops[1:])

    # ------------------------------------------------------------------------------- the start

    def meet(self) -> bool:
        """Wait until the graph is there; tell whether there is anything."""
        self.say('looking for the graph')
        self.until(lambda: self.is_complete() or not self.is_alive(), self.meeting)
        if self.record.is_empty() and not self.has('place'):
            self.record.notes.append(
                'nothing of the exercise is heard here: start the graph in this ROS domain, name '
                'its namespace with --namespace, or give what starts it behind "--"')
            return False
        self.read_numbers()
        return True

    def read_numbers(self) -> None:
        """Request the nodes for the numbers that were not given, and the URDF for the radius."""
        numbers, clients = self.record.profile.numbers, self.observer.parameter_clients()
        # Some may have no such service, or not answer.
        self.until(lambda: all(client.service_is_ready() for client in clients), self.patience)
        # One by one: who lacks one of several gives none of them.
        asked = [(name, self.observer.listener.ask(client, GetParameters.Request(names=[name])))
                 for client in clients if client.service_is_ready()
                 for name in NUMBERS if name not in numbers]
        self.until(lambda: all(answers for _, answers in asked), 2.0 * self.patience)
        for name, answers in asked:
            for value in (value for heard in answers for value in heard.message.values):
                number = parameter_value_to_python(value)
                if type(number) in (int, float) and 0.0 < number < 1e9:
                    numbers.setdefault(name, float(number))
        with suppress(Broken):  # The assignment gives this one no name.
            robot = model(self.record)
            numbers.setdefault('platform_radius', robot.solid('platform', 'cylinder').size[0])

    def rest(self) -> None:
        """Watch the robot at rest."""
        self.say('at rest')
        begin = time_ns()
        self.graph.spin_for(self.program.idle)
        self.record.idle.append((begin, time_ns()))

    def drive(self) -> None:
        """Drive some legs, and back to the center."""
        leg = min(LEG, max(SHORTEST_LEG, self.number('max_velocity')))
        self.go(CENTER)
        begin = time_ns()
        for number in range(self.program.legs):
            turns = number / self.program.legs
            self.say(f'driving {360.0 * turns:.0f} degrees')
            drive = self.go(beside(self.robot_position() or CENTER, turns, leg))
            if drive is None or self.distance_to(drive.start) < 0.01:
                break
        self.record.driving.append((begin, time_ns()))
        self.go(CENTER)

    def tilt(self) -> None:
        """Tilt the platform to and fro."""
        self.say('tilting')
        for angle in self.program.tilts:
            begin = time_ns()
            try:
                self.observer.send_tilt(angle)
            except LookupError as error:
                self.record.tilts.append(Request(begin, time_ns(), angle, False, str(error)))
                return
            self.graph.spin_for(0.6)
            self.record.tilts.append(Request(begin, time_ns(), angle))

    def place_of(self, drop: Drop) -> Vector:
        """Return from where a brick is dropped."""
        speed, radius = self.number('max_velocity'), self.number('platform_radius')
        distance = min(radius + drop.way * speed if drop.way else 0.3 * radius,
                       ARENA_SIZE / 2.0 - RIM)
        time = max(max(distance - radius, 0.0) / speed + drop.left, 0.1)
        height = self.number('platform_height') + self.number('gravity_accel') * time ** 2 / 2.0
        return *beside(CENTER, drop.turns, distance), height

    def drop_all(self, drops: Sequence[Drop]) -> None:
        """Drop one brick after another."""
        for drop in drops:
            if monotonic() > self.end:
                self.record.notes.append(f'not dropped any more: {drop.words}')
                continue
            place = self.place_of(drop)
            self.say(f'{drop.words}, at ' + '({:.2f}, {:.2f}, {:.2f})'.format(*place))
            if self.distance_to(CENTER) > 0.02:
                self.go(CENTER)
            if not self.place(place).accepted:
                continue
            watch = self.drop(place)
            if set(NUMBERS) <= set(self.record.profile.numbers):
                watch.should = drop.should
            if watch.floated and not any(one.floated for one in self.record.drops[:-1]):
                # Where it floats, it stays, wherever the robot goes.
                self.go((CENTER[0] + 0.8, CENTER[1]))
                watch.end = time_ns()


def beside(place: Sequence[float], turns: float, distance: float) -> tuple[float, float]:
    """Return a point at a distance (m) from another, in a direction."""
    angle = 2.0 * pi * turns
    return place[0] + distance * cos(angle), place[1] + distance * sin(angle)
