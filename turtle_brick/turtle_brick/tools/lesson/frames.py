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
from dataclasses import asdict
from itertools import product
import json
from math import cos, degrees, hypot, pi, radians, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple
from xml.etree import ElementTree

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
import numpy as np
from turtle_brick.core.geometry import IDENTITY, Pose, Pose2D
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.time_steps import NANO
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.tools.description import robot_description
from turtle_brick.tools.plots import arrow, drawn, FAINT, INK, REFUSED, ROBOT, sketched
from turtle_brick.tools.simulation import Simulation
from turtle_brick.view.shapes import ORIGIN, robot_shapes, Shape

START = (3.0, 2.0, radians(30.0))
"""Where the robot starts (m, rad): neither at the origin nor along x."""

CORNERS = ((9.0, 3.0), (7.0, 8.5), (2.5, 6.0))
"""Where it is sent, one after another, in the world (m)."""

X_AXIS, Y_AXIS, Z_AXIS = '#d62728', '#2ca02c', '#1f4fd6'
"""The colors that rviz2 gives to the axes of a frame."""

LABELS = {'base_link': -1, 'stem': 1, 'wheel': -1, 'post': -1, 'platform': 1, 'brick': -1}
"""On which side of the robot a frame is labeled; the others are decoration."""


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


def urdf(parameters: Parameters) -> str:
    """Return the robot's description."""
    with TemporaryDirectory() as folder:
        file = Path(folder, 'turtle.yaml')
        file.write_text(json.dumps({'/**': {'ros__parameters': asdict(parameters)}}))
        return robot_description(file)


def outline(shape: Shape, frame: Pose) -> np.ndarray:
    """Return points (m) of a shape in a frame, whose outline is that seen along any main axis."""
    if shape.kind == 'box':
        points = [*product((-0.5, 0.5), repeat=3)]
    else:
        height = 0.5 if shape.kind == 'cylinder' else 0.0
        points = [(cos(turn) / 2.0, sin(turn) / 2.0, side) for side in (-height, height)
                  for turn in np.linspace(0.0, 2.0 * pi, 48)]
        if shape.kind == 'sphere':
            points = [(x, 0.0, y) for x, y, _ in points]
    pose = frame.compose(shape.pose)
    return np.array([pose.transform((x * shape.size[0], y * shape.size[1], z * shape.size[2]))
                     for x, y, z in points])


def links(description: str) -> dict[str, tuple[Pose, str]]:
    """Return the frames of a robot's links in its root, and the axis about which each turns."""
    found = {robot_shapes(description).root: (ORIGIN, '')}
    joint: Any
    for joint in ElementTree.fromstring(description).findall('joint'):
        x, y, z = map(float, joint.find('origin').get('xyz').split())
        axis = joint.find('axis')
        about = '' if axis is None else 'xyz'[axis.get('xyz').split().index('1')]
        parent, _ = found[joint.find('parent').get('link')]
        found[joint.find('child').get('link')] = parent.compose(Pose((x, y, z), IDENTITY)), about
    return found


def sketch(parameters: Parameters, path: Path) -> None:
    """Draw the robot from its right side, with its frames and a brick above it."""
    description = urdf(parameters)
    reach, height = 1.1 * parameters.platform_radius, parameters.platform_height + 0.35
    frames = {**links(description), 'brick': (Pose((0.0, 0.0, height), IDENTITY), '')}
    shapes = {**robot_shapes(description).links,
              'brick': (Shape('box', parameters.brick_size, (0.76, 0.33, 0.18, 1.0)),)}
    solids = [(outline(shape, frames[name][0]), shape.color)
              for name in shapes for shape in shapes[name]]
    with sketched(path, 7.6, 5.6, (-2.6 * reach, 2.6 * reach), (-0.1, height + 0.25)) as axes:
        axes.plot([-reach, reach], [0.0, 0.0], color=FAINT, linewidth=1.2)
        for points, color in sorted(solids, key=lambda solid: -solid[0][:, 1].min()):
            seen = points[:, ::2]
            x, z = (seen - seen.mean(axis=0)).T
            axes.add_patch(Polygon(seen[np.argsort(np.arctan2(z, x))], facecolor=color,
                                   edgecolor=INK, linewidth=0.5))
        for name, side in LABELS.items():
            (x, _, z), about = frames[name][0].position, frames[name][1]
            axes.plot([x, side * 1.15 * reach], [z, z], ':', color=INK, zorder=4)
            axes.text(side * 1.2 * reach, z, name + (f': turns about {about}' if about else ''),
                      fontweight='bold', va='center', ha='left' if side > 0 else 'right')
            arrow(axes, (x, z), (x + 0.17, z), color=X_AXIS)
            arrow(axes, (x, z), (x, z + 0.17), color=Z_AXIS)
            for mark, size in (('o', 7.0), ('x', 4.0)):
                axes.plot(x, z, mark, color='white', markeredgecolor=Y_AXIS, markersize=size,
                          zorder=6)
        hinge = frames['platform'][0].position[2]
        arrow(axes, (reach, hinge + 0.12), (reach, hinge - 0.2), 'a positive tilt', (48, -12),
              REFUSED, bend=-0.4)


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
            for name, place, offset in zip('SABC', places, ((-17, 3), (3, -20), *2 * [(-17, 3)])):
                axes.add_patch(Circle((place.x, place.y), 0.42, facecolor='#e8f3ea',
                                      edgecolor=ROBOT, zorder=3))
                _draw_frame(axes, place, 0.9)
                axes.annotate(name, (place.x, place.y), xytext=offset, fontweight='bold',
                              textcoords='offset points')
            for name, frame in frames:
                _draw_frame(axes, frame, 1.5 if name == 'world' else 2.0, name)
        for axes, name, title in ((in_world, 'world', 'Where it is in world'),
                                  (in_odom, 'odom', '... and in odom')):
            axes.margins(0.12, 0.09)
            axes.set(aspect='equal', xlabel=f'x in {name} / m', ylabel=f'y in {name} / m',
                     title=title)


def _draw_frame(axes: Axes, pose: Pose2D, size: float, name: str = '') -> None:
    """Draw the axes of a frame as rviz2 does, red for x and green for y."""
    for turn, color in ((0.0, X_AXIS), (pi / 2.0, Y_AXIS)):
        dx, dy = size * cos(pose.yaw + turn), size * sin(pose.yaw + turn)
        arrow(axes, (pose.x, pose.y), (pose.x + dx, pose.y + dy), color=color)
    beside = (8, 9) if pose.yaw == 0.0 else (0 if pose.yaw > 0.0 else -20, -17)
    axes.annotate(name, (pose.x, pose.y), textcoords='offset points', xytext=beside,
                  fontweight='bold')
