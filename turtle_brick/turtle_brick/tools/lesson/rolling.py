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

"""Lesson 2: rolling without slipping, and which length the wheel has rolled."""

from collections.abc import Iterator
from math import degrees, hypot, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TICK, Turtle
from turtle_brick.tools.plots import CAUGHT, drawn, MISSED


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
"""When (s) the turtle is teleported."""


def roll(parameters: Parameters) -> list[Roll]:
    """Drive 1 s, rest, be teleported, and drive 1.5 s against a wall that is 1 s away."""
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


def tell(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of this part."""
    rolls = roll(parameters)
    radius, speed = parameters.wheel_radius, parameters.max_velocity
    yield f'  wheel_radius {radius:g} m: one turn is {2.0 * pi * radius:.3f} m'
    yield (f'  at {speed:g} m/s: {speed / radius:.2f} rad/s, {speed / (2.0 * pi * radius):.2f} '
           f'turns per second, {degrees(speed / radius * TICK):.1f}° per tick of turtlesim')
    yield '                                     commanded   between poses   wheel'
    for what, time in (('after 1 s of driving', 1.2), ('after the teleport', 2.3),
                       ('after 1.5 s towards a wall 1 s away', 4.4)):
        then = next(one for one in rolls if one.time >= time)
        yield (f'  {what:35}{then.commanded:9.3f} m{then.seen:13.3f} m'
               f'{then.rolled:9.3f} m = {then.rolled / radius:.2f} rad')


def draw(parameters: Parameters, path: Path) -> None:
    """Draw the three lengths that one might take for what the wheel has rolled."""
    time, commanded, seen, rolled = np.array(roll(parameters)).T
    with drawn(path, 7.6, 3.8) as figure:
        lengths = figure.subplots()
        for values, color, label in (
                (seen, MISSED, 'distance between poses, added up'),
                (commanded, '#d9822b', 'commanded speed, added up'),
                (rolled, CAUGHT, "the wheel's angle times its radius")):
            lengths.plot(time, values, color=color, linewidth=2.2, label=label)
        top = 1.22 * seen[-1]
        for begin, end, color, words in (
                (0.0, 1.0, '#eef2f6', 'it drives'),
                (1.0, 2.5, 'white', 'it rests, and is teleported'),
                (2.5, 3.5, '#eef2f6', 'it drives'), (3.5, 4.0, '#ffe3c4', 'a wall\nholds it')):
            lengths.axvspan(begin, end, color=color, linewidth=0.0, zorder=0)
            lengths.text((begin + end) / 2.0, 0.98 * top, words, ha='center', va='top')
        lengths.set(xlim=(0.0, time[-1]), ylim=(0.0, top), xlabel='time / s', ylabel='length / m',
                    title='Only one of three lengths is what the wheel has rolled')
        lengths.legend(loc='center left', bbox_to_anchor=(0.0, 0.66))
