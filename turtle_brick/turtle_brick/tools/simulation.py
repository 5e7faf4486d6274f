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
seed, so that every run can be repeated.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from random import Random
from typing import NamedTuple

from turtle_brick.core import catch_logic, driving
from turtle_brick.core.catch_logic import Catcher, DriveOrder, State, TiltOrder
from turtle_brick.core.driving import Driver, within_arena
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose, Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import Decision
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import NANO
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, TICK, Turtle, TurtlePose
from turtle_brick.physics import Phase, STEP, World

ROBOT_PERIOD = round(driving.PERIOD / NANO)
TICK_PERIOD = round(TICK / NANO)
CATCHER_PERIOD = round(catch_logic.PERIOD / NANO)


@dataclass(frozen=True)
class Delays:
    """The delays of the live graph (s)."""

    transport: float = driving.TRANSPORT
    """Time from publishing a message to its arrival in another node."""
    transforms: float = 0.0010
    """Time from the robot's cycle to the platform's transform, through robot_state_publisher."""
    tick_jitter: float = 0.0
    """Standard deviation of turtlesim's ticks about their grid."""
    robot_jitter: float = 0.0
    """Standard deviation of the robot's cycles about theirs."""


class Result(NamedTuple):
    """The course of a drop; lengths in m, times in s."""

    brick: Vector
    """Where it was released."""
    robot: tuple[float, float]
    """Where the robot was then."""
    decision: Decision | None
    caught: bool
    fall_time: float
    """Time from release to contact with the platform or the ground."""
    decision_time: float
    """Time from release to decision."""
    carried_to: tuple[float, float] | None
    """Where the robot tilted."""
    slide_time: float
    """Time from the first tilt until the brick floats."""
    finished: bool
    """Whether the catcher was waiting again at the end."""


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
        self.on_physics: Callable[[], None] | None = None
        """Called after each step of the physics."""
        self.commanded = (0.0, 0.0)
        """The latest velocity (m/s) that the robot commands, in the turtle's frame."""
        self.decisions: list[tuple[int, Decision]] = []
        """Every decision with its instant (ns)."""
        self._hinge = parameters.platform_height - parameters.platform_thickness
        self._tilt = 0.0
        self._shown: tuple[TurtlePose | None, float] = (None, 0.0)
        # What is on its way: (time of arrival, content), in order.
        self._to_turtle: deque[tuple[int, float, float]] = deque()
        self._to_driver: deque[tuple[int, TurtlePose]] = deque()
        self._orders: deque[tuple[int, DriveOrder | TiltOrder]] = deque()
        self._transforms: deque[tuple[int, Platform]] = deque()
        self._transport = round(delays.transport / NANO)
        self._transform_delay = round(delays.transforms / NANO)
        uniform = self.random.randrange
        self._physics_at = uniform(STEP)
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
        end = self.now + limit / NANO
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
        fall_time = (self.now - released) * NANO
        caught = world.phase is Phase.RIDING
        carried_to, slide_time = None, 0.0
        finished = True
        if caught:
            # Enough for the way across the arena at max_velocity, and for the slide.
            longest = 30.0 + 16.0 / self.parameters.max_velocity
            finished = self.run(lambda: catcher.state is State.TILTING, longest)
            carried_to = self.turtle.pose[:2]
            tilted = self.now
            finished = finished and self.run(lambda: world.phase is Phase.FLOATING, 30.0)
            slide_time = (self.now - tilted) * NANO
        finished = finished and self.run(lambda: catcher.state is State.WAITING, 10.0)
        told: list[tuple[float, Decision | None]] = [*self.decisions[decisions:], (inf, None)]
        decided, decision = told[0]
        return Result(brick, robot, decision, caught, fall_time, (decided - released) * NANO,
                      carried_to, slide_time, finished)

    def _tick(self, now: int) -> None:
        """Do what turtlesim does every 16 ms."""
        self._tick_grid += TICK_PERIOD
        self._tick_at = self._jittered(self._tick_grid, self.delays.tick_jitter)
        inbox = self._to_turtle
        while inbox and inbox[0][0] <= now:
            _, linear_x, linear_y = inbox.popleft()
            self.turtle.command(linear_x, linear_y, 0.0)
        pose = self.turtle.tick(now * NANO)
        self._to_driver.append((now + self._transport, pose))

    def _cycle(self, now: int) -> None:
        """Do what the robot does 100 times per second."""
        self._robot_grid += ROBOT_PERIOD
        self._robot_at = self._jittered(self._robot_grid, self.delays.robot_jitter)
        inbox, driver = self._to_driver, self.driver
        while inbox and inbox[0][0] <= now:
            arrival, pose = inbox.popleft()
            driver.observe(arrival * NANO, pose)
        while self._orders and self._orders[0][0] <= now:
            _, order = self._orders.popleft()
            if isinstance(order, TiltOrder):
                self._tilt = order.angle
            else:
                driver.drive_to(*within_arena(order.x, order.y))
        self.commanded = driver.command(now * NANO)
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
        self._physics_at += STEP
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
            instant += round(self.random.gauss(0.0, deviation) / NANO)
        return max(instant, self.now + 1)
