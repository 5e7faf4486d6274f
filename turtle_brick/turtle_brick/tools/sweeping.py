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
The drops of a sweep: the plan, the simulation of each drop, and the summary.

The results depend on the `Plan` and the parameters alone. Every chain of drops begins with the
robot at rest in the center of the arena. `Watch` measures how well a catch was timed; `trace`
repeats a drop and records it in detail.
"""

from collections.abc import Iterable, Iterator, Sequence
import csv
from dataclasses import asdict, astuple, dataclass, fields
from math import asin, hypot, inf, isfinite
from random import Random
from typing import NamedTuple, TextIO
from xml.etree import ElementTree

from turtle_brick.core.catch_logic import NANO, State
from turtle_brick.core.driving import Driver, within_arena
from turtle_brick.core.geometry import axes, Vector
from turtle_brick.core.parameters import default_path, Parameters
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.tools.simulation import Delays, Simulation

START_UP = 0.3
"""How long (s) a simulation runs before its first drop, for its parts to exchange data."""

JITTER = Delays(tick_jitter=0.002, robot_jitter=0.0003)
"""The delays of a graph whose timers jitter as turtlesim's and rclpy's do."""


@dataclass(frozen=True)
class Drop:
    """
    The result of a drop: a row of the table.

    Lengths are in m, in the world; times in s; None, an empty field, where it does not apply.
    """

    index: int
    """Number of the drop, from 0."""
    seed: int
    """Seed of the simulation that it belongs to."""
    turn: int
    """Number of earlier drops in that simulation."""
    brick_x: float
    brick_y: float
    brick_z: float
    """Where the brick's center was when it was released."""
    robot_x: float
    robot_y: float
    """Where the robot was then."""
    distance: float
    """Between the two on the ground."""
    promised: float | None
    """Distance within which a catch is promised; None outside the arena."""
    outcome: str
    """'caught', 'refused' (said to be unreachable) or 'missed' (said to be reachable)."""
    reachable: bool | None
    """What was decided; None if nothing was."""
    decided: float | None
    """From release to decision."""
    available: float | None
    """From decision to contact, by the catcher's estimate."""
    needed: float | None
    """From decision until the platform is under the brick, by the catcher's estimate."""
    margin: float | None
    """The time available minus the time needed."""
    fall: float
    """From release to contact with platform or ground."""
    spare: float | None
    """How long the platform had been under the brick when it landed."""
    offset: float | None
    """From the platform's axis to the brick when it landed there."""
    tilted_x: float | None
    tilted_y: float | None
    """Where the robot tilted."""
    slide: float | None
    """From the first tilt until the brick has left the platform."""
    finished: bool
    """Whether a caught brick was tipped off and the catcher waited again."""

    @property
    def within_promise(self) -> bool:
        """Tell whether a catch was promised."""
        return self.promised is not None and self.distance <= self.promised

    @property
    def broken(self) -> str:
        """Say which promise was broken; empty if none was."""
        if self.reachable and self.outcome != 'caught':
            return 'said to be reachable, but not caught'
        if self.within_promise and not self.reachable and self.outcome != 'caught':
            return f'refused within the promised {self.promised:.3f} m'
        return ''


class Chain(NamedTuple):
    """Drops that follow one another in one simulation."""

    first: int
    """Index of the first drop."""
    seed: int
    bricks: tuple[Vector, ...]
    """Where the bricks are released, in the world (m)."""


@dataclass(frozen=True)
class Plan:
    """The drops to make: with the parameters, all that the table depends on."""

    grid: bool
    """Whether the bricks are on a grid."""
    count: int
    """How many drops; on a grid, how many along each side of the arena."""
    heights: tuple[float, float]
    """The lowest and the highest release of a brick (m)."""
    seed: int
    chain: int = 1
    """Number of drops per simulation."""
    jitter: bool = True
    """Whether the timers jitter, as they do in a live graph."""

    @property
    def drops(self) -> int:
        """Return how many drops there are in all."""
        return self.count ** 2 if self.grid else self.count

    @property
    def cell(self) -> float | None:
        """Return the side (m) of the cell that a drop stands for; None if there is no grid."""
        return ARENA_SIZE / self.count if self.grid else None

    @property
    def delays(self) -> Delays:
        """Return the delays of every simulation."""
        return JITTER if self.jitter else Delays()

    def bricks(self) -> Iterator[Vector]:
        """
        Yield where the bricks are released.

        :return: Points of the world (m), uniformly at random, or the centers of the arena's cells
            in random order, so that the first ones already cover the whole arena.
        """
        random = Random(f'{self.seed} bricks')
        side = self.cell
        if side is not None:
            cells = [(row, column) for row in range(self.count) for column in range(self.count)]
            random.shuffle(cells)
            for row, column in cells:
                yield ((column + 0.5) * side, (row + 0.5) * side, random.uniform(*self.heights))
        else:
            for _ in range(self.count):
                yield (random.uniform(0.0, ARENA_SIZE), random.uniform(0.0, ARENA_SIZE),
                       random.uniform(*self.heights))

    def chains(self) -> Iterator[Chain]:
        """Yield the simulations with their drops, in the order of the table."""
        random = Random(f'{self.seed} simulations')
        first, bricks = 0, []
        for brick in self.bricks():
            bricks.append(brick)
            if len(bricks) == self.chain:
                yield Chain(first, random.getrandbits(32), tuple(bricks))
                first, bricks = first + len(bricks), []
        if bricks:
            yield Chain(first, random.getrandbits(32), tuple(bricks))


class Watch:
    """Measures how well the catches of a simulation are timed."""

    def __init__(self, simulation: Simulation) -> None:
        """
        Observe a simulation.

        :param simulation: The simulation; its `on_physics` is taken.
        """
        self.spare: float | None = None
        self.offset: float | None = None
        self._simulation = simulation
        self._under: int | None = None
        simulation.on_physics = self._look

    def begin(self) -> None:
        """Reset for the next drop."""
        self.spare = self.offset = self._under = None

    def _look(self) -> None:
        """Measure since when the platform has been under the brick."""
        world = self._simulation.world
        phase = world.phase
        falling = phase is Phase.FALLING
        if not falling and (phase is not Phase.RIDING or self.spare is not None):
            return
        if world.platform is None:
            return
        platform = world.platform.pose
        distance = hypot(world.brick[0] - platform.position[0],
                         world.brick[1] - platform.position[1])
        # Once landed it counts, even if rounding puts it beyond the edge.
        if falling and distance > self._simulation.parameters.platform_radius:
            self._under = None
            return
        if self._under is None:
            self._under = self._simulation.now
        if not falling:
            self.spare = (self._simulation.now - self._under) * NANO
            self.offset = distance


def make(parameters: Parameters, chain: Chain, delays: Delays) -> tuple[list[Drop], float]:
    """
    Run the drops of one simulation.

    :param parameters: The physical numbers.
    :param chain: The drops.
    :param delays: The delays between the simulation's parts.
    :return: The result of each, and the simulated time in s.
    """
    simulation = Simulation(parameters, chain.seed, delays)
    watch = Watch(simulation)
    simulation.rest(START_UP)
    drops = []
    for turn, brick in enumerate(chain.bricks):
        watch.begin()
        result = simulation.drop(brick)
        decision = result.decision
        reachable = None if decision is None else decision.reachable
        tilted = result.carried_to or (None, None)
        timed = decision if decision is not None and isfinite(decision.margin) else None
        drops.append(Drop(
            index=chain.first + turn, seed=chain.seed, turn=turn,
            brick_x=brick[0], brick_y=brick[1], brick_z=brick[2],
            robot_x=result.robot[0], robot_y=result.robot[1],
            distance=hypot(brick[0] - result.robot[0], brick[1] - result.robot[1]),
            promised=promise(brick, parameters),
            outcome='caught' if result.caught else 'missed' if reachable else 'refused',
            reachable=reachable,
            decided=result.decision_time if isfinite(result.decision_time) else None,
            available=None if timed is None else timed.available,
            needed=None if timed is None else timed.needed,
            margin=None if timed is None else timed.margin,
            fall=result.fall_time, spare=watch.spare, offset=watch.offset,
            tilted_x=tilted[0], tilted_y=tilted[1],
            slide=result.slide_time if result.caught else None,
            finished=result.finished))
    return drops, simulation.now * NANO


def promise(brick: Vector, parameters: Parameters) -> float | None:
    """
    Return within which distance (m) from a robot at rest a brick is promised to be caught.

    :param brick: Where it is released, in the world (m).
    :param parameters: The physical numbers.
    :return: The distance; None where nothing is promised.
    """
    if within_arena(brick[0], brick[1]) != (brick[0], brick[1]):
        return None
    distance = guaranteed_distance(brick[2], parameters)
    return distance if distance >= 0.0 else None


class Trace:
    """
    One drop in detail, 250 times per second: lists of equal length, and the commands.

    Times are in s from the release, lengths in m, angles in rad.
    """

    def __init__(self) -> None:
        """Make an empty trace."""
        self.time: list[float] = []
        self.brick: list[Vector] = []
        self.robot: list[tuple[float, float]] = []
        self.platform: list[tuple[float, float] | None] = []
        """The platform as the arena knows it."""
        self.tilt: list[float] = []
        self.speed: list[float] = []
        """The turtle's speed in turtlesim."""
        self.phase: list[Phase] = []
        self.state: list[State] = []
        self.command_time: list[float] = []
        self.command: list[float] = []
        """Commanded speeds (m/s), 100 per second."""
        self.decision_time = inf


class _RecordingDriver(Driver):
    """A Driver that records its commands."""

    def __init__(self, max_velocity: float) -> None:
        super().__init__(max_velocity)
        self.commands: list[tuple[float, float]] = []

    def command(self, now: float) -> tuple[float, float]:
        velocity = super().command(now)
        self.commands.append((now, hypot(*velocity)))
        return velocity


def trace(parameters: Parameters, chain: Chain, turn: int, delays: Delays) -> Trace:
    """
    Repeat a drop and record it.

    :param parameters: The physical numbers.
    :param chain: The simulation that it belongs to.
    :param turn: How many drops that simulation saw before.
    :param delays: The delays between the simulation's parts.
    :return: The record, until 0.3 s after the end.
    """
    simulation = Simulation(parameters, chain.seed, delays)
    driver = _RecordingDriver(parameters.max_velocity)
    simulation.driver = driver
    simulation.rest(START_UP)
    for brick in chain.bricks[:turn]:
        simulation.drop(brick)
    driver.commands.clear()
    seen = Trace()
    world, instants = simulation.world, []

    def look() -> None:
        platform = None if world.platform is None else world.platform.pose
        instants.append(simulation.now)
        seen.brick.append(world.brick)
        seen.robot.append((simulation.turtle.pose.x, simulation.turtle.pose.y))
        seen.platform.append(None if platform is None else platform.position[:2])
        seen.tilt.append(0.0 if platform is None else _tilt(platform.orientation))
        seen.speed.append(simulation.turtle.pose.linear_velocity)
        seen.phase.append(world.phase)
        seen.state.append(simulation.catcher.state)

    simulation.on_physics = look
    result = simulation.drop(chain.bricks[turn])
    simulation.rest(0.3)
    # The release is the step before the first one of the fall.
    release = instants[seen.phase.index(Phase.FALLING) - 1]
    seen.time = [(instant - release) * NANO for instant in instants]
    seen.command_time = [time - release * NANO for time, _ in driver.commands]
    seen.command = [speed for _, speed in driver.commands]
    seen.decision_time = result.decision_time
    return seen


def _tilt(orientation: tuple[float, float, float, float]) -> float:
    """Return the angle (rad) of a platform from its orientation, within a quarter turn."""
    return asin(min(max(-axes(orientation)[0][2], -1.0), 1.0))


def version() -> str:
    """Return the version of the package."""
    manifest = default_path().parents[1] / 'package.xml'
    return ElementTree.parse(manifest).findtext('version', '')


def heading(parameters: Parameters, plan: Plan) -> str:
    """Return the head of the table: everything needed to reproduce it."""
    kind = (f'--grid {plan.count}' if plan.grid else f'--drops {plan.count}')
    heights = ' '.join(f'{height!r}' for height in dict.fromkeys(plan.heights))
    options = f'{kind} --height {heights} --seed {plan.seed}'
    if plan.chain != 1:
        options += f' --chain {plan.chain}'
    if not plan.jitter:
        options += ' --no-jitter'
    lines = [f'turtle_brick {version()}: sweep {options}',
             'lengths in m, in the world; times in s; parameters:']
    lines += [f'  {name}: {list(value) if isinstance(value, tuple) else value}'
              for name, value in asdict(parameters).items()]
    return ''.join(f'# {line}\n' for line in lines)


class Table:
    """The file with a row for each drop."""

    def __init__(self, file: TextIO, parameters: Parameters, plan: Plan) -> None:
        """
        Write the head.

        :param file: Opened for writing, without translation of newlines.
        :param parameters: The physical numbers.
        :param plan: The drops.
        """
        self._file = file
        file.write(heading(parameters, plan))
        self._writer = csv.writer(file, lineterminator='\n')
        self._writer.writerow(field.name for field in fields(Drop))
        file.flush()

    def write(self, drops: Iterable[Drop]) -> None:
        """Append rows and flush the file."""
        self._writer.writerows(map(_cells, drops))
        self._file.flush()


def _cells(drop: Drop) -> list[object]:
    """Return the fields of a row: six decimals, booleans as 0 and 1."""
    return [int(value) if isinstance(value, bool)
            else f'{value:.6f}' if isinstance(value, float) else value
            for value in astuple(drop)]


def summary(drops: Sequence[Drop]) -> str:
    """
    Count the outcomes.

    :param drops: The results.
    :return: A table of outcomes, within the promised distance and beyond it, and whether the
        promises were kept.
    """
    lines = [f'{"":24}{"all":>10}{"promised":>12}{"beyond":>10}']
    for outcome in ('caught', 'refused', 'missed'):
        those = [drop for drop in drops if drop.outcome == outcome]
        promised = sum(drop.within_promise for drop in those)
        lines.append(f'  {outcome:22}{len(those):10,}{promised:12,}{len(those) - promised:10,}')
    promised = sum(drop.within_promise for drop in drops)
    lines.append(f'  {"in all":22}{len(drops):10,}{promised:12,}{len(drops) - promised:10,}')
    reachable = [drop for drop in drops if drop.reachable]
    missed = sum(drop.outcome != 'caught' for drop in reachable)
    refused = sum(bool(drop.broken) for drop in drops) - missed
    tipped = [drop for drop in drops if drop.outcome == 'caught']
    stuck = sum(not drop.finished for drop in tipped)
    lines.append('')
    for rule, cases, failures in (
            ('said to be reachable: caught', len(reachable), missed),
            ('promised: not refused', promised, refused),
            ('caught: carried and tipped off', len(tipped), stuck)):
        verdict = f'BROKEN in {failures:,} of {cases:,}' if failures else f'held in all {cases:,}'
        lines.append(f'  {rule:34}{verdict}')
    return '\n'.join(lines)


def is_good(drops: Sequence[Drop]) -> bool:
    """Tell whether both promises were kept in every drop, and every caught brick tipped off."""
    return not any(drop.broken or (drop.outcome == 'caught' and not drop.finished)
                   for drop in drops)


def most_telling(drops: Sequence[Drop]) -> Drop:
    """Return the drop to show: a broken promise, else the tightest catch, else the first."""
    return min(drops, key=lambda drop: (
        not drop.broken, drop.outcome != 'caught',
        inf if drop.spare is None else drop.spare, drop.index))
