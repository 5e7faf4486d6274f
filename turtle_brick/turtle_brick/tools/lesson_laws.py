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
What the lesson in doc/lesson shows: one experiment for each page, and its closed form.

Everything is computed by the modules that the nodes are made of, in the simulation without ROS;
the same parameters give the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import cos, hypot, radians, sin, sqrt
from typing import NamedTuple

from turtle_brick.core.driving import Driver, PERIOD, TRANSPORT
from turtle_brick.core.geometry import from_pitch, IDENTITY, Pose, Pose2D, Quaternion, Vector
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.platform import Platform
from turtle_brick.core.reachability import COMMAND_LATENCY, QUEUE_LATENCY, resting_height
from turtle_brick.core.time_steps import NANO
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TICK, Turtle
from turtle_brick.physics import Phase, STEP, World
from turtle_brick.tools.simulation import Simulation
from turtle_brick.tools.sweeping import Chain, Drop, JITTER, make

START = (3.0, 2.0, radians(30.0))
"""Where the robot of the first part starts (m, rad): neither at the origin nor along x."""

CORNERS = ((9.0, 3.0), (7.0, 8.5), (2.5, 6.0))
"""Where it is sent, one after another, in the world (m)."""

DT = STEP * NANO
"""Time (s) of a step of the physics."""


# ---------------------------------------------------------------------------------- 1 frames

class Stop(NamedTuple):
    """The robot at rest, in both frames."""

    world: Pose2D
    odom: Pose2D


def frames(parameters: Parameters) -> tuple[list[Pose2D], list[Stop]]:
    """
    Drive from START around CORNERS, with odometry.

    :param parameters: max_velocity and wheel_radius
    :return: The path in the world, and where the robot stood: at the start and at each corner.
    """
    simulation = Simulation(parameters, start=START)
    odometer = Odometer(parameters.wheel_radius)
    way: list[Pose2D] = []

    def look() -> None:
        pose = simulation.turtle.pose
        odometer.observe(simulation.now * NANO, pose)
        way.append(Pose2D(pose.x, pose.y, pose.theta))

    def stop() -> Stop:
        assert odometer.pose is not None
        return Stop(way[-1], odometer.pose)

    simulation.on_physics = look
    simulation.rest(0.3)
    stops = [stop()]
    for corner in CORNERS:
        simulation.drive_to(*corner)
        simulation.rest(0.1 + 16.0 / parameters.max_velocity)
        stops.append(stop())
    return way, stops


# --------------------------------------------------------------------------------- 2 rolling

class Roll(NamedTuple):
    """Three lengths (m) that one might take for what the wheel has rolled, at a time (s)."""

    time: float
    commanded: float
    """Commanded speed times time, added up."""
    seen: float
    """Distance between poses, added up."""
    rolled: float
    """Angle of the wheel times its radius."""


TELEPORT = 2.0
"""When (s) the turtle of the second part is teleported."""


def rolling(parameters: Parameters) -> list[Roll]:
    """
    Drive 1 s, rest, be teleported, and drive 1.5 s against a wall that is 1 s away.

    :param parameters: max_velocity and wheel_radius
    :return: What turtlesim's every tick adds.
    """
    turtle = Turtle(1.0, ARENA_CENTER, holonomic=True)
    odometer = Odometer(parameters.wheel_radius)
    speed = parameters.max_velocity
    rolls = [Roll(0.0, 0.0, 0.0, 0.0)]
    pose = turtle.pose
    odometer.observe(0.0, pose)
    for tick in range(1, round(4.5 / TICK)):
        now = tick * TICK
        if rolls[-1].time < TELEPORT <= now:
            turtle.teleport_absolute(ARENA_SIZE - speed, ARENA_CENTER, 0.0)
        drives = now <= 1.0 or 2.5 < now <= 4.0
        turtle.command(speed if drives else 0.0, 0.0, 0.0)
        last, pose = pose, turtle.tick(now)
        odometer.observe(now, pose)
        rolls.append(Roll(now, rolls[-1].commanded + pose.linear_velocity * TICK,
                          rolls[-1].seen + hypot(pose.x - last.x, pose.y - last.y),
                          odometer.wheel_angle * odometer.wheel_radius))
    return rolls


# --------------------------------------------------------------------------------- 3 falling

class Place(NamedTuple):
    """A brick at a time (s)."""

    time: float
    brick: Vector
    orientation: Quaternion


def falling(parameters: Parameters) -> list[Place]:
    """
    Let a brick fall from where it starts onto a level platform.

    :param parameters: the physical numbers
    :return: Where it is after each step, from the release until it lies there.
    """
    world = World.from_parameters(parameters)
    x, y, _ = world.brick
    world.platform = _platform((x, y), parameters, 0.0)
    world.release()
    places = [Place(0.0, world.brick, world.orientation)]
    while world.phase is Phase.FALLING:
        world.step()
        places.append(Place(len(places) * DT, world.brick, world.orientation))
    return places


def sliding(parameters: Parameters) -> list[Place]:
    """
    Let a brick slide off a platform that is tilted at once.

    :param parameters: the physical numbers
    :return: Where it is after each step, from the tilt until it floats; the platform's axis is the
        world's z axis.
    """
    world = World.from_parameters(parameters)
    world.brick = (0.0, 0.0, resting_height(parameters) + DT ** 2)
    world.platform = _platform((0.0, 0.0), parameters, 0.0)
    while world.phase is not Phase.RIDING:
        world.drop()
    world.platform = _platform((0.0, 0.0), parameters, parameters.tilt_angle)
    places: list[Place] = []
    while world.phase is Phase.RIDING:
        world.step()
        places.append(Place((len(places) + 1) * DT, world.brick, world.orientation))
    return places


def along_slope(place: Place, parameters: Parameters) -> float:
    """Return how far (m) a sliding brick has come along the platform."""
    x, _, z = place.brick
    above = z - (parameters.platform_height - parameters.platform_thickness)
    return x * cos(parameters.tilt_angle) - above * sin(parameters.tilt_angle)


def closed_fall(time: float, parameters: Parameters) -> float:
    """Return the height (m) of the brick a time (s) after its release: z0 - g t^2 / 2."""
    return parameters.brick_start[2] - 0.5 * parameters.gravity_accel * time ** 2


def closed_slide(time: float, parameters: Parameters) -> float:
    """Return how far (m) it has slid a time (s) after the tilt: g sin(angle) t^2 / 2."""
    return 0.5 * parameters.gravity_accel * sin(parameters.tilt_angle) * time ** 2


def slide_time(distance: float, parameters: Parameters) -> float:
    """Return when (s after the tilt) it has slid so far (m)."""
    return sqrt(2.0 * distance / (parameters.gravity_accel * sin(parameters.tilt_angle)))


def summed(steps: int, parameters: Parameters) -> list[float]:
    """Return the heights (m) of a fall that is summed up by Euler's method, step by step."""
    heights, speed = [parameters.brick_start[2]], 0.0
    for _ in range(steps):
        heights.append(heights[-1] - speed * DT)
        speed += parameters.gravity_accel * DT
    return heights


def _platform(place: tuple[float, float], parameters: Parameters, angle: float) -> Platform:
    hinge = parameters.platform_height - parameters.platform_thickness
    return Platform(Pose((*place, hinge), from_pitch(angle) if angle else IDENTITY))


# ----------------------------------------------------------------------------------- 4 queue

class Naive(Driver):
    """A controller as one first writes it: it steers by the pose that it has seen last."""

    def __init__(self, law: Callable[[float], float]) -> None:
        """
        Stand still until there is a goal.

        :param law: the speed (m/s) at a distance (m) from the goal
        """
        super().__init__(law(ARENA_SIZE))
        self.law = law

    def command(self, now: float) -> tuple[float, float]:
        """Return the velocity (m/s) in the turtle's frame that leads from there to the goal."""
        if self.goal is None or self.pose is None:
            return (0.0, 0.0)
        dx, dy = self.goal[0] - self.pose.x, self.goal[1] - self.pose.y
        distance = hypot(dx, dy)
        if distance == 0.0:
            return (0.0, 0.0)
        speed = self.law(distance)
        c, s = cos(self.pose.theta), sin(self.pose.theta)
        return (speed * (c * dx + s * dy) / distance, speed * (c * dy - s * dx) / distance)


WAY = 3.0
"""How far (m) the robots of the fourth part drive."""

NEAR = 0.01
"""Distance (m) from the goal within which a robot counts as there."""


def controllers(parameters: Parameters) -> dict[str, Driver]:
    """Return three naive controllers and ours, by name."""
    speed = parameters.max_velocity
    return {
        'full speed until within 5 cm': Naive(lambda gap: speed if gap > 0.05 else 0.0),
        'proportional, 10 per second': Naive(lambda gap: min(speed, 10.0 * gap)),
        'proportional, 4 per second': Naive(lambda gap: min(speed, 4.0 * gap)),
        'ours: from the predicted pose': Driver(speed),
    }


def approach(driver: Driver, parameters: Parameters) -> list[tuple[float, float]]:
    """
    Drive WAY along x and stay there for a while.

    :param driver: the controller
    :param parameters: the physical numbers
    :return: (time in s since the order, m beyond the goal), 250 times per second.
    """
    simulation = Simulation(parameters, seed=2)
    simulation.driver = driver
    simulation.rest(0.3)
    ordered, goal = simulation.now, ARENA_CENTER + WAY
    seen: list[tuple[float, float]] = []
    simulation.on_physics = lambda: seen.append(
        ((simulation.now - ordered) * NANO, simulation.turtle.pose.x - goal))
    simulation.drive_to(goal, ARENA_CENTER)
    simulation.rest(WAY / parameters.max_velocity + 2.0)
    return seen


class Sent(NamedTuple):
    """A command, and what became of it; times in s."""

    published: float
    latency: float
    """Until the arrival of the first pose that shows it, or a newer one if it was never taken."""
    taken: bool


def commands(phase: float = 0.0, seconds: float = 0.5) -> list[Sent]:
    """
    Send commands at 100 Hz to turtlesim, and find each again in its poses.

    :param phase: of turtlesim's ticks (s)
    :param seconds: how long
    :return: The commands that were sent when its queue was full already.
    """
    turtle = Turtle(holonomic=True)
    first, count = 32, round(seconds / PERIOD)
    arrivals: list[tuple[int, float]] = []
    sent = 0
    for tick in range(round((first + count + 10) * PERIOD / TICK)):
        now = phase + tick * TICK
        while sent * PERIOD + TRANSPORT <= now:
            sent += 1
            # The speed tells which command it is, the first one at 1 m/s.
            turtle.command(float(sent), 0.0, 0.0)
        arrivals.append((round(turtle.tick(now).linear_velocity) - 1, now + TRANSPORT))
    shown = {number for number, _ in arrivals}
    return [Sent((number - first) * PERIOD,
                 next(time for taken, time in arrivals if taken >= number) - number * PERIOD,
                 number in shown)
            for number in range(first, first + count)]


# ----------------------------------------------------------------------------------- 5 reach

HEIGHTS = tuple(0.5 * number for number in range(2, 21))
DISTANCES = tuple(0.2 * number for number in range(28))
"""Where the bricks of the fifth part are released: heights (m), and distances (m) from the robot
at rest in the center."""

SAMPLES = (3.0, 5.0, 8.0, 10.0)
"""The heights (m) that its table has."""

STEPS_OF_LATENCY = (
    ('third sample of the fall', 3 * DT),
    ('messages on their way', 3 * TRANSPORT),
    ("the robot's next command", PERIOD),
    ("turtlesim's queue", QUEUE_LATENCY),
    ("the robot's next transform", PERIOD),
    ("the arena's next step, reserve", COMMAND_LATENCY - 3 * TRANSPORT - 2 * PERIOD
     - QUEUE_LATENCY),
)
"""What passes (s, at worst) between a release and the platform's first motion."""


@cache
def reaching(parameters: Parameters) -> list[Drop]:
    """Drop a brick from each of HEIGHTS at each of DISTANCES; return what became of them."""
    return [drop_at(distance, height, parameters) for height in HEIGHTS for distance in DISTANCES]


def drop_at(distance: float, height: float, parameters: Parameters) -> Drop:
    """Drop a brick at a distance (m) from the robot, from a height (m)."""
    brick = (ARENA_CENTER + distance, ARENA_CENTER, height)
    return make(parameters, Chain(0, 1, (brick,)), JITTER)[0][0]


def farthest_caught(height: float, parameters: Parameters) -> float:
    """Return, by bisection, the greatest distance (m) at which a brick is caught."""
    caught, refused = 0.0, ARENA_SIZE - ARENA_CENTER
    while refused - caught > 0.001:
        middle = (caught + refused) / 2.0
        if drop_at(middle, height, parameters).outcome == 'caught':
            caught = middle
        else:
            refused = middle
    return caught
