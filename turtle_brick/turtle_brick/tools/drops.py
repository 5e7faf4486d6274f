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
A drop in the simulation without ROS: made, measured, and repeated to be drawn.

Every drop begins with the robot at rest in the center of the arena, in a simulation of its own.
Its seed and the place of the brick are all that it depends on, besides the parameters.
"""

from argparse import ArgumentTypeError
from math import asin, hypot, inf, isfinite
from typing import Any, NamedTuple

from turtle_brick.core.catch_logic import State
from turtle_brick.core.driving import within_arena
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.core.time_steps import NANO
from turtle_brick.physics import Phase
from turtle_brick.tools.simulation import Delays, Result, Simulation

START_UP = 0.3
"""How long (s) a simulation runs before its drop, for its parts to exchange data."""

JITTER = Delays(tick_jitter=0.002, robot_jitter=0.0003)
"""The delays of a graph whose timers jitter as turtlesim's and rclpy's do."""


class Drop(NamedTuple):
    """What became of a brick; lengths in m, in the world, times in s."""

    number: int
    """Of the drop in its sweep, from 0."""
    seed: int
    """Of its simulation."""
    result: Result
    promised: float
    """Distance within which a catch is promised; negative where nothing is."""

    @property
    def distance(self) -> float:
        """Return how far the brick was from the robot at the release, on the ground."""
        (x, y, _), (robot_x, robot_y) = self.result.brick, self.result.robot
        return hypot(x - robot_x, y - robot_y)

    @property
    def within_promise(self) -> bool:
        """Tell whether a catch was promised."""
        return self.distance <= self.promised

    @property
    def reachable(self) -> bool | None:
        """Return what the catcher decided; None if it did not."""
        return None if self.result.decision is None else self.result.decision.reachable

    @property
    def outcome(self) -> str:
        """Return 'caught', 'refused' or 'missed': said to be reachable, but not caught."""
        return 'caught' if self.result.caught else 'missed' if self.reachable else 'refused'

    @property
    def margin(self) -> float | None:
        """Return the time available minus the time needed, by the catcher's estimate."""
        decision = self.result.decision
        return decision.margin if decision is not None and isfinite(decision.margin) else None

    @property
    def broken(self) -> str:
        """Say which promise was broken; empty if none was."""
        if self.outcome == 'missed':
            return 'said to be reachable, but not caught'
        if self.outcome == 'refused' and self.within_promise:
            return f'refused within the promised {self.promised:.3f} m'
        if self.outcome == 'caught' and not self.result.finished:
            return 'caught, but not carried and tipped off'
        return ''

    def row(self) -> dict[str, Any]:
        """Return its row of a table, by column; None where a column does not apply."""
        result, decision = self.result, self.result.decision
        brick_x, brick_y, brick_z = result.brick
        tilted_x, tilted_y = result.carried_to or (None, None)
        timed = decision if self.margin is not None else None
        return {
            'index': self.number, 'seed': self.seed,
            'brick_x': brick_x, 'brick_y': brick_y, 'brick_z': brick_z,
            'robot_x': result.robot[0], 'robot_y': result.robot[1],
            'distance': self.distance,
            'promised': self.promised if self.promised >= 0.0 else None,
            'outcome': self.outcome, 'reachable': self.reachable,
            'decided': result.decision_time if isfinite(result.decision_time) else None,
            'available': timed and timed.available, 'needed': timed and timed.needed,
            'margin': self.margin, 'fall': result.fall_time,
            'tilted_x': tilted_x, 'tilted_y': tilted_y,
            'slide': result.slide_time if result.caught else None,
            'finished': result.finished}


def promised_distance(brick: Vector, parameters: Parameters) -> float:
    """Return within which distance (m) of a robot at rest a brick is promised to be caught."""
    x, y, height = brick
    return guaranteed_distance(height, parameters) if within_arena(x, y) == (x, y) else -inf


def simulate(parameters: Parameters, number: int, seed: int, brick: Vector) -> Drop:
    """Drop a brick from a place in the world (m); the drop's number is noted."""
    simulation = Simulation(parameters, seed, JITTER)
    simulation.rest(START_UP)
    return Drop(number, seed, simulation.drop(brick), promised_distance(brick, parameters))


class Sample(NamedTuple):
    """An instant of a drop."""

    time: float
    """Since the release (s)."""
    brick: Vector
    robot: tuple[float, float]
    tilt: float
    """Angle of the platform as the arena knows it (rad)."""
    commanded: float
    """The speed that the robot asks turtlesim for (m/s)."""
    speed: float
    """The turtle's, in turtlesim (m/s)."""
    phase: Phase
    state: State


def trace(parameters: Parameters, drop: Drop) -> list[Sample]:
    """Repeat a drop; return 250 samples per second, until 0.3 s after its end."""
    simulation = Simulation(parameters, drop.seed, JITTER)
    simulation.rest(START_UP)
    samples: list[Sample] = []

    def look() -> None:
        world, turtle = simulation.world, simulation.turtle.pose
        # The x axis of a platform that is tilted by a positive angle points downward.
        sink = -world.platform.axes[0][2] if world.platform is not None else 0.0
        samples.append(Sample(
            simulation.now * NANO, world.brick, (turtle.x, turtle.y),
            asin(min(max(sink, -1.0), 1.0)), hypot(*simulation.commanded),
            turtle.linear_velocity, world.phase, simulation.catcher.state))

    simulation.on_physics = look
    simulation.drop(drop.result.brick)
    simulation.rest(0.3)
    release = next(sample.time for sample in samples if sample.phase is Phase.FALLING)
    return [sample._replace(time=sample.time - release) for sample in samples]


def at_least_one(text: str) -> int:
    """Read a whole number that counts something."""
    if not text.isdecimal() or int(text) < 1:
        raise ArgumentTypeError(f'{text!r} is no whole number from 1 on')
    return int(text)
