# SPDX-License-Identifier: Apache-2.0

"""Lesson 2: rolling without slipping, and the distance rolled by the wheel."""

from collections.abc import Iterator
from math import degrees, hypot, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TICK, Turtle
from turtle_brick_tools.plots import INK, new_figure


class RollSample(NamedTuple):
    """Distance (m) rolled by the wheel at a given time (s), computed in three ways."""

    time: float
    commanded: float  # Integral of the commanded speed.
    pose_distance: float  # Sum of the distances between consecutive poses.
    rolled: float  # Wheel angle times wheel radius.


TELEPORT = 2.0
"""Time (s) at which the turtle is teleported."""


def roll(parameters: Parameters) -> list[RollSample]:
    """Simulate a drive, a teleport, and a drive into a wall."""
    turtle = Turtle(1.0, ARENA_CENTER, holonomic=True)
    odometer = Odometer(parameters.wheel_radius)
    speed = parameters.max_velocity
    rolls = [RollSample(0.0, 0.0, 0.0, 0.0)]
    pose = turtle.pose
    odometer.observe(0.0, pose, 0.0)
    for tick in range(1, round(4.5 / TICK)):
        now = tick * TICK
        if rolls[-1].time < TELEPORT <= now:
            turtle = Turtle(ARENA_SIZE - speed, ARENA_CENTER, holonomic=True, now=now)
        drives = now <= 1.0 or 2.5 < now <= 4.0
        turtle.command(speed if drives else 0.0, 0.0, 0.0)
        last, pose = pose, turtle.tick(now)
        odometer.observe(now, pose, 0.0)
        rolls.append(RollSample(
            now, rolls[-1].commanded + pose.linear_velocity * TICK,
            rolls[-1].pose_distance + hypot(pose.x - last.x, pose.y - last.y),
            odometer.wheel_angle * odometer.wheel_radius))
    return rolls


def report(parameters: Parameters) -> Iterator[str]:
    """Yield the results for this lesson, one line at a time."""
    rolls = roll(parameters)
    radius, speed = parameters.wheel_radius, parameters.max_velocity
    yield f'  wheel_radius {radius:g} m: one turn is {2.0 * pi * radius:.3f} m'
    yield (f'  at {speed:g} m/s: {speed / radius:.2f} rad/s, {speed / (2.0 * pi * radius):.2f} '
           f'turns per second, {degrees(speed / radius * TICK):.1f}° per turtlesim tick')
    yield '                                     commanded   between poses   wheel'
    for label, time in (('after 1 s of driving', 1.2), ('after the teleport', 2.3),
                        ('after 1.5 s toward a wall 1 s away', 4.4)):
        then = next(state for state in rolls if state.time >= time)
        yield (f'  {label:35}{then.commanded:9.3f} m{then.pose_distance:13.3f} m'
               f'{then.rolled:9.3f} m = {then.rolled / radius:.2f} rad')


def draw(parameters: Parameters, path: Path) -> None:
    """Plot the distance rolled by the wheel over time, computed in three ways."""
    time, commanded, pose_distance, rolled = np.array(roll(parameters)).T
    with new_figure(path, 7.6, 3.8) as figure:
        lengths = figure.subplots()
        # The line widths differ so that coinciding curves are visible.
        for values, width, color, label in (
                (pose_distance, 8.0, '#f0a6cb', 'sum of the distances between poses'),
                (commanded, 4.5, '#d9822b', 'integral of the commanded speed'),
                (rolled, 1.8, INK, 'wheel angle times wheel radius')):
            lengths.plot(time, values, color=color, linewidth=width, label=label)
        top = 1.22 * pose_distance[-1]
        for begin, end, color, label in (
                (0.0, 1.0, '#eef2f6', 'driving'),
                (1.0, 2.5, 'white', 'at rest, with a teleport'),
                (2.5, 3.5, '#eef2f6', 'driving'), (3.5, 4.0, '#ffe3c4', 'against\na wall')):
            lengths.axvspan(begin, end, color=color, linewidth=0.0, zorder=0)
            lengths.text((begin + end) / 2.0, 0.98 * top, label, ha='center', va='top')
        lengths.set(xlim=(0.0, time[-1]), ylim=(0.0, top), xlabel='time / s',
                    ylabel='distance / m',
                    title='Three candidates for the distance rolled by the wheel')
        lengths.legend(loc='center left', bbox_to_anchor=(0.0, 0.66))
