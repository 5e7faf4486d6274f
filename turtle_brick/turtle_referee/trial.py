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
from turtle_referee.robot_model import RobotModel
from turtle_referee.rules import Broken, Open
from turtle_referee.spinning import Spins
from turtle_referee.stalls import StallWatch

IDLE = 3.0
"""How long (s) the robot is watched at rest."""

MEETING = 10.0
"""How long (s) it may take to hear of everything in a graph that runs."""

LEG = 1.5
"""Length (m) of each of the eight legs."""

SHORTEST_LEG = 0.3
"""Length (m) of a leg of the slowest robots."""

TILTS = (0.5, -0.4, 0.25, 0.0)
"""The angles (rad) that are asked for."""

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


class Trial(Hands):
    """All that is asked of a graph."""

    def __init__(self, graph: Spins, observer: Observer, reaction: float,
                 say: Callable[[str], None], patience: float = MEETING,
                 limit: float = 150.0, is_alive: Callable[[], bool] = lambda: True) -> None:
        """
        Ask for nothing yet.

        :param graph: spins the observer
        :param observer: hears and asks
        :param reaction: time (s) that an implementation may need from release to motion
        :param say: told what is being done
        :param patience: how long (s) the graph may take to be there
        :param limit: time (s) after which nothing new is begun
        :param is_alive: tells whether what was started for it still runs
        """
        super().__init__(graph, observer)
        self.reaction = reaction
        self.say = say
        self.patience = patience
        self.end = monotonic() + limit
        self.is_alive = is_alive

    def run(self) -> None:
        """Go through the whole programme."""
        watch = StallWatch()
        with watch:
            if self.meet():
                self.rest()
                self.drive()
                self.tilt()
                self.drop_all()
            self.record.stalls = watch.stalls()

    # ------------------------------------------------------------------------------- the start

    def meet(self) -> bool:
        """Wait until the graph is there; tell whether there is anything."""
        record = self.record
        self.say('looking for the graph')
        self.until(lambda: self.sees_everything() or not self.is_alive(), self.patience)
        self.read_numbers()
        record.notes += self.observer.doubts()
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
            self.until(lambda: all(map(self.observer.has_parameters, nodes)), PATIENCE)
            asked = [self.observer.ask_parameters(node) for node in nodes
                     if self.observer.has_parameters(node)]
            self.until(lambda: all(one.done() for one in asked), 2.0 * PATIENCE)
            for one in asked:
                values = one.result().values if one.done() and one.result() else []
                for name, value in zip(NUMBERS, values):
                    number = {2: value.integer_value, 3: value.double_value}.get(value.type, 0.0)
                    if 0.0 < number < 1e9:
                        numbers.setdefault(name, float(number))
        model = RobotModel.of(self.record)
        if model is not None:
            for name, value in model.numbers().items():
                if value > 0.0 and name not in numbers:
                    numbers[name] = value
                    self.record.profile.guessed.add(name)

    def rest(self) -> None:
        """Watch the robot at rest."""
        self.say('at rest')
        begin = time_ns()
        self.graph.spin_for(IDLE)
        self.record.idle.append((begin, time_ns()))

    def drive(self) -> None:
        """Drive eight legs, each in another direction, that end where they began."""
        leg = min(LEG, max(SHORTEST_LEG, self.number('max_velocity')))
        if self.go(CENTER) is None:
            self.record.notes.append('nobody hears goal_pose, or says where the robot is')
            return
        for number in range(8):
            start = self.robot()
            if start is None or monotonic() > self.end:
                return
            angle = number * pi / 4.0
            self.say(f'driving {45 * number} degrees')
            drive = self.go((start[0] + leg * cos(angle), start[1] + leg * sin(angle)))
            if drive is None or self.distance_to(start) < 0.01:
                self.record.notes.append('the robot does not drive')
                return
        self.go(CENTER)

    def tilt(self) -> None:
        """Tilt the platform to and fro."""
        self.say('tilting')
        for angle in TILTS:
            begin = time_ns()
            try:
                self.observer.send_tilt(angle)
            except LookupError as error:
                self.record.tilts.append(Ask(begin, time_ns(), angle, False, False, str(error)))
                return
            self.graph.spin_for(0.6)
            self.record.tilts.append(Ask(begin, time_ns(), angle))

    def placings(self) -> list[Placing]:
        """Return from where bricks are dropped around the robot at the center."""
        speed, radius = self.number('max_velocity'), self.number('platform_radius')
        gravity, rest = self.number('gravity_accel'), self.number('platform_height')
        known = set(NUMBERS) <= set(self.record.profile.numbers)
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
            found.append(Placing(words, place, left > 0.0 if known and left is not None else None))
        return found

    def half_height(self) -> float:
        """Return half the brick's height (m), as its marker has it; 0 where none tells."""
        try:
            height = half_height(self.record)
        except (Broken, Open):
            return 0.0
        return height if 0.0 < height < 1.0 else 0.0

    def drop_all(self) -> None:
        """Drop one brick after another."""
        if self.record.frame('brick') is None:
            self.record.notes.append('there is no brick')
        failures = 0
        for placing in self.placings():
            if monotonic() > self.end or failures > 1:
                self.record.notes.append(f'not dropped any more: {placing.words}')
                continue
            self.say(f'{placing.words}, at ({placing.place[0]:.2f}, {placing.place[1]:.2f}, '
                     f'{placing.place[2]:.2f})')
            if self.distance_to(CENTER) > 0.02:
                self.go(CENTER)
            ask = self.place(placing.place)
            if not (ask.answered and ask.accepted):
                failures += 1
                continue
            watch = self.drop(placing.place)
            failures += watch.released is None
            watch.should = placing.reachable
            if watch.floated and not any(one.left_alone for one in self.record.drops):
                # Where it floats, it stays, wherever the robot goes.
                watch.left_alone = time_ns()
                self.go((CENTER[0] + 0.8, CENTER[1]))
                watch.end = time_ns()
