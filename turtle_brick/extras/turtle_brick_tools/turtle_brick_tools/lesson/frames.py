# SPDX-License-Identifier: Apache-2.0

"""Lesson 1: one robot path in two frames, world and odom."""

from collections.abc import Iterator
from math import cos, degrees, dist, pi, radians, sin
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from turtle_brick.core.geometry import Pose2D
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick_tools.plots import FAINT, INK, new_figure, ROBOT
from turtle_brick_tools.simulation import Simulation

START = (3.0, 2.0, radians(30.0))
"""Initial pose (m, rad) of the robot in the world frame. This pose defines the odom frame."""

CORNERS = ((9.0, 3.0), (7.0, 8.5), (2.5, 6.0))
"""Goals (m) of the robot in the world frame, in driving order."""

WALLS = ((0.0, 0.0), (ARENA_SIZE, 0.0), (ARENA_SIZE, ARENA_SIZE), (0.0, ARENA_SIZE))

WORLD = Pose2D(0.0, 0.0, 0.0)


def drive(parameters: Parameters) -> tuple[list[Pose2D], list[tuple[Pose2D, Pose2D]]]:
    """Return the robot's path in the world frame, and the stops in the world and odom frames."""
    simulation = Simulation(parameters, start=START)
    odometer = Odometer(parameters.wheel_radius)
    path: list[Pose2D] = []

    def record() -> None:
        pose = simulation.turtle.pose
        odometer.observe(simulation.now * SECONDS_PER_NS, pose, simulation.driver.stem_angle)
        path.append(Pose2D(pose.x, pose.y, pose.theta))

    simulation.after_step = record
    simulation.rest(0.3)
    stops = [(path[-1], odometer.pose or WORLD)]
    for corner in CORNERS:
        simulation.drive_to(*corner)
        simulation.rest(0.1 + 16.0 / parameters.max_velocity)
        stops.append((path[-1], odometer.pose or WORLD))
    return path, stops


def report(parameters: Parameters) -> Iterator[str]:
    """Yield the results for this lesson, one line at a time."""
    _, stops = drive(parameters)
    yield ' ' * 9 + '   world: x       y   theta       odom: x       y   theta    distance'
    for name, stop, before in zip('SABC', stops, (None, *stops)):
        line = f'  at {name}  ' + '       '.join(map(_format, stop))
        if before:
            lengths = [dist(start[:2], end[:2]) for start, end in zip(before, stop)]
            line += '  {:6.3f} = {:.3f} m'.format(*lengths)
        yield line


def _format(pose: Pose2D) -> str:
    # Adding 0.0 turns -0.0 into 0.0.
    return (f'{round(pose.x, 3) + 0.0:8.3f} {round(pose.y, 3) + 0.0:7.3f} '
            f'{round(degrees(pose.yaw), 1) + 0.0:5.1f}°')


def draw(parameters: Parameters, path: Path) -> None:
    """Draw the path of the robot in the world frame and in the odom frame."""
    way, stops = drive(parameters)
    start, _ = stops[0]
    with new_figure(path, 7.6, 4.1) as figure:
        for axes, frame, view, title in zip(
                figure.subplots(1, 2), ('world', 'odom'), (WORLD, start.inverse()),
                ('The path in the world frame', 'The same path in the odom frame')):
            axes.add_patch(Polygon(
                [view.compose(Pose2D(x, y, 0.0))[:2] for x, y in WALLS], fill=False,
                edgecolor=INK, linewidth=2.0))
            x, y, _ = zip(*map(view.compose, way))
            axes.plot(x, y, color=FAINT, linewidth=2.0, zorder=2)
            for name, (stop, _), offset in zip(
                    'SABC', stops, ((-17, 3), (3, -20), (-17, 3), (-17, 3))):
                pose = view.compose(stop)
                axes.add_patch(Circle(pose[:2], 0.42, facecolor='#e8f3ea', edgecolor=ROBOT,
                                      zorder=3))
                _draw_frame(axes, pose, 0.9, name, offset)
            _draw_frame(axes, view, 1.5, 'world', (8, 9) if frame == 'world' else (-20, -17))
            _draw_frame(axes, view.compose(start), 2.0, 'odom',
                        (0, -17) if frame == 'world' else (8, 9))
            axes.margins(0.12, 0.09)
            axes.set(aspect='equal', title=title,
                     xlabel=f'x in the {frame} frame / m', ylabel=f'y in the {frame} frame / m')


def _draw_frame(axes: Axes, pose: Pose2D, size: float, name: str, offset: tuple[int, int]) -> None:
    """Draw the name and the axes of a frame (x red, y green, as in rviz2)."""
    for turn, color in ((0.0, '#d62728'), (pi / 2.0, '#2ca02c')):
        end = pose.x + size * cos(pose.yaw + turn), pose.y + size * sin(pose.yaw + turn)
        axes.annotate('', end, pose[:2], zorder=5, arrowprops={
            'arrowstyle': '-|>', 'color': color, 'linewidth': 1.8, 'shrinkA': 0.0, 'shrinkB': 0.0})
    axes.annotate(name, pose[:2], textcoords='offset points', xytext=offset, fontweight='bold')
