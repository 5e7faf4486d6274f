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
from typing import NamedTuple, TypeVar

from matplotlib.axes import Axes
from matplotlib.patches import Polygon
import numpy as np
from turtle_brick.core.geometry import from_pitch, Pose, Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import fall_time, resting_height
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import NANO
from turtle_brick.physics import Phase, STEP, World
from turtle_brick.tools.plots import arrow, CAUGHT, drawn, FAINT, INK, MISSED, REFUSED

DT = STEP * NANO
"""Time (s) of a step of the physics."""

Time = TypeVar('Time', float, np.ndarray)


class Moment(NamedTuple):
    """Where the brick is at a time (s)."""

    time: float
    brick: Vector


def fall(parameters: Parameters) -> list[Moment]:
    """Return where a brick is after each step of a fall onto a level platform."""
    world = World.from_parameters(parameters)
    world.platform = platform(parameters, 0.0, world.brick[:2])
    moments = [Moment(0.0, world.brick)]
    while world.phase is not Phase.RIDING:
        world.drop()
        moments.append(Moment(len(moments) * DT, world.brick))
    return moments


def slide(parameters: Parameters) -> list[Moment]:
    """
    Return where a brick is after each step of a slide off a platform that is tilted at once.

    The platform's axis is the world's z axis.
    """
    world = World.from_parameters(parameters)
    world.brick = (0.0, 0.0, resting_height(parameters) + DT ** 2)
    world.platform = platform(parameters, 0.0)
    while world.phase is not Phase.RIDING:
        world.drop()
    world.platform = platform(parameters, parameters.tilt_angle)
    moments: list[Moment] = []
    while world.phase is Phase.RIDING:
        world.step()
        moments.append(Moment((len(moments) + 1) * DT, world.brick))
    return moments


def platform(parameters: Parameters, angle: float,
             place: tuple[float, float] = (0.0, 0.0)) -> Platform:
    """Return a platform at an angle (rad), at a place in the world (m)."""
    hinge = parameters.platform_height - parameters.platform_thickness
    return Platform(Pose((*place, hinge), from_pitch(angle)))


def along_slope(brick: Vector, parameters: Parameters) -> float:
    """Return how far (m) a sliding brick has come along the platform."""
    return platform(parameters, parameters.tilt_angle).place_of(brick)[0]


def closed_fall(time: Time, parameters: Parameters) -> Time:
    """Return the height (m) of the brick a time (s) after its release: z0 - g t^2 / 2."""
    return parameters.brick_start[2] - 0.5 * parameters.gravity_accel * time ** 2


def closed_slide(time: Time, parameters: Parameters) -> Time:
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


def tell(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of this part."""
    *falling, landed = fall(parameters)
    exact = fall_time(falling[0].brick[2], parameters)
    speed = parameters.gravity_accel * exact
    error = max(abs(brick[2] - closed_fall(time, parameters)) for time, brick in falling)
    euler = summed(len(falling) - 1, parameters)[-1] - falling[-1].brick[2]
    yield (f'  from {falling[0].brick[2]:g} m down to {resting_height(parameters):g} m: '
           f'{exact:.4f} s, then at {speed:.2f} m/s; landed at step {len(falling)}, '
           f'{landed.time:.3f} s')
    yield (f'  largest distance from the closed form: {1e3 * error:.3f} mm; summed by Euler: '
           f'{1e3 * euler:.1f} mm')
    yield f'  a stamp that is wrong by 1 ms is a height that is wrong by {speed:.1f} mm'
    sliding = slide(parameters)
    gone = [along_slope(brick, parameters) for _, brick in sliding]
    error = max(abs(distance - closed_slide(time, parameters))
                for distance, (time, _) in zip(gone, sliding))
    rim = parameters.platform_radius
    clear = rim + parameters.brick_size[0] / 2.0
    yield (f'  slide at {degrees(parameters.tilt_angle):.1f}°: {rim:g} m (center at the rim) in '
           f'{slide_time(rim, parameters):.4f} s, {clear:g} m (brick clear) in '
           f'{slide_time(clear, parameters):.4f} s;')
    yield f'  clear at step {len(sliding)}, {sliding[-1].time:.3f} s, {gone[-1]:.3f} m'
    yield f'  largest distance from the closed form: {1e3 * error:.3f} mm'


DELAYS = (1.0, 2.0, 1.0, 7.0, 3.0, 1.0, 2.0, 10.0, 6.0, 2.0, 1.0)
"""Delays (ms) as messages have them, for the sketch."""


def sketch(parameters: Parameters, path: Path) -> None:
    """Draw the end of a fall by the stamps of its transforms, and by their arrival."""
    *_, landed = falling = fall(parameters)
    seen = falling[-len(DELAYS) - 1:-1]
    time = [1e3 * (moment.time - landed.time) for moment in seen]
    height = [moment.brick[2] for moment in seen]
    late = [one + delay for one, delay in zip(time, DELAYS)]
    with drawn(path, 7.6, 3.2) as figure:
        axes = figure.subplots()
        for one, arrived, z in zip(time, late, height):
            arrow(axes, (one, z), (arrived, z), color=FAINT, style='-')
        axes.plot(time, height, 'o-', color=CAUGHT, label='by its stamp: on the parabola')
        axes.plot(late, height, 'x', color=MISSED, markersize=7.0,
                  label='by its arrival: anywhere beside it')
        worst = max(range(len(seen)), key=DELAYS.__getitem__)
        there = late[worst], closed_fall(1e-3 * late[worst] + landed.time, parameters)
        arrow(axes, (there[0], height[worst]), there, color=REFUSED, style='<|-|>')
        axes.text(there[0] + 0.5, (there[1] + height[worst]) / 2.0, color=REFUSED, va='center',
                  s=f'{DELAYS[worst]:g} ms late: {1e3 * (height[worst] - there[1]):.0f} mm wrong')
        axes.set(xlim=(time[0] - 1.0, 9.0), xlabel='time since the landing / ms',
                 ylabel='height of the brick / m', title='One transform every 4 ms')
        axes.legend(loc='lower left')


def draw(parameters: Parameters, path: Path) -> None:
    """Draw a fall and a slide with their closed forms, and what a sum of steps would do."""
    *falling, landed = fall(parameters)
    sliding = slide(parameters)
    with drawn(path, 7.6, 5.6) as figure:
        (height, side), (error, way) = figure.subplots(
            2, 2, height_ratios=(1.7, 1.0), width_ratios=(1.0, 1.15))

        fine = np.linspace(0.0, landed.time, 201)
        height.plot(fine, closed_fall(fine, parameters), color=REFUSED, linewidth=1.8,
                    label='z₀ − g t² / 2')
        height.plot([moment.time for moment in falling[::15]],
                    [moment.brick[2] for moment in falling[::15]], 'o', color=INK, markersize=4.0,
                    label='every 15th step')
        height.plot(landed.time, landed.brick[2], 's', color=CAUGHT, markersize=6.0,
                    label='lies on the platform')
        height.set(xlim=(0.0, None), ylim=(0.0, 1.05 * falling[0].brick[2]),
                   ylabel='height of the brick / m', title='The fall')
        height.legend(loc='lower left')

        time = np.array([moment.time for moment in falling])
        for heights, color, label in (
                (summed(len(falling) - 1, parameters), MISSED, 'summed up step by step'),
                ([moment.brick[2] for moment in falling], CAUGHT, 'physics.World')):
            error.plot(time, 1e3 * (np.array(heights) - closed_fall(time, parameters)),
                       color=color, linewidth=2.0, label=label)
        error.set(xlim=height.get_xlim(), xlabel='time since the release / s',
                  ylabel='too high by / mm')
        error.legend(loc='upper left')

        draw_from_the_side(side, sliding, parameters)
        fine = np.linspace(0.0, sliding[-1].time, 201)
        way.plot(fine, closed_slide(fine, parameters), color=REFUSED, linewidth=1.8,
                 label='g sin(angle) t² / 2')
        way.plot([moment.time for moment in sliding[3::8]],
                 [along_slope(moment.brick, parameters) for moment in sliding[3::8]], 'o',
                 color=INK, markersize=4.0, label='every 8th step')
        way.set(xlim=(0.0, None), ylim=(0.0, None), xlabel='time since the tilt / s',
                ylabel='down the slope / m')
        way.legend(loc='upper left')


def draw_from_the_side(axes: Axes, sliding: Sequence[Moment], parameters: Parameters) -> None:
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
    end = along_slope(sliding[-1].brick, parameters)
    for part in (0.0, 0.5, 1.0):
        time, brick = next(moment for moment in sliding
                           if along_slope(moment.brick, parameters) >= part * end)
        center = np.array((brick[0], brick[2]))
        length, _, thick = parameters.brick_size
        axes.add_patch(Polygon(box(center, length / 2.0, thick / 2.0), facecolor=REFUSED,
                               alpha=0.4 + 0.5 * part, edgecolor='white', zorder=3))
        x, z = center + 0.13 * across
        axes.text(x, z, f'{time:.2f} s', zorder=4)
    axes.set(aspect='equal', xlim=(-0.5, 0.95), ylim=(hinge[1] - 0.6, hinge[1] + 0.5),
             xlabel='x / m', ylabel='height / m', title=f'The slide, at {degrees(angle):.0f}°')
