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
The closed loop without ROS: brick, robot, turtlesim and catcher at their real rates.

It uses the same modules as the nodes: `physics.World` at 250 Hz, `driving.Driver` at 100 Hz,
`turtlesim_kinematics.Turtle` every 16 ms with its queue of commands, and `catch_logic.Catcher` at
every position of the brick and 50 times per second, with the delays of the live graph between
them. Time jumps from event to event, so that an hour takes seconds; everything random comes from a
seed, so that every run can be repeated. `simulate` makes one drop with the robot at rest in the
center, for tables and figures, and `trace` repeats it to be drawn.
"""

from argparse import ArgumentTypeError
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan2, dist, hypot, inf
from random import Random
from typing import Any, NamedTuple

from turtle_brick.core import catch_logic, driving
from turtle_brick.core.catch_logic import Catcher, DriveOrder, State, TiltOrder
from turtle_brick.core.driving import Driver
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose, Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import Decision, guaranteed_distance
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import (ARENA_CENTER, TICK, Turtle, TurtlePose,
                                                    within_arena)
from turtle_brick.physics import Phase, STEP_NS, World

ROBOT_PERIOD = round(driving.PERIOD / SECONDS_PER_NS)
TICK_PERIOD = round(TICK / SECONDS_PER_NS)
CATCHER_PERIOD = round(catch_logic.PERIOD / SECONDS_PER_NS)

START_UP = 0.3  # how long (s) one runs before its drop, for its parts to exchange data


@dataclass(frozen=True)
class Delays:
    """The delays of the live graph (s)."""

    transport: float = driving.TRANSPORT  # from publishing a message to its arrival elsewhere
    transforms: float = 0.0010  # from the robot's cycle to robot_state_publisher's transform
    tick_jitter: float = 0.0  # standard deviation of turtlesim's ticks about their grid
    robot_jitter: float = 0.0  # standard deviation of the robot's cycles about theirs


# of a graph whose timers jitter as turtlesim's and rclpy's do
JITTER = Delays(tick_jitter=0.002, robot_jitter=0.0003)


class Result(NamedTuple):
    """The course of a drop; lengths in m, times in s."""

    brick: Vector  # where it was released
    robot: tuple[float, float]  # where the robot was then
    decision: Decision | None
    caught: bool
    fall_time: float  # from release to contact with the platform or the ground
    decision_time: float  # from release to decision
    carried_to: tuple[float, float] | None  # where the robot tilted
    slide_time: float  # from the first tilt until the brick floats
    finished: bool  # whether the catcher was waiting again at the end


class Simulation:
    """One arena with its robot."""

    def __init__(self, parameters: Parameters, seed: int = 0, delays: Delays = Delays(),
                 start: tuple[float, float, float] = (ARENA_CENTER, ARENA_CENTER, 0.0)) -> None:
        """
        Put robot and brick at rest.

        :param parameters: the physical numbers
        :param seed: of the phases of all timers, and of the jitter
        :param delays: the delays between the parts
        :param start: x, y (m) and theta (rad) of the turtle in the world
        """
        self.parameters = parameters
        self.random = Random(seed)
        self.delays = delays
        self.world = World.from_parameters(parameters)
        self.driver = Driver(parameters.max_velocity)
        self.turtle = Turtle(*start, holonomic=True)
        self.catcher = Catcher(parameters)
        self.now = 0
        self.on_physics: Callable[[], None] | None = None  # called after each step of it
        self.commanded = (0.0, 0.0)  # the latest velocity (m/s), in the turtle's frame
        self.decisions: list[tuple[int, Decision]] = []  # with their instants (ns)
        self._hinge = parameters.platform_height - parameters.platform_thickness
        self._tilt = 0.0
        self._shown: tuple[TurtlePose | None, float] = (None, 0.0)
        # What is on its way: (time of arrival, content), in order.
        self._to_turtle: deque[tuple[int, float, float]] = deque()
        self._to_driver: deque[tuple[int, TurtlePose]] = deque()
        self._orders: deque[tuple[int, DriveOrder | TiltOrder]] = deque()
        self._transforms: deque[tuple[int, Platform]] = deque()
        self._transport = round(delays.transport / SECONDS_PER_NS)
        self._transform_delay = round(delays.transforms / SECONDS_PER_NS)
        uniform = self.random.randrange
        self._physics_at = uniform(STEP_NS)
        self._robot_grid = uniform(ROBOT_PERIOD)
        self._robot_at = self._robot_grid
        self._tick_grid = uniform(TICK_PERIOD)
        self._tick_at = self._tick_grid
        self._catcher_at = uniform(CATCHER_PERIOD)
        self._decided_at = 0

    def drive_to(self, x: float, y: float) -> None:
        """Send the robot to a point of the world (m), as goal_pose does."""
        self._orders.append((self.now + self._transport, DriveOrder(x, y)))

    def run(self, until: Callable[[], bool], limit: float = inf) -> bool:
        """
        Let time pass until a condition holds.

        :param until: the condition, checked after each step of the physics
        :param limit: the longest time (s) to pass
        :return: Whether the condition holds.
        """
        end = self.now + limit / SECONDS_PER_NS
        while True:
            self.now = now = min(
                self._tick_at, self._robot_at, self._physics_at, self._catcher_at)
            if now > end:
                return False
            # Of two at the same instant the earlier one here comes first.
            if now == self._tick_at:
                self._tick(now)
            elif now == self._robot_at:
                self._cycle(now)
            elif now == self._physics_at:
                self._step(now)
                if until():
                    return True
            else:
                self._catcher_at += CATCHER_PERIOD
                self._decide(now)

    def rest(self, seconds: float) -> None:
        """Let a time (s) pass."""
        self.run(lambda: False, seconds)

    def drop(self, brick: Vector) -> Result:
        """
        Place the brick at a point of the world (m) and drop it.

        :return: What happens until the catcher waits again, or the brick lies on the ground.
        """
        world, catcher = self.world, self.catcher
        world.brick = brick
        self.rest(0.1)
        world.release()
        released = self._physics_at
        robot = self.turtle.pose[:2]
        decisions = len(self.decisions)
        self.run(lambda: world.phase is not Phase.FALLING)
        fall_time = (self.now - released) * SECONDS_PER_NS
        caught = world.phase is Phase.RIDING
        carried_to, slide_time = None, 0.0
        if caught:
            # Enough for the way across the arena at max_velocity, and for the slide.
            self.run(lambda: catcher.state is State.TILTING,
                     30.0 + 16.0 / self.parameters.max_velocity)
            carried_to, tilted = self.turtle.pose[:2], self.now
            self.run(lambda: world.phase is Phase.FLOATING, 30.0)
            slide_time = (self.now - tilted) * SECONDS_PER_NS
        finished = self.run(lambda: catcher.state is State.WAITING, 10.0)
        told: list[tuple[float, Decision | None]] = [*self.decisions[decisions:], (inf, None)]
        decided, decision = told[0]
        return Result(brick, robot, decision, caught, fall_time, (decided - released) * SECONDS_PER_NS,
                      carried_to, slide_time, finished)

    def _tick(self, now: int) -> None:
        """Do what turtlesim does every 16 ms."""
        self._tick_grid += TICK_PERIOD
        self._tick_at = self._jittered(self._tick_grid, self.delays.tick_jitter)
        inbox = self._to_turtle
        while inbox and inbox[0][0] <= now:
            _, linear_x, linear_y = inbox.popleft()
            self.turtle.command(linear_x, linear_y, 0.0)
        pose = self.turtle.tick(now * SECONDS_PER_NS)
        self._to_driver.append((now + self._transport, pose))

    def _cycle(self, now: int) -> None:
        """Do what the robot does 100 times per second."""
        self._robot_grid += ROBOT_PERIOD
        self._robot_at = self._jittered(self._robot_grid, self.delays.robot_jitter)
        inbox, driver = self._to_driver, self.driver
        while inbox and inbox[0][0] <= now:
            arrival, pose = inbox.popleft()
            driver.observe(arrival * SECONDS_PER_NS, pose)
        while self._orders and self._orders[0][0] <= now:
            _, order = self._orders.popleft()
            if isinstance(order, TiltOrder):
                self._tilt = order.angle
            else:
                driver.drive_to(*within_arena(order.x, order.y))
        self.commanded = driver.command(now * SECONDS_PER_NS)
        self._to_turtle.append((now + self._transport, *self.commanded))
        place, tilt = driver.pose, self._tilt
        place_shown, tilt_shown = self._shown
        # A platform at rest stays the same one, which spares a sweep a tenth of its time.
        if place is not None and (place != place_shown or tilt != tilt_shown):
            self._shown = (place, tilt)
            self._transforms.append((now + self._transform_delay, Platform(Pose(
                (place.x, place.y, self._hinge),
                multiply(from_yaw(place.theta), from_pitch(tilt))))))

    def _step(self, now: int) -> None:
        """Do what the arena does 250 times per second, and show the catcher the brick."""
        self._physics_at += STEP_NS
        world = self.world
        transforms = self._transforms
        while transforms and transforms[0][0] <= now:
            world.platform = transforms.popleft()[1]
        world.step()
        if self.catcher.see_brick(now, world.brick):
            self._decide(now + self._transport)
        if self.on_physics is not None:
            self.on_physics()

    def _decide(self, now: int) -> None:
        """Let the catcher decide, and pass its orders on."""
        # A fall is decided about when its transform arrives, some time after this event.
        self._decided_at = now = max(now, self._decided_at)
        for action in self.catcher.update(now, self.world.platform):
            if isinstance(action, Decision):
                self.decisions.append((self.now, action))
            else:
                self._orders.append((now + self._transport, action))

    def _jittered(self, instant: int, deviation: float) -> int:
        """Return an instant (ns) with a random deviation (s), but one that is to come."""
        if deviation:
            instant += round(self.random.gauss(0.0, deviation) / SECONDS_PER_NS)
        return max(instant, self.now + 1)


class Drop(NamedTuple):
    """What became of a brick; lengths in m, in the world, times in s."""

    number: int  # of the drop in its sweep, from 0
    seed: int  # of its simulation
    result: Result
    promised: float  # distance within which a catch is promised; negative where nothing is

    @property
    def distance(self) -> float:
        """Return how far the brick was from the robot at the release, on the ground."""
        return dist(self.result.brick[:2], self.result.robot)

    @property
    def within_promise(self) -> bool:
        """Tell whether a catch was promised."""
        return self.distance <= self.promised

    @property
    def reachable(self) -> bool | None:
        """Return what the catcher decided; None if it did not."""
        return self.result.decision and self.result.decision.reachable

    @property
    def margin(self) -> float | None:
        """Return the time available minus the time needed, by the catcher's estimate."""
        return self.result.decision and self.result.decision.margin

    @property
    def outcome(self) -> str:
        """Return 'caught', 'refused' or 'missed': said to be reachable, but not caught."""
        return 'caught' if self.result.caught else 'missed' if self.reachable else 'refused'

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
        return {
            'index': self.number, 'seed': self.seed,
            'brick_x': brick_x, 'brick_y': brick_y, 'brick_z': brick_z,
            'robot_x': result.robot[0], 'robot_y': result.robot[1],
            'distance': self.distance,
            'promised': self.promised if self.promised >= 0.0 else None,
            'outcome': self.outcome, 'reachable': self.reachable,
            'decided': decision and result.decision_time,
            'available': decision and decision.available, 'needed': decision and decision.needed,
            'margin': self.margin, 'fall': result.fall_time,
            'tilted_x': tilted_x, 'tilted_y': tilted_y,
            'slide': result.slide_time if result.caught else None,
            'finished': result.finished}


def promised_distance(brick: Vector, parameters: Parameters, excess: float = 0.0) -> float:
    """Return the `guaranteed_distance` (m) of a brick, negative outside the arena too."""
    x, y, height = brick
    if within_arena(x, y) != (x, y):
        return -inf
    return guaranteed_distance(height, parameters, excess)


def begin(parameters: Parameters, seed: int) -> Simulation:
    """Return a simulation of a jittering graph, with the robot at rest in the center."""
    simulation = Simulation(parameters, seed, JITTER)
    simulation.rest(START_UP)
    return simulation


def simulate(parameters: Parameters, number: int, seed: int, brick: Vector) -> Drop:
    """Drop a brick from a place in the world (m); the drop's number is noted."""
    return Drop(number, seed, begin(parameters, seed).drop(brick),
                promised_distance(brick, parameters))


def counted(drops: Sequence[Drop]) -> str:
    """Return how many drops had which outcome."""
    count = Counter(drop.outcome for drop in drops)
    return f'{len(drops):,} drops: ' + ', '.join(
        f'{count[outcome]:,} {outcome}' for outcome in ('caught', 'refused', 'missed'))


class Sample(NamedTuple):
    """An instant of a drop."""

    time: float  # since the release (s)
    brick: Vector
    robot: tuple[float, float]
    tilt: float  # angle of the platform as the arena knows it (rad)
    commanded: float  # the speed that the robot asks turtlesim for (m/s)
    speed: float  # the turtle's, in turtlesim (m/s)
    phase: Phase
    state: State


def trace(parameters: Parameters, drop: Drop) -> list[Sample]:
    """Repeat a drop; return 250 samples per second, until 0.3 s after its end."""
    simulation = begin(parameters, drop.seed)
    samples: list[Sample] = []

    def look() -> None:
        turtle, platform = simulation.turtle.pose, simulation.world.platform
        assert platform is not None
        x_axis, _, normal = platform.axes
        samples.append(Sample(
            simulation.now * SECONDS_PER_NS, simulation.world.brick, (turtle.x, turtle.y),
            atan2(-x_axis[2], normal[2]), hypot(*simulation.commanded), turtle.linear_velocity,
            simulation.world.phase, simulation.catcher.state))

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
