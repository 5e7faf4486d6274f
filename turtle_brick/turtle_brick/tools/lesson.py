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
lesson: the numbers and figures of the lesson in doc/lesson, made anew.

Five parts, each a page there: frames, rolling, falling, queue and reach. Everything is computed by
the modules that the nodes are made of, in the simulation without ROS, from config/turtle.yaml or
the file that --params-file names; the same file gives the same numbers. Each part prints its
numbers and draws its figure, lesson-<part>.png.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from collections.abc import Iterator
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from math import cos
from math import degrees
from math import e
from math import hypot
from math import pi
from math import radians
from math import sin
from math import sqrt
from pathlib import Path
import sys
from typing import NamedTuple

from turtle_brick.driving import Driver
from turtle_brick.driving import PERIOD
from turtle_brick.driving import TRANSPORT
from turtle_brick.geometry import from_pitch
from turtle_brick.geometry import IDENTITY
from turtle_brick.geometry import Pose
from turtle_brick.geometry import Pose2D
from turtle_brick.geometry import Quaternion
from turtle_brick.geometry import Vector
from turtle_brick.odometry import Odometer
from turtle_brick.parameters import load
from turtle_brick.parameters import ParameterError
from turtle_brick.parameters import Parameters
from turtle_brick.physics import Phase
from turtle_brick.physics import STEP
from turtle_brick.physics import World
from turtle_brick.reaching import COMMAND_LATENCY
from turtle_brick.reaching import guaranteed_distance
from turtle_brick.reaching import QUEUE_LATENCY
from turtle_brick.reaching import resting_height
from turtle_brick.simulation import Simulation
from turtle_brick.step_clock import NANO
from turtle_brick.tools.measuring import percentile
from turtle_brick.tools.sweeping import Chain
from turtle_brick.tools.sweeping import Drop
from turtle_brick.tools.sweeping import JITTER
from turtle_brick.tools.sweeping import make
from turtle_brick.turtlesim_kinematics import ARENA_CENTER
from turtle_brick.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.turtlesim_kinematics import TICK
from turtle_brick.turtlesim_kinematics import Turtle

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
    :return: The way in the world, and where the robot stood: at the start and at each corner.
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


def tell_frames(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the first part."""
    _, stops = frames(parameters)
    yield ' ' * 9 + 'in world: x       y   theta    in odom: x       y   theta    way'
    for name, stop, before in zip('SABC', stops, (None, *stops)):
        yield (f'  at {name}  {_pose(stop.world)}       {_pose(stop.odom)}'
               + (f'  {_distance(stop.world, before.world):6.3f} = '
                  f'{_distance(stop.odom, before.odom):.3f} m' if before else ''))


def _pose(pose: Pose2D) -> str:
    # Rounding must leave no sign on a zero.
    return (f'{round(pose.x, 3) + 0.0:8.3f} {round(pose.y, 3) + 0.0:7.3f} '
            f'{round(degrees(pose.yaw), 1) + 0.0:5.1f}°')


def _distance(one: Pose2D, other: Pose2D) -> float:
    return hypot(one.x - other.x, one.y - other.y)


# --------------------------------------------------------------------------------- 2 rolling

class Roll(NamedTuple):
    """The three lengths (m) that one might take for the way of the wheel, at a time (s)."""

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


def tell_rolling(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the second part."""
    rolls = rolling(parameters)
    radius, speed = parameters.wheel_radius, parameters.max_velocity
    yield f'  wheel_radius {radius:g} m: one turn is {2.0 * pi * radius:.3f} m'
    yield (f'  at {speed:g} m/s: {speed / radius:.2f} rad/s, {speed / (2.0 * pi * radius):.2f} '
           f'turns per second, {degrees(speed / radius * TICK):.1f}° per tick of turtlesim')
    yield '                                     commanded   between poses   wheel'
    for what, time in (('after 1 s of driving', 1.2), ('after the teleport', 2.3),
                       ('after 1.5 s towards a wall 1 s away', 4.4)):
        roll = next(roll for roll in rolls if roll.time >= time)
        yield (f'  {what:35}{roll.commanded:9.3f} m{roll.seen:13.3f} m'
               f'{roll.rolled:9.3f} m = {roll.rolled / radius:.2f} rad')


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


def summed(steps: int, parameters: Parameters) -> list[float]:
    """Return the heights (m) of a fall that is summed up by Euler's method, step by step."""
    heights, speed = [parameters.brick_start[2]], 0.0
    for _ in range(steps):
        heights.append(heights[-1] - speed * DT)
        speed += parameters.gravity_accel * DT
    return heights


def _platform(place: tuple[float, float], parameters: Parameters, angle: float) -> Pose:
    hinge = parameters.platform_height - parameters.platform_thickness
    return Pose((*place, hinge), from_pitch(angle) if angle else IDENTITY)


def tell_falling(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the third part."""
    fall, slide = falling(parameters), sliding(parameters)
    fallen = fall[:-1]  # the last place is that of the brick at rest
    exact = sqrt(2.0 * (fall[0].brick[2] - resting_height(parameters)) / parameters.gravity_accel)
    speed = parameters.gravity_accel * exact
    error = max(abs(place.brick[2] - closed_fall(place.time, parameters)) for place in fallen)
    sums = summed(len(fallen), parameters)[len(fallen) - 1]
    yield (f'  from {fall[0].brick[2]:g} m down to {resting_height(parameters):g} m: '
           f'{exact:.4f} s, then at {speed:.2f} m/s; landed at step {len(fall) - 1}, '
           f'{fall[-1].time:.3f} s')
    yield (f'  largest distance from the closed form: {1e3 * error:.3f} mm; summed by Euler: '
           f'{1e3 * (sums - fallen[-1].brick[2]):.1f} mm')
    yield f'  a stamp that is wrong by 1 ms is a height that is wrong by {speed:.1f} mm'
    error = max(abs(along_slope(place, parameters) - closed_slide(place.time, parameters))
                for place in slide)
    gone = along_slope(slide[-1], parameters)
    exact = sqrt(2.0 * (parameters.platform_radius + parameters.brick_size[0] / 2.0)
                 / (parameters.gravity_accel * sin(parameters.tilt_angle)))
    yield (f'  slide at {degrees(parameters.tilt_angle):.1f}°: {exact:.4f} s to the rim; clear at '
           f'{slide[-1].time:.3f} s, {gone:.3f} m down the slope')
    yield f'  largest distance from the closed form: {1e3 * error:.3f} mm'


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


def tell_queue(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the fourth part."""
    every = [sent for phase in range(16) for sent in commands(1e-3 * phase + 1e-4)]
    latencies = sorted(1e3 * sent.latency for sent in every)
    median = percentile(latencies, 0.5)
    taken = sum(sent.taken for sent in every) / len(every)
    yield f'  of the commands turtlesim takes {100.0 * taken:.1f} %'
    yield (f'  from publishing one to the pose that shows it, or a newer one: '
           f'{latencies[0]:.0f} to {latencies[-1]:.0f} ms, median {median:.0f} ms')
    yield (f'  at {parameters.max_velocity:g} m/s that is '
           f'{0.1 * parameters.max_velocity * median:.0f} cm of way')
    yield (f'  a delay of {median:.0f} ms has a proportional controller overshoot above '
           f'{1e3 / (e * median):.1f} per second,')
    yield f'  and swing for ever above {1e3 * pi / (2.0 * median):.1f} per second'
    yield f'  {WAY:g} m to drive:                overshoot   within {100.0 * NEAR:g} cm for good'
    for name, driver in controllers(parameters).items():
        seen = approach(driver, parameters)
        settled = max(time for time, beyond in seen if abs(beyond) > NEAR)
        yield (f'    {name:31}{100.0 * max(max(beyond for _, beyond in seen), 0.0):6.1f} cm'
               + (f'{settled:13.2f} s' if settled < seen[-1][0] - 0.1 else '        never'))


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


def tell_reach(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the fifth part."""
    drops = reaching(parameters)
    count = {outcome: sum(drop.outcome == outcome for drop in drops)
             for outcome in ('caught', 'refused', 'missed')}
    yield f'  {len(drops):,} drops: ' + ', '.join(
        f'{number:,} {outcome}' for outcome, number in count.items())
    yield '  from       fall    a catch is promised to    and found to'
    for height in SAMPLES:
        fall = sqrt(2.0 * (height - resting_height(parameters)) / parameters.gravity_accel)
        yield (f'  {height:4g} m{fall:8.3f} s{guaranteed_distance(height, parameters):16.2f} m'
               f'{farthest_caught(height, parameters):20.2f} m')
    yield '  at worst, from the release to the first motion:'
    for what, time in STEPS_OF_LATENCY:
        yield f'    {what:32}{1e3 * time:6.1f} ms'
    yield f'    {"in all":32}{1e3 * sum(time for _, time in STEPS_OF_LATENCY):6.1f} ms'


# -------------------------------------------------------------------------------- the program

PARTS: dict[str, Callable[[Parameters], Iterator[str]]] = {
    'frames': tell_frames,
    'rolling': tell_rolling,
    'falling': tell_falling,
    'queue': tell_queue,
    'reach': tell_reach,
}


def part(name: str) -> str:
    """Return the name of a part as it was typed, or refuse it."""
    if name not in PARTS:
        raise argparse.ArgumentTypeError(f'{name!r} is none of {", ".join(PARTS)}')
    return name


def main(args: Sequence[str] | None = None) -> int:
    """Print and draw the parts that are asked for; return the exit status."""
    first, second = (__doc__ or '').strip().split('\n\n')[:2]
    parser = argparse.ArgumentParser(
        prog='lesson', description=first.partition(': ')[2].capitalize(), epilog=second)
    parser.add_argument('parts', nargs='*', type=part, metavar='PART',
                        help=f'{", ".join(PARTS)} (default: all)')
    parser.add_argument('--params-file', type=Path, metavar='FILE',
                        help='the parameters (default: config/turtle.yaml of the package)')
    parser.add_argument('--output', type=Path, default=Path('lesson'), metavar='DIR',
                        help='where the figures go (default: lesson)')
    options = parser.parse_args(args)
    try:
        parameters = load(options.params_file)
        if resting_height(parameters) >= min(parameters.brick_start[2], SAMPLES[0]):
            raise ParameterError(
                f'platform_height {parameters.platform_height:g} m is too high for this lesson: '
                f'a brick falls from {SAMPLES[0]:g} m, and from that of brick_start')
        for name in options.parts or PARTS:
            print(f'{name}:', *PARTS[name](parameters), sep='\n', flush=True)
            draw(name, parameters, options.output)
    except (OSError, ParameterError) as error:
        print(f'lesson: {error}', file=sys.stderr)
        return 2
    return 0


def draw(name: str, parameters: Parameters, directory: Path) -> None:
    """
    Draw the figure of a part, if matplotlib is here.

    :param name: the part's
    :param parameters: the physical numbers
    :param directory: where the figure goes; made if it is not there
    :raises OSError: it cannot be written
    """
    if find_spec('matplotlib') is None:
        print('  no figure: it needs matplotlib (apt: python3-matplotlib, pip: matplotlib)')
        return
    from turtle_brick.tools import lesson_figures
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / f'lesson-{name}.png'
    getattr(lesson_figures, name)(parameters, path)
    print(f'  {path}', flush=True)


if __name__ == '__main__':
    sys.exit(main())
