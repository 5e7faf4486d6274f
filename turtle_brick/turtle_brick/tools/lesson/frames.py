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

"""Lesson 1: one path of the robot in two frames, world and odom."""

from collections.abc import Iterator
from math import cos, degrees, hypot, pi, radians, sin
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from turtle_brick.core.geometry import Pose2D
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.time_steps import NANO
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.tools.plots import drawn, FAINT, INK, ROBOT
from turtle_brick.tools.simulation import Simulation

START = (3.0, 2.0, radians(30.0))
"""Where the robot starts (m, rad): neither at the origin nor along x."""

CORNERS = ((9.0, 3.0), (7.0, 8.5), (2.5, 6.0))
"""Where it is sent, one after another, in the world (m)."""

X_AXIS, Y_AXIS = '#d62728', '#2ca02c'
"""The colors that rviz2 gives to the axes x and y of a frame."""


class Stop(NamedTuple):
    """The robot at rest, in both frames."""

    world: Pose2D
    odom: Pose2D


def drive(parameters: Parameters) -> tuple[list[Pose2D], list[Stop]]:
    """Drive from START around CORNERS; return the path in the world, and the stops."""
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


def tell(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of this part."""
    _, stops = drive(parameters)
    yield ' ' * 9 + 'in world: x       y   theta    in odom: x       y   theta    distance'
    for name, stop, before in zip('SABC', stops, (None, *stops)):
        yield (f'  at {name}  {_in_words(stop.world)}       {_in_words(stop.odom)}'
               + (f'  {_distance(stop.world, before.world):6.3f} = '
                  f'{_distance(stop.odom, before.odom):.3f} m' if before else ''))


def _in_words(pose: Pose2D) -> str:
    # Rounding must leave no sign on a zero.
    return (f'{round(pose.x, 3) + 0.0:8.3f} {round(pose.y, 3) + 0.0:7.3f} '
            f'{round(degrees(pose.yaw), 1) + 0.0:5.1f}°')


def _distance(one: Pose2D, other: Pose2D) -> float:
    return hypot(one.x - other.x, one.y - other.y)


def draw(parameters: Parameters, path: Path) -> None:
    """Draw the path of the robot in the world, and what its odometry makes of it."""
    way, stops = drive(parameters)
    world, odom = Pose2D(0.0, 0.0, 0.0), stops[0].world
    to_odom = odom.inverse()
    corners = [Pose2D(x, y, 0.0) for x, y in (
        (0.0, 0.0), (ARENA_SIZE, 0.0), (ARENA_SIZE, ARENA_SIZE), (0.0, ARENA_SIZE))]
    with drawn(path, 7.6, 4.1) as figure:
        in_world, in_odom = figure.subplots(1, 2)
        for axes, line, places, walls, frames in (
                (in_world, way, [stop.world for stop in stops], corners,
                 (('world', world), ('odom', odom))),
                (in_odom, [to_odom.compose(pose) for pose in way], [stop.odom for stop in stops],
                 [to_odom.compose(corner) for corner in corners],
                 (('world', to_odom), ('odom', world)))):
            axes.add_patch(Polygon([(wall.x, wall.y) for wall in walls], fill=False,
                                   edgecolor=INK, linewidth=2.0))
            axes.plot([pose.x for pose in line], [pose.y for pose in line], color=FAINT,
                      linewidth=2.0, zorder=2)
            for name, place in zip('SABC', places):
                axes.add_patch(Circle((place.x, place.y), 0.42, facecolor='#e8f3ea',
                                      edgecolor=ROBOT, zorder=3))
                _draw_frame(axes, place, 0.9)
                axes.annotate(name, (place.x, place.y), xytext=(-17, 3), fontweight='bold',
                              textcoords='offset points')
            for name, frame in frames:
                _draw_frame(axes, frame, 1.5 if name == 'world' else 2.0, name)
        for axes, name, title in ((in_world, 'world', 'Where it is in world'),
                                  (in_odom, 'odom', '... and in odom')):
            axes.margins(0.09)
            axes.set(aspect='equal', xlabel=f'x in {name} / m', ylabel=f'y in {name} / m',
                     title=title)


def _draw_frame(axes: Axes, pose: Pose2D, size: float, name: str = '') -> None:
    """Draw the axes of a frame as rviz2 does, red for x and green for y."""
    for turn, color in ((0.0, X_AXIS), (pi / 2.0, Y_AXIS)):
        dx, dy = size * cos(pose.yaw + turn), size * sin(pose.yaw + turn)
        axes.annotate('', (pose.x + dx, pose.y + dy), (pose.x, pose.y), zorder=5, arrowprops={
            'arrowstyle': '-|>', 'color': color, 'linewidth': 1.8, 'shrinkA': 0.0, 'shrinkB': 0.0})
    axes.annotate(name, (pose.x, pose.y), textcoords='offset points',
                  xytext=(0 if pose.yaw >= 0.0 else -34, -15), fontweight='bold')
