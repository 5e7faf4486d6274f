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

from turtle_referee.arena_rules import half_height
from turtle_referee.constants import ARENA_SIZE, CENTER
from turtle_referee.geometry import Vector
from turtle_referee.hands import Hands, PATIENCE
from turtle_referee.names import NUMBERS
from turtle_referee.observer import Observer
from turtle_referee.record import Ask
from turtle_referee.robot_model import model
from turtle_referee.rules import Broken, Open
from turtle_referee.spinning import Spins

MEETING = 10.0
"""How long (s) it may take to hear of everything in a graph that runs."""

LEG = 1.5
"""Length (m) of each leg."""

SHORTEST_LEG = 0.3
"""Length (m) of a leg of the slowest robots."""

RIM = 0.3
"""How far (m) inside the arena bricks are dropped."""


class Drop(NamedTuple):
    """Where a brick is dropped from."""

    words: str
    turns: float
    """Its direction from the center."""
    way: float
    """How long (s) the robot would drive at its greatest speed until its platform is below it."""
    left: float | None
    """The time (s) that is left over: on top of the time to react if positive, missing to a robot
    that sets off at once if negative. None: half of the time to react is left, so that nobody can
    say from outside whether the brick can be caught."""


FAR_OUT = Drop('the brick is out of reach by far', 0.25, 0.7, -0.25)
IN_REACH = Drop('the brick is in reach', 0.10, 0.4, 0.15)


class Program(NamedTuple):
    """How much of each is asked for."""

    idle: float = 3.0
    """How long (s) the robot is watched at rest."""
    legs: int = 8
    """How many legs it drives, each in another direction, that end where they began."""
    tilts: Sequence[float] = (0.5, -0.4, 0.25, 0.0)
    """The angles (rad) that are asked for."""
    drops: Sequence[Drop] = (
        FAR_OUT, Drop('the brick is above the robot', 0.00, 0.0, 0.3), IN_REACH,
        Drop('the brick is just out of reach', 0.65, 0.6, -0.05),
        Drop('the brick is just in reach', 0.40, 0.8, 0.03),
        Drop('both may be right', 0.90, 0.5, None),
        Drop('the brick is in reach', 0.60, 0.7, 0.10))


class Trial(Hands):
    """All that is asked of a graph."""

    def __init__(self, graph: Spins, observer: Observer, reaction: float,
                 say: Callable[[str], None], meeting: float = MEETING,
                 is_alive: Callable[[], bool] = lambda: True, program: Program = Program(),
                 limit: float = 150.0, patience: float = PATIENCE) -> None:
        """
        Ask for nothing yet.

        :param reaction: time (s) that an implementation may need from release to motion
        :param say: told what is being done
        :param meeting: how long (s) the graph may take to be there
        :param is_alive: tells whether what was started for it still runs
        :param limit: time (s) after which nothing new is begun
        """
        super().__init__(graph, observer, patience)
        self.reaction = reaction
        self.say = say
        self.meeting = meeting
        self.is_alive = is_alive
        self.program = program
        self.end = monotonic() + limit
        self.failures = 0
        """Bricks that were not placed, or did not fall."""

    def run(self) -> None:
        """Go through the whole program."""
        if self.meet():
            self.rest()
            self.drive()
            # The first brick lies on the ground then, and has the platform's angle there too.
            self.drop_all(self.program.drops[:1])
            self.tilt()
            self.drop_all(self.program.drops[1:])
            # Another graph may have come meanwhile.
            self.record.notes += [doubt for doubt in self.observer.doubts()
                                  if doubt not in self.record.notes]

    # ------------------------------------------------------------------------------- the start

    def meet(self) -> bool:
        """Wait until the graph is there; tell whether there is anything."""
        record = self.record
        self.say('looking for the graph')
        self.until(lambda: self.sees_everything() or not self.is_alive(), self.meeting)
        record.notes += self.observer.doubts()
        if self.observer.elsewhere() and not (any(record.topics.values()) or self.has('place')):
            # All namespaces may share /tf, and hear each other's markers.
            record.frames.clear()
            record.markers.clear()
        else:
            self.read_numbers()
        if not record.is_empty() or self.has('place'):
            return True
        record.notes.append('nothing of the exercise is heard here: start the graph in this ROS '
                            'domain and namespace, or give what starts it behind "--"')
        return False

    def read_numbers(self) -> None:
        """Ask the nodes for the numbers that were not given, and the URDF for the rest."""
        numbers = self.record.profile.numbers
        if set(NUMBERS) - set(numbers):
            nodes = self.observer.others()
            # Some may have no such service, or not answer.
            self.until(lambda: all(map(self.observer.has_parameters, nodes)), self.patience)
            asked = [(name, self.observer.ask_parameter(node, name)) for node in nodes
                     if self.observer.has_parameters(node) for name in NUMBERS]
            self.until(lambda: all(future.done() for _, future in asked), 2.0 * self.patience)
            for name, future in asked:
                values = future.result().values if future.done() and future.result() else []
                for value in values:
                    number = {2: value.integer_value, 3: value.double_value}.get(value.type, 0.0)
                    if 0.0 < number < 1e9:
                        numbers.setdefault(name, float(number))
        with suppress(Broken):
            for name, value in model(self.record).numbers().items():
                if value > 0.0 and name not in numbers:
                    numbers[name] = value
                    self.record.profile.guessed.add(name)

    def rest(self) -> None:
        """Watch the robot at rest."""
        self.say('at rest')
        begin = time_ns()
        self.graph.spin_for(self.program.idle)
        self.record.idle.append((begin, time_ns()))

    def drive(self) -> None:
        """Drive some legs."""
        if not self.program.legs:
            return
        leg = min(LEG, max(SHORTEST_LEG, self.number('max_velocity')))
        if self.go(CENTER) is None:
            self.record.notes.append('nobody hears goal_pose, or says where the robot is')
            return
        for number in range(self.program.legs):
            turns = number / self.program.legs
            start = self.robot()
            if start is None or monotonic() > self.end:
                return
            self.say(f'driving {360.0 * turns:.0f} degrees')
            drive = self.go(beside(start, turns, leg))
            if drive is None or self.distance_to(start) < 0.01:
                self.record.notes.append('the robot does not drive')
                return
        self.go(CENTER)

    def tilt(self) -> None:
        """Tilt the platform to and fro."""
        self.say('tilting')
        for angle in self.program.tilts:
            begin = time_ns()
            try:
                self.observer.send_tilt(angle)
            except LookupError as error:
                self.record.tilts.append(Ask(begin, time_ns(), angle, False, False, str(error)))
                return
            self.graph.spin_for(0.6)
            self.record.tilts.append(Ask(begin, time_ns(), angle))

    def place_of(self, drop: Drop) -> tuple[Vector, bool | None]:
        """Return from where a brick is dropped, and whether it can be caught, if that is sure."""
        speed, radius = self.number('max_velocity'), self.number('platform_radius')
        distance, way = (radius + drop.way * speed if drop.way else 0.3 * radius), drop.way
        if distance > ARENA_SIZE / 2.0 - RIM:
            distance = ARENA_SIZE / 2.0 - RIM
            way = (distance - radius) / speed
        spare = self.reaction / 2.0 if drop.left is None else (
            drop.left if drop.left < 0.0 else self.reaction + drop.left)
        # With half a brick to spare, whose height nobody may know.
        height = (self.number('platform_height') + self.half_height()
                  + self.number('gravity_accel') * max(way + spare, 0.1) ** 2 / 2.0)
        known = drop.left is not None and set(NUMBERS) <= set(self.record.profile.numbers)
        return ((*beside(CENTER, drop.turns, distance), height),
                drop.left is not None and drop.left > 0.0 if known else None)

    def half_height(self) -> float:
        """Return half the brick's height (m), as its marker has it; 0 where none tells."""
        try:
            height = half_height(self.record)
        except (Broken, Open):
            return 0.0
        return height if 0.0 < height < 1.0 else 0.0

    def drop_all(self, drops: Sequence[Drop]) -> None:
        """Drop one brick after another."""
        if self.record.frame('brick') is None and 'there is no brick' not in self.record.notes:
            self.record.notes.append('there is no brick')
        for drop in drops:
            if monotonic() > self.end or self.failures > 1:
                self.record.notes.append(f'not dropped any more: {drop.words}')
                continue
            place, reachable = self.place_of(drop)
            self.say(f'{drop.words}, at ' + '({:.2f}, {:.2f}, {:.2f})'.format(*place))
            if self.distance_to(CENTER) > 0.02:
                self.go(CENTER)
            ask = self.place(place)
            if not (ask.answered and ask.accepted):
                self.failures += 1
                continue
            watch = self.drop(place)
            self.failures += watch.released is None
            watch.should = reachable
            if watch.floated and not any(one.floated for one in self.record.drops[:-1]):
                # Where it floats, it stays, wherever the robot goes.
                self.go((CENTER[0] + 0.8, CENTER[1]))
                watch.end = time_ns()


def beside(place: Sequence[float], turns: float, distance: float) -> tuple[float, float]:
    """Return a point at a distance (m) from another, in a direction."""
    angle = 2.0 * pi * turns
    return place[0] + distance * cos(angle), place[1] + distance * sin(angle)
