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

"""Lesson 3: the fall and the slide in closed form, and what a sum of steps would do."""

from collections.abc import Iterator, Sequence
from math import cos, degrees, sin, sqrt
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.patches import Polygon
import numpy as np
from turtle_brick.core.geometry import from_pitch, Pose, Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import fall_time, resting_height
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.physics import Phase, STEP_NS, World
from turtle_brick.tools.plots import CAUGHT, drawn, FAINT, INK, MISSED, REFUSED

DT = STEP_NS * SECONDS_PER_NS
"""Time (s) of a step of the physics."""


def fall(parameters: Parameters, world: World | None = None) -> np.ndarray:
    """Return the heights (m) before and after each step of a fall onto a level platform."""
    world = world or World.from_parameters(parameters)
    world.platform = platform(parameters, 0.0, world.brick[:2])
    heights = [world.brick[2]]
    while world.phase is not Phase.RIDING:
        world.drop()
        heights.append(world.brick[2])
    return np.array(heights)


def slide(parameters: Parameters) -> tuple[list[Vector], np.ndarray]:
    """
    Let a brick slide off a platform, about the world's z axis, that is tilted at once.

    :return: after each step, where the brick is, and how far (m) it has come along the platform
    """
    world = World.from_parameters(parameters)
    world.brick = (0.0, 0.0, resting_height(parameters) + DT ** 2)
    fall(parameters, world)
    world.platform = tilted = platform(parameters, parameters.tilt_angle)
    bricks = []
    while world.phase is Phase.RIDING:
        world.step()
        bricks.append(world.brick)
    return bricks, np.array([tilted.coordinates_of(brick)[0] for brick in bricks])


def platform(parameters: Parameters, angle: float,
             place: tuple[float, float] = (0.0, 0.0)) -> Platform:
    """Return a platform at an angle (rad), at a place in the world (m)."""
    hinge = parameters.platform_height - parameters.platform_thickness
    return Platform(Pose((*place, hinge), from_pitch(angle)))


def closed_fall(time: np.ndarray, parameters: Parameters) -> np.ndarray:
    """Return the heights (m) of the brick at times (s) after its release: z0 - g t^2 / 2."""
    return parameters.brick_start[2] - 0.5 * parameters.gravity_accel * time ** 2


def closed_slide(time: np.ndarray, parameters: Parameters) -> np.ndarray:
    """Return how far (m) it has slid at times (s) after the tilt: g sin(angle) t^2 / 2."""
    return 0.5 * parameters.gravity_accel * sin(parameters.tilt_angle) * time ** 2


def slide_time(distance: float, parameters: Parameters) -> float:
    """Return when (s after the tilt) it has slid so far (m)."""
    return sqrt(2.0 * distance / (parameters.gravity_accel * sin(parameters.tilt_angle)))


def summed(time: np.ndarray, parameters: Parameters) -> np.ndarray:
    """Return the heights (m) at these times of a fall that is summed up by Euler's method."""
    speeds = parameters.gravity_accel * time
    return parameters.brick_start[2] - DT * np.cumsum([0.0, *speeds[:-1]])


def tell(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of this part."""
    *heights, landed = fall(parameters)
    time = DT * np.arange(len(heights))
    exact = fall_time(heights[0], parameters)
    speed = parameters.gravity_accel * exact
    error = abs(heights - closed_fall(time, parameters)).max()
    euler = summed(time, parameters)[-1] - heights[-1]
    yield (f'  from {heights[0]:g} m down to {landed:g} m: {exact:.4f} s, then at '
           f'{speed:.2f} m/s; landed at step {len(heights)}, {DT * len(heights):.3f} s')
    yield (f'  largest distance from the closed form: {1e3 * error:.3f} mm; summed by Euler: '
           f'{1e3 * euler:.1f} mm')
    yield f'  a stamp that is wrong by 1 ms is a height that is wrong by {speed:.1f} mm'
    _, gone = slide(parameters)
    time = DT * np.arange(1, len(gone) + 1)
    error = abs(gone - closed_slide(time, parameters)).max()
    rim = parameters.platform_radius
    clear = rim + parameters.brick_size[0] / 2.0
    yield (f'  slide at {degrees(parameters.tilt_angle):.1f}°: {rim:g} m (center at the rim) in '
           f'{slide_time(rim, parameters):.4f} s, {clear:g} m (brick clear) in '
           f'{slide_time(clear, parameters):.4f} s;')
    yield f'  clear at step {len(gone)}, {time[-1]:.3f} s, {gone[-1]:.3f} m'
    yield f'  largest distance from the closed form: {1e3 * error:.3f} mm'


def draw(parameters: Parameters, path: Path) -> None:
    """Draw a fall and a slide with their closed forms, and what a sum of steps would do."""
    heights = fall(parameters)
    bricks, gone = slide(parameters)
    with drawn(path, 7.6, 5.6) as figure:
        (height, side), (error, way) = figure.subplots(
            2, 2, height_ratios=(1.7, 1.0), width_ratios=(1.0, 1.15))

        time = DT * np.arange(len(heights))
        fine = np.linspace(0.0, time[-1], 201)
        height.plot(fine, closed_fall(fine, parameters), color=REFUSED, linewidth=1.8,
                    label='z₀ − g t² / 2')
        height.plot(time[:-1:15], heights[:-1:15], 'o', color=INK, markersize=4.0,
                    label='every 15th step')
        height.plot(time[-1], heights[-1], 's', color=CAUGHT, markersize=6.0,
                    label='lies on the platform')
        height.set(xlim=(0.0, None), ylim=(0.0, 1.05 * heights[0]),
                   ylabel='height of the brick / m', title='The fall')
        height.legend(loc='lower left')

        time, heights = time[:-1], heights[:-1]
        for values, color, label in (
                (summed(time, parameters), MISSED, 'summed up step by step'),
                (heights, CAUGHT, 'physics.World')):
            error.plot(time, 1e3 * (values - closed_fall(time, parameters)), color=color,
                       linewidth=2.0, label=label)
        error.set(xlim=height.get_xlim(), xlabel='time since the release / s',
                  ylabel='too high by / mm')
        error.legend(loc='upper left')

        draw_from_the_side(side, bricks, gone, parameters)
        time = DT * np.arange(1, len(gone) + 1)
        fine = np.linspace(0.0, time[-1], 201)
        way.plot(fine, closed_slide(fine, parameters), color=REFUSED, linewidth=1.8,
                 label='g sin(angle) t² / 2')
        way.plot(time[3::8], gone[3::8], 'o', color=INK, markersize=4.0, label='every 8th step')
        way.set(xlim=(0.0, None), ylim=(0.0, None), xlabel='time since the tilt / s',
                ylabel='down the slope / m')
        way.legend(loc='upper left')


def draw_from_the_side(axes: Axes, bricks: Sequence[Vector], gone: np.ndarray,
                       parameters: Parameters) -> None:
    """Draw the tilted platform, and the brick at the start, half way down and at the end."""
    angle = parameters.tilt_angle
    along, across = np.array((cos(angle), -sin(angle))), np.array((sin(angle), cos(angle)))
    hinge = np.array((0.0, parameters.platform_height - parameters.platform_thickness))

    def box(center: np.ndarray, half: float, lift: float) -> list[np.ndarray]:
        return [center + a * half * along + b * lift * across
                for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]

    lift = parameters.platform_thickness / 2.0
    axes.plot([0.0, 0.0], [hinge[1] - 0.45, hinge[1]], color=FAINT, linewidth=7.0, zorder=1)
    axes.add_patch(Polygon(box(hinge + lift * across, parameters.platform_radius, lift),
                           facecolor='#7fb2e5', edgecolor=CAUGHT, zorder=2))
    length, _, thick = parameters.brick_size
    for part in (0.0, 0.5, 1.0):
        step = int(np.argmax(gone >= part * gone[-1]))
        center = np.array(bricks[step])[[0, 2]]
        axes.add_patch(Polygon(box(center, length / 2.0, thick / 2.0), facecolor=REFUSED,
                               alpha=0.4 + 0.5 * part, edgecolor='white', zorder=3))
        x, z = center + 0.13 * across
        axes.text(x, z, f'{DT * (step + 1):.2f} s', zorder=4)
    axes.set(aspect='equal', xlim=(-0.5, 0.95), ylim=(hinge[1] - 0.6, hinge[1] + 0.5),
             xlabel='x / m', ylabel='height / m', title=f'The slide, at {degrees(angle):.0f}°')
