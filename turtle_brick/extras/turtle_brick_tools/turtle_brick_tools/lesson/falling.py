# SPDX-License-Identifier: Apache-2.0

"""Lesson 3: closed-form solutions and stepwise simulation of the falling and sliding brick."""

from collections.abc import Iterator, Sequence
from math import cos, degrees, sin
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
import numpy as np
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import resting_height
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.physics import BrickState, STEP_NS, World
from turtle_brick_tools.plots import CAUGHT, FAINT, INK, MISSED, new_figure, REFUSED
from turtle_brick_tools.simulation import fall_time, make_world, platform_at

DT = STEP_NS * SECONDS_PER_NS
"""Duration (s) of a physics step."""


def fall(parameters: Parameters, world: World | None = None) -> np.ndarray:
    """Return the brick heights (m) before and after each step of a fall onto a level platform."""
    world = world or make_world(parameters)
    x, y, _ = world.brick
    world.platform = platform_at(x, y, 0.0, 0.0, parameters)
    heights = [world.brick[2]]
    while world.state is not BrickState.RIDING:
        world.drop()
        heights.append(world.brick[2])
    return np.array(heights)


def slide(parameters: Parameters) -> tuple[list[Vector], np.ndarray]:
    """Return the brick positions and sliding distances (m) after each step of a slide."""
    world = make_world(parameters)
    world.brick = (0.0, 0.0, resting_height(parameters) + DT ** 2)
    fall(parameters, world)
    world.platform = tilted = platform_at(0.0, 0.0, 0.0, parameters.tilt_angle, parameters)
    bricks = []
    while world.state is BrickState.RIDING:
        world.step()
        bricks.append(world.brick)
    return bricks, np.array([tilted.coordinates_of(brick)[0] for brick in bricks])


def closed_fall(time: np.ndarray, parameters: Parameters) -> np.ndarray:
    """Return the brick heights z0 - g t^2 / 2 (m) at given times (s) after the release."""
    return parameters.brick_start[2] - 0.5 * parameters.gravity_accel * time ** 2


def closed_slide(time: np.ndarray, parameters: Parameters) -> np.ndarray:
    """Return the sliding distances (m), g sin(angle) t^2 / 2, at given times t (s)."""
    return 0.5 * parameters.gravity_accel * sin(parameters.tilt_angle) * time ** 2


def euler_fall(time: np.ndarray, parameters: Parameters) -> np.ndarray:
    """Return the brick heights (m) that Euler's method computes for evenly spaced times (s)."""
    speeds = parameters.gravity_accel * time
    return parameters.brick_start[2] - DT * np.cumsum([0.0, *speeds[:-1]])


def report(parameters: Parameters) -> Iterator[str]:
    """Yield the results for this lesson, one line at a time."""
    *heights, landed = fall(parameters)
    time = DT * np.arange(len(heights))
    exact = fall_time(heights[0], parameters)
    speed = parameters.gravity_accel * exact
    error = abs(heights - closed_fall(time, parameters)).max()
    euler_error = euler_fall(time, parameters)[-1] - heights[-1]
    yield (f'  fall from {heights[0]:g} m to {landed:g} m: {exact:.4f} s, final speed '
           f'{speed:.2f} m/s; landed at step {len(heights)}, {DT * len(heights):.3f} s')
    yield (f'  maximum error: {1e3 * error:.3f} mm; with the Euler method: '
           f'{1e3 * euler_error:.1f} mm')
    yield f'  a timestamp error of 1 ms causes a height error of {speed:.1f} mm'
    _, distances = slide(parameters)
    time = DT * np.arange(1, len(distances) + 1)
    error = abs(distances - closed_slide(time, parameters)).max()
    rim = parameters.platform_radius
    clear = rim + parameters.brick_size[0] / 2.0
    acceleration = parameters.gravity_accel * sin(parameters.tilt_angle)
    rim_time, clear_time = np.sqrt(2.0 * np.array((rim, clear)) / acceleration)
    yield (f'  slide at {degrees(parameters.tilt_angle):.1f}°: {rim:g} m (center at the rim) in '
           f'{rim_time:.4f} s, {clear:g} m (brick clear) in {clear_time:.4f} s;')
    yield f'  clear at step {len(distances)}, {time[-1]:.3f} s, {distances[-1]:.3f} m'
    yield f'  maximum error: {1e3 * error:.3f} mm'


def draw(parameters: Parameters, path: Path) -> None:
    """Plot a simulated fall and slide, their exact solutions, and the errors in brick height."""
    with new_figure(path, 7.6, 5.6) as figure:
        (height, side), (error, distance) = figure.subplots(
            2, 2, height_ratios=(1.7, 1.0), width_ratios=(1.0, 1.15))
        draw_fall(height, error, parameters)
        bricks, distances = slide(parameters)
        draw_side_view(side, bricks, distances, parameters)
        time = DT * np.arange(1, len(distances) + 1)
        fine = np.linspace(0.0, time[-1], 201)
        distance.plot(fine, closed_slide(fine, parameters), color=REFUSED, linewidth=1.8,
                      label='g sin(angle) t² / 2')
        distance.plot(time[3::8], distances[3::8], 'o', color=INK, markersize=4.0,
                      label='every 8th step')
        distance.set(xlim=(0.0, None), ylim=(0.0, None), xlabel='time since the tilt / s',
                     ylabel='sliding distance / m')
        distance.legend(loc='upper left')


def draw_fall(height: Axes, error: Axes, parameters: Parameters) -> None:
    """Plot the height of a falling brick, and the errors of physics.World and Euler's method."""
    heights = fall(parameters)
    time = DT * np.arange(len(heights))
    fine = np.linspace(0.0, time[-1], 201)
    height.plot(fine, closed_fall(fine, parameters), color=REFUSED, linewidth=1.8,
                label='z₀ − g t² / 2')
    height.plot(time[:-1:15], heights[:-1:15], 'o', color=INK, markersize=4.0,
                label='every 15th step')
    height.plot(time[-1], heights[-1], 's', color=CAUGHT, markersize=6.0, label='on the platform')
    height.set(xlim=(0.0, None), ylim=(0.0, 1.05 * heights[0]), ylabel='brick height / m',
               title='The fall')
    height.legend(loc='lower left')
    time, heights = time[:-1], heights[:-1]
    exact = closed_fall(time, parameters)
    error.plot(time, 1e3 * (euler_fall(time, parameters) - exact), color=MISSED, linewidth=2.0,
               label='Euler method')
    error.plot(time, 1e3 * (heights - exact), color=CAUGHT, linewidth=2.0, label='physics.World')
    error.set(xlim=height.get_xlim(), xlabel='time since the release / s',
              ylabel='height error / mm')
    error.legend(loc='upper left')


def draw_side_view(axes: Axes, bricks: Sequence[Vector], distances: np.ndarray,
                   parameters: Parameters) -> None:
    """Draw the tilted platform, and the brick before the slide, at the rim and after the slide."""
    angle = parameters.tilt_angle
    normal = np.array((sin(angle), cos(angle)))
    hinge = np.array((0.0, parameters.platform_height - parameters.platform_thickness))

    def box(center: np.ndarray, length: float, thickness: float, **options: Any) -> None:
        corner = (center[0] - length / 2.0, center[1] - thickness / 2.0)
        axes.add_patch(Rectangle(corner, length, thickness, angle=-degrees(angle),
                                 rotation_point='center', **options))

    axes.plot([0.0, 0.0], [hinge[1] - 0.45, hinge[1]], color=FAINT, linewidth=7.0, zorder=1)
    thickness = parameters.platform_thickness
    box(hinge + thickness / 2.0 * normal, 2.0 * parameters.platform_radius, thickness,
        facecolor='#7fb2e5', edgecolor=CAUGHT, zorder=2)
    for distance in (0.0, parameters.platform_radius, distances[-1]):
        step = int(np.argmax(distances >= distance))
        center = np.array(bricks[step])[[0, 2]]
        box(center, parameters.brick_size[0], parameters.brick_size[2], facecolor=REFUSED,
            alpha=0.4 + 0.5 * distance, edgecolor='white', zorder=3)
        x, z = center + 0.13 * normal
        axes.text(x, z, f'{DT * (step + 1):.2f} s', zorder=4)
    axes.set(aspect='equal', xlim=(-0.5, 0.95), ylim=(hinge[1] - 0.6, hinge[1] + 0.5),
             xlabel='x / m', ylabel='height / m', title=f'The slide at {degrees(angle):.0f}°')
