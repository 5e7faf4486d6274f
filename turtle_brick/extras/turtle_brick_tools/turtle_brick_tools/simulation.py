# SPDX-License-Identifier: Apache-2.0

"""
Simulate the brick, robot, turtlesim and catcher at their real rates without ROS.

The simulation uses the same modules as the nodes. The simulation updates `physics.World` at
250 Hz, `driving.Driver` at 100 Hz, `turtlesim_kinematics.Turtle` every 16 ms, and
`catch_logic.Catcher` at 50 Hz and when a fall is detected. The delays between the modules are the
same as in the live ROS graph. Simulated time advances from event to event, so simulating an hour
takes a few seconds. All random numbers are generated from one seed, so every run is reproducible.
"""

from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import dist, hypot, inf, sqrt
from random import Random
from typing import Any, NamedTuple

from turtle_brick.core import catch_logic, driving
from turtle_brick.core.catch_logic import Catcher, Commands, State
from turtle_brick.core.driving import Driver
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose, Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import Decision, resting_height
from turtle_brick.core.tilting_platform import Platform, PlatformShape
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import (ARENA_CENTER, ARENA_SIZE,
                                                    nearest_in_arena, TICK, Turtle, TurtlePose)
from turtle_brick.physics import BrickState, STEP_NS, World

ROBOT_PERIOD_NS = round(driving.COMMAND_PERIOD / SECONDS_PER_NS)
TICK_NS = round(TICK / SECONDS_PER_NS)
CATCHER_PERIOD_NS = round(catch_logic.UPDATE_PERIOD / SECONDS_PER_NS)
"""Timer periods (ns) of turtle_robot, turtlesim and the catcher."""

TRANSPORT_DELAY = 0.0004
"""Typical delay (s) of a message between two nodes on one machine. Measured: 0.2 to 0.6 ms."""

DETECTION_TIME = 0.02
"""Maximum time (s) from the release of a brick to the catcher's decision. The catcher detects
the fall from three consecutive brick positions, at most 12 ms after the release."""


@dataclass(frozen=True)
class Delays:
    """Delays (s) in the live ROS graph."""

    transport: float = TRANSPORT_DELAY  # Time from publishing a message to receiving it.
    transforms: float = 0.0010  # Time from a cycle of turtle_robot to the resulting transform.
    tick_jitter: float = 0.0  # Standard deviation of the timer jitter in turtlesim.
    robot_jitter: float = 0.0  # Standard deviation of the timer jitter in turtle_robot.


JITTER = Delays(tick_jitter=0.002, robot_jitter=0.0003)
"""Delays in the live ROS graph, including timer jitter in turtlesim and rclpy."""


class DropResult(NamedTuple):
    """The result of a drop, with lengths in m and times in s."""

    brick: Vector  # Position at the release.
    robot: tuple[float, float]  # Position at the release.
    decision: Decision | None
    caught: bool
    fall_time: float  # Time from the brick's release to contact with the platform or the ground.
    decision_time: float  # Time from the brick's release to the catcher's decision.
    carried_to: tuple[float, float] | None  # Robot position when the tilt starts.
    slide_time: float  # Time from the start of the tilt to the end of the slide.
    finished: bool  # Whether the catcher returned to the waiting state.


class Simulation:
    """Simulate one arena and its robot."""

    def __init__(self, parameters: Parameters, seed: int = 0, delays: Delays = Delays(),
                 start: tuple[float, float, float] = (ARENA_CENTER, ARENA_CENTER, 0.0)) -> None:
        """
        Create a simulation in which the robot and the brick are at rest.

        :param seed: seed for the timer phases and the jitter
        :param start: x, y (m) and theta (rad) of the turtle in the world frame
        """
        self.parameters = parameters
        self.random = Random(seed)
        self.delays = delays
        self.world = make_world(parameters)
        self.driver = Driver(parameters.max_velocity)
        self.turtle = Turtle(*start, holonomic=True)
        self.catcher = Catcher(parameters)
        self.now = 0  # Simulated time (ns).
        self.after_step: Callable[[], None] = lambda: None  # Called after each physics step.
        self.commanded = (0.0, 0.0)  # Latest velocity command (m/s) in the turtle's frame.
        self.decisions: list[tuple[int, Decision]] = []  # Decisions and their times (ns).
        self.tilt_angle = 0.0  # Angle (rad) of the platform.
        self._last_state: tuple[TurtlePose | None, float] = (None, 0.0)
        # Messages in transit as tuples (arrival time in ns, content), sorted by arrival time.
        self._to_turtle: deque[tuple[int, float, float]] = deque()
        self._to_driver: deque[tuple[int, TurtlePose]] = deque()
        self._to_robot: deque[tuple[int, Commands]] = deque()
        self._to_arena: deque[tuple[int, Platform]] = deque()
        self._transport = round(delays.transport / SECONDS_PER_NS)
        self._transform_delay = round(delays.transforms / SECONDS_PER_NS)
        # Times (ns) of the next events. Each timer starts with a random phase.
        self._physics_at = self.random.randrange(STEP_NS)
        self._robot_at = self._robot_grid = self.random.randrange(ROBOT_PERIOD_NS)
        self._tick_at = self._tick_grid = self.random.randrange(TICK_NS)
        self._catcher_at = self.random.randrange(CATCHER_PERIOD_NS)
        self._decided_at = 0

    @property
    def time(self) -> float:
        """Get the simulated time in seconds."""
        return self.now * SECONDS_PER_NS

    def drive_to(self, x: float, y: float) -> None:
        """Send the robot to a point (m) in the world frame, as a goal_pose message would."""
        self._to_robot.append((self.now + self._transport, Commands(goal=(x, y))))

    def tilt(self, angle: float) -> None:
        """Tilt the platform to an angle (rad), as a tilt message would."""
        self._to_robot.append((self.now + self._transport, Commands(tilt_angle=angle)))

    def run(self, until: Callable[[], bool], limit: float = inf) -> bool:
        """
        Simulate until a physics step makes a condition true or a time limit (s) is reached.

        :return: whether the condition became true
        """
        end = self.now + limit / SECONDS_PER_NS
        while True:
            self.now = now = min(self._tick_at, self._robot_at, self._physics_at, self._catcher_at)
            if now > end:
                return False
            # Simultaneous events are handled in the order of these branches.
            if now == self._tick_at:
                self._tick_turtlesim(now)
            elif now == self._robot_at:
                self._update_robot(now)
            elif now == self._physics_at:
                self._step_physics(now)
                if until():
                    return True
            else:
                self._catcher_at += CATCHER_PERIOD_NS
                self._update_catcher(now)

    def rest(self, seconds: float) -> None:
        """Simulate for a given duration (s)."""
        self.run(lambda: False, seconds)

    def drop(self, brick: Vector) -> DropResult:
        """Drop a brick from a position (m) and simulate until the catcher is waiting again."""
        world, catcher = self.world, self.catcher
        world.brick = brick
        self.rest(0.1)
        world.release()
        released = self._physics_at - STEP_NS  # The next step is the first to move the brick.
        robot = self.turtle.pose[:2]
        earlier_decisions = len(self.decisions)
        self.run(lambda: world.state is not BrickState.FALLING)
        fall_time = (self.now - released) * SECONDS_PER_NS
        caught = world.state is BrickState.RIDING
        carried_to, slide_time = None, 0.0
        if caught:
            # The time limit is long enough for the robot to cross the arena at max_velocity.
            self.run(lambda: catcher.state is State.TILTING,
                     30.0 + 16.0 / self.parameters.max_velocity)
            carried_to, tilted = self.turtle.pose[:2], self.now
            self.run(lambda: world.state is BrickState.FLOATING, 30.0)
            slide_time = (self.now - tilted) * SECONDS_PER_NS
        finished = self.run(lambda: catcher.state is State.WAITING, 10.0)
        decision, decision_time = None, inf
        if len(self.decisions) > earlier_decisions:
            decided, decision = self.decisions[earlier_decisions]
            decision_time = (decided - released) * SECONDS_PER_NS
        return DropResult(brick, robot, decision, caught, fall_time, decision_time,
                          carried_to, slide_time, finished)

    def _tick_turtlesim(self, now: int) -> None:
        self._tick_grid += TICK_NS
        self._tick_at = self._add_jitter(self._tick_grid, self.delays.tick_jitter)
        while self._to_turtle and self._to_turtle[0][0] <= now:
            _, linear_x, linear_y = self._to_turtle.popleft()
            self.turtle.command(linear_x, linear_y, 0.0)
        pose = self.turtle.tick(now * SECONDS_PER_NS)
        self._to_driver.append((now + self._transport, pose))

    def _update_robot(self, now: int) -> None:
        self._robot_grid += ROBOT_PERIOD_NS
        self._robot_at = self._add_jitter(self._robot_grid, self.delays.robot_jitter)
        driver = self.driver
        while self._to_driver and self._to_driver[0][0] <= now:
            arrival, pose = self._to_driver.popleft()
            driver.observe(arrival * SECONDS_PER_NS, pose)
        while self._to_robot and self._to_robot[0][0] <= now:
            _, commands = self._to_robot.popleft()
            if commands.goal is not None:
                driver.drive_to(*nearest_in_arena(*commands.goal))
            if commands.tilt_angle is not None:
                self.tilt_angle = commands.tilt_angle
        self.commanded = driver.command(now * SECONDS_PER_NS)
        self._to_turtle.append((now + self._transport, *self.commanded))
        # Sending robot states only when they change makes a sweep 10 % faster.
        state = (driver.pose, self.tilt_angle)
        if driver.pose is not None and state != self._last_state:
            self._last_state = state
            x, y, yaw = driver.pose.x, driver.pose.y, driver.pose.theta
            platform = platform_at(x, y, yaw, self.tilt_angle, self.parameters)
            self._to_arena.append((now + self._transform_delay, platform))

    def _step_physics(self, now: int) -> None:
        self._physics_at += STEP_NS
        world = self.world
        while self._to_arena and self._to_arena[0][0] <= now:
            world.platform = self._to_arena.popleft()[1]
        world.step()
        self.catcher.brick.observe(now, world.brick)
        if self.catcher.undecided_fall is not None:
            self._update_catcher(now + self._transport)
        self.after_step()

    def _update_catcher(self, now: int) -> None:
        # `now` can be later than self.now because the brick's transform arrives with a delay.
        self._decided_at = now = max(now, self._decided_at)
        decision = self.catcher.decision
        self.catcher.robot.observe(now, self.world.platform)
        commands = self.catcher.update(now)
        if self.catcher.decision is not None and self.catcher.decision is not decision:
            self.decisions.append((self.now, self.catcher.decision))
        if commands != Commands():
            self._to_robot.append((now + self._transport, commands))

    def _add_jitter(self, time: int, deviation: float) -> int:
        if deviation:
            time += round(self.random.gauss(0.0, deviation) / SECONDS_PER_NS)
        return max(time, self.now + 1)


def make_world(parameters: Parameters) -> World:
    """Return the same world as the arena node, which cannot be imported without ROS."""
    world = World(parameters.brick_start, parameters.gravity_accel, parameters.platform_radius,
                  STEP_NS * SECONDS_PER_NS)
    world.size, world.thickness = parameters.brick_size, parameters.platform_thickness
    return world


def platform_at(x: float, y: float, yaw: float, angle: float, parameters: Parameters) -> Platform:
    """Return the platform of a robot at x, y (m) with a given yaw (rad) and tilt angle (rad)."""
    hinge = parameters.platform_height - parameters.platform_thickness
    return Platform(Pose((x, y, hinge), multiply(from_yaw(yaw), from_pitch(angle))))


class SimulatedDrop(NamedTuple):
    """One drop in a sweep, with coordinates and lengths in m and times in s."""

    number: int  # Index of the drop in the sweep, starting at 0.
    seed: int  # Seed for the simulation.
    result: DropResult
    guaranteed: float  # Distance up to which a catch is guaranteed, or -inf.
    moving: bool = False  # Whether the robot was driving between random points.

    @property
    def distance(self) -> float:
        """Return the horizontal distance in meters from the robot to the brick at the release."""
        return dist(self.result.brick[:2], self.result.robot)

    @property
    def within_guarantee(self) -> bool:
        """Return whether a catch was guaranteed at the brick's distance from the robot."""
        return self.distance <= self.guaranteed

    @property
    def margin(self) -> float | None:
        """Return the brick's landing time minus the robot's arrival time, or None if undecided."""
        decision = self.result.decision
        return decision.available - decision.needed if decision else None

    @property
    def outcome(self) -> str:
        """Return 'caught', 'refused', or 'missed' (accepted, but not caught)."""
        if self.result.caught:
            return 'caught'
        decision = self.result.decision
        return 'missed' if decision and decision.reachable else 'refused'

    @property
    def broken_guarantee(self) -> str:
        """Return a description of the guarantee that the drop broke, or an empty string."""
        if self.outcome == 'missed':
            return 'reported as reachable, but not caught'
        if self.outcome == 'refused' and self.within_guarantee:
            return f'refused within the guaranteed distance of {self.guaranteed:.3f} m'
        if self.outcome == 'caught' and not self.result.finished:
            return 'caught, but not carried to the center and tipped off'
        return ''

    def row(self) -> dict[str, Any]:
        """Return the table row for this drop as a dictionary."""
        result, decision = self.result, self.result.decision
        brick_x, brick_y, brick_z = result.brick
        tilted_x, tilted_y = result.carried_to or (None, None)
        return {
            'index': self.number, 'seed': self.seed,
            'brick_x': brick_x, 'brick_y': brick_y, 'brick_z': brick_z,
            'robot_x': result.robot[0], 'robot_y': result.robot[1],
            'distance': self.distance,
            'guaranteed': self.guaranteed if self.guaranteed >= 0.0 else None,
            'outcome': self.outcome, 'reachable': decision.reachable if decision else None,
            'decided': result.decision_time if decision else None,
            'available': decision.available if decision else None,
            'needed': decision.needed if decision else None,
            'margin': self.margin, 'fall': result.fall_time,
            'tilted_x': tilted_x, 'tilted_y': tilted_y,
            'slide': result.slide_time if result.caught else None,
            'finished': result.finished}


def fall_time(height: float, parameters: Parameters) -> float:
    """Return the duration (s) of a free fall from a release height (m) to the level platform."""
    depth = max(height - resting_height(parameters), 0.0)
    return sqrt(2.0 * depth / parameters.gravity_accel)


def guaranteed_distance(height: float, parameters: Parameters) -> float:
    """
    Return the largest distance (m) to a brick that a robot at rest is guaranteed to catch.

    The distance is -infinity if no catch is guaranteed. `height` (m) is the release height of the
    brick's center.
    """
    reach = PlatformShape(parameters.platform_radius).reach
    time = fall_time(height, parameters) - DETECTION_TIME - parameters.command_latency
    if time < 0.0:
        return -inf
    time -= driving.braking_loss(reach, parameters.max_velocity)
    return reach + parameters.max_velocity * max(time, 0.0)


def guaranteed_distance_to(brick: Vector, parameters: Parameters) -> float:
    """Return the `guaranteed_distance` (m) for a brick, or -inf if it is outside the arena."""
    x, y, height = brick
    if nearest_in_arena(x, y) != (x, y):
        return -inf
    return guaranteed_distance(height, parameters)


def start_simulation(parameters: Parameters, seed: int, moving: bool = False) -> Simulation:
    """
    Return a simulation that includes timer jitter and has run for at least 0.3 s.

    :param moving: whether the robot drives between random points. The simulation runs for at least
        command_latency after the last goal, so that the catcher can detect the resulting motion.
    """
    simulation = Simulation(parameters, seed, JITTER)
    simulation.rest(0.3)  # The robot, the arena and the catcher exchange their first messages.
    random = Random(f'{seed} goals')
    for _ in range(2 if moving else 0):
        simulation.drive_to(random.uniform(0.0, ARENA_SIZE), random.uniform(0.0, ARENA_SIZE))
        simulation.rest(parameters.command_latency + random.uniform(0.0, 1.0))
    return simulation


def simulate_drop(parameters: Parameters, number: int, seed: int, brick: Vector,
                  moving: bool = False) -> SimulatedDrop:
    """Simulate a drop with a given index, seed and brick position (m, world frame)."""
    result = start_simulation(parameters, seed, moving).drop(brick)
    guaranteed = -inf if moving else guaranteed_distance_to(brick, parameters)
    return SimulatedDrop(number, seed, result, guaranteed, moving)


def outcome_counts(drops: Sequence[SimulatedDrop]) -> str:
    """Return one line with the total number of drops and the number for each outcome."""
    count = Counter(drop.outcome for drop in drops)
    return f'{len(drops):,} drops: ' + ', '.join(
        f'{count[outcome]:,} {outcome}' for outcome in ('caught', 'refused', 'missed'))


class TraceSample(NamedTuple):
    """The state of a simulation after one physics step."""

    time: float  # Time (s) since the release.
    brick: Vector
    robot: tuple[float, float]
    tilt: float  # Platform angle (rad).
    commanded: float  # Speed (m/s) commanded by the robot.
    speed: float  # Speed (m/s) of the turtle in turtlesim.
    brick_state: BrickState
    state: State


def trace(parameters: Parameters, drop: SimulatedDrop) -> list[TraceSample]:
    """Simulate a drop again, and return one sample per physics step."""
    simulation = start_simulation(parameters, drop.seed, drop.moving)
    samples: list[TraceSample] = []

    def record_sample() -> None:
        turtle = simulation.turtle.pose
        samples.append(TraceSample(
            simulation.time, simulation.world.brick, (turtle.x, turtle.y),
            simulation.tilt_angle, hypot(*simulation.commanded), turtle.linear_velocity,
            simulation.world.state, simulation.catcher.state))

    simulation.after_step = record_sample
    simulation.drop(drop.result.brick)
    simulation.rest(0.3)
    first_step = next(sample.time for sample in samples
                      if sample.brick_state is BrickState.FALLING)
    release = first_step - STEP_NS * SECONDS_PER_NS
    return [sample._replace(time=sample.time - release) for sample in samples]
