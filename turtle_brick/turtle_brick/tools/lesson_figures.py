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

"""The figures of the lesson: one function for each part, of that name, draws it as a PNG."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, degrees, pi, sin
from pathlib import Path

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from turtle_brick.core.geometry import Pose2D
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import guaranteed_distance, GUARANTEED_LATENCY, resting_height
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.tools import lesson_laws as laws
from turtle_brick.tools.plots import (CAUGHT, FAINT, farthest, INK, MISSED, REFUSED, ROBOT, save,
                                      STYLE)

X_AXIS, Y_AXIS = '#d62728', '#2ca02c'
"""The colors that rviz2 gives to the axes x and y of a frame."""


def frames(parameters: Parameters, path: Path) -> None:
    """Draw the path of the robot in the world, and what its odometry makes of it."""
    way, stops = laws.frames(parameters)
    origin = stops[0].world
    to_odom = origin.inverse()
    odom_way = [to_odom.compose(pose) for pose in way]
    with rc_context(STYLE):
        figure = Figure(figsize=(7.6, 4.1), layout='constrained')
        in_world, in_odom = figure.subplots(1, 2)
        for axes, line, title, places in (
                (in_world, way, 'Where it is in world', [stop.world for stop in stops]),
                (in_odom, odom_way, '... and in odom', [stop.odom for stop in stops])):
            axes.set_aspect('equal')
            axes.set_title(title)
            axes.plot([pose.x for pose in line], [pose.y for pose in line], color=FAINT,
                      linewidth=2.0, zorder=2)
            for name, place in zip('SABC', places):
                axes.add_patch(Circle((place.x, place.y), 0.42, facecolor='#e8f3ea',
                                      edgecolor=ROBOT, zorder=3))
                _frame(axes, place, 0.9)
                axes.annotate(name, (place.x, place.y), xytext=(-17, 3), fontweight='bold',
                              textcoords='offset points')
        in_world.add_patch(Rectangle((0.0, 0.0), ARENA_SIZE, ARENA_SIZE, fill=False,
                                     edgecolor=INK, linewidth=2.0))
        _frame(in_world, Pose2D(0.0, 0.0, 0.0), 1.5, 'world')
        _frame(in_world, origin, 2.0, 'odom')
        in_world.set(xlim=(-0.6, 11.7), ylim=(-1.0, 11.7), xlabel='x in world / m',
                     ylabel='y in world / m')
        corners = [to_odom.compose(Pose2D(x, y, 0.0)) for x, y in (
            (0.0, 0.0), (ARENA_SIZE, 0.0), (ARENA_SIZE, ARENA_SIZE), (0.0, ARENA_SIZE))]
        in_odom.add_patch(Polygon([(pose.x, pose.y) for pose in corners], fill=False,
                                  edgecolor=INK, linewidth=2.0))
        _frame(in_odom, Pose2D(0.0, 0.0, 0.0), 2.0, 'odom')
        _frame(in_odom, corners[0], 1.5, 'world')
        in_odom.set(xlim=(-5.0, 12.6), ylim=(-7.6, 10.6), xlabel='x in odom / m',
                    ylabel='y in odom / m')
        save(figure, path)


def _frame(axes: Axes, pose: Pose2D, size: float, name: str = '') -> None:
    """Draw the axes of a frame as rviz2 does, red for x and green for y."""
    for turn, color in ((0.0, X_AXIS), (pi / 2.0, Y_AXIS)):
        dx, dy = size * cos(pose.yaw + turn), size * sin(pose.yaw + turn)
        axes.annotate('', (pose.x + dx, pose.y + dy), (pose.x, pose.y), zorder=5, arrowprops={
            'arrowstyle': '-|>', 'color': color, 'linewidth': 1.8, 'shrinkA': 0.0, 'shrinkB': 0.0})
    if name:
        axes.annotate(name, (pose.x, pose.y), textcoords='offset points',
                      xytext=(0 if pose.yaw >= 0.0 else -34, -15),
                      fontweight='bold')


def rolling(parameters: Parameters, path: Path) -> None:
    """Draw how the wheel rolls, and the three lengths that one might take for what it rolled."""
    rolls = laws.rolling(parameters)
    radius = parameters.wheel_radius
    with rc_context(STYLE):
        figure = Figure(figsize=(7.6, 5.2), layout='constrained')
        wheel, lengths = figure.subplots(2, 1, height_ratios=(0.62, 2.0))
        driven = [roll.rolled for roll in rolls if roll.time <= 1.0]
        wheel.set_aspect('equal')
        wheel.grid(False)
        wheel.axhline(0.0, color=INK, linewidth=1.4)
        fine = [driven[-1] * step / 600.0 for step in range(601)]
        wheel.plot(*_rim(fine, radius), color=REFUSED, linewidth=1.2)
        wheel.plot(*_rim(driven, radius), 'o', color=REFUSED, markersize=3.0)
        for way in driven[::10]:
            wheel.add_patch(Circle((way, radius), radius, fill=False, edgecolor=FAINT))
            x, z = _rim([way], radius)
            wheel.plot([way, x[0]], [radius, z[0]], color=INK, linewidth=1.2)
        wheel.set(xlim=(-0.25, driven[-1] + 0.25), ylim=(-0.05, 2.0 * radius + 0.06),
                  yticks=[0.0, round(2.0 * radius, 3)], xlabel='distance / m', ylabel='height / m')
        wheel.set_title('A point of the rim, and where each tick of turtlesim finds it')

        time = [roll.time for roll in rolls]
        for values, color, label, style in (
                ([roll.seen for roll in rolls], MISSED, 'distance between poses, added up', '-'),
                ([roll.commanded for roll in rolls], '#d9822b', 'commanded speed, added up', '-'),
                ([roll.rolled for roll in rolls], CAUGHT,
                 "the wheel's angle times its radius", '-')):
            lengths.plot(time, values, style, color=color, linewidth=2.2, label=label)
        top = 1.22 * rolls[-1].seen
        for begin, end, color, words in (
                (0.0, 1.0, '#eef2f6', 'it drives'),
                (1.0, 2.5, 'white', 'it rests, and is teleported'),
                (2.5, 3.5, '#eef2f6', 'it drives'), (3.5, 4.0, '#ffe3c4', 'a wall\nholds it')):
            lengths.axvspan(begin, end, color=color, linewidth=0.0, zorder=0)
            lengths.text((begin + end) / 2.0, 0.98 * top, words, ha='center', va='top')
        lengths.set(xlim=(0.0, time[-1]), ylim=(0.0, top), xlabel='time / s', ylabel='length / m')
        lengths.set_title('Only one of three lengths is what the wheel has rolled')
        lengths.legend(loc='center left', bbox_to_anchor=(0.0, 0.66))
        save(figure, path)


def _rim(ways: Sequence[float], radius: float) -> tuple[list[float], list[float]]:
    """Return where the rim's first lowest point is after each distance (m): x and height."""
    angles = [way / radius for way in ways]
    return ([way - radius * sin(angle) for way, angle in zip(ways, angles)],
            [radius - radius * cos(angle) for angle in angles])


def falling(parameters: Parameters, path: Path) -> None:
    """Draw a fall and a slide with their closed forms, and what a sum of steps would do."""
    fall, slide = laws.falling(parameters), laws.sliding(parameters)
    with rc_context(STYLE):
        figure = Figure(figsize=(7.6, 5.6), layout='constrained')
        grid = figure.add_gridspec(2, 2, height_ratios=(1.7, 1.0), width_ratios=(1.0, 1.15))
        height, side = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
        error, way = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])

        fine = [fall[-1].time * step / 200.0 for step in range(201)]
        height.plot(fine, [laws.closed_fall(time, parameters) for time in fine], color=REFUSED,
                    linewidth=1.8, label='z₀ − g t² / 2')
        height.plot([place.time for place in fall[::15]], [place.brick[2] for place in fall[::15]],
                    'o', color=INK, markersize=4.0, label='every 15th step')
        height.plot(fall[-1].time, fall[-1].brick[2], 's', color=CAUGHT, markersize=6.0,
                    label='lies on the platform')
        height.set(xlim=(0.0, None), ylim=(0.0, 1.05 * fall[0].brick[2]),
                   ylabel='height of the brick / m')
        height.legend(loc='lower left')
        height.set_title('The fall')

        fallen = fall[:-1]
        euler = laws.summed(len(fallen) - 1, parameters)
        time = [place.time for place in fallen]
        closed = [laws.closed_fall(moment, parameters) for moment in time]
        error.plot(time, [1e3 * (z - exact) for z, exact in zip(euler, closed)], color=MISSED,
                   linewidth=1.8, label='summed up step by step')
        error.plot(time, [1e3 * (place.brick[2] - exact) for place, exact in zip(fallen, closed)],
                   color=CAUGHT, linewidth=2.2, label='physics.World')
        error.set(xlim=height.get_xlim(), xlabel='time since the release / s',
                  ylabel='too high by / mm')
        error.legend(loc='upper left')

        _side_view(side, slide, parameters)
        fine = [slide[-1].time * step / 200.0 for step in range(201)]
        way.plot(fine, [laws.closed_slide(moment, parameters) for moment in fine],
                 color=REFUSED, linewidth=1.8, label='g sin(angle) t² / 2')
        dots = slide[3::8]
        way.plot([place.time for place in dots],
                 [laws.along_slope(place, parameters) for place in dots], 'o', color=INK,
                 markersize=4.0, label='every 8th step')
        way.set(xlim=(0.0, None), ylim=(0.0, None), xlabel='time since the tilt / s',
                ylabel='down the slope / m')
        way.legend(loc='upper left')
        save(figure, path)


def _side_view(axes: Axes, slide: Sequence[laws.Place], parameters: Parameters) -> None:
    """Draw the tilted platform, and the brick at the start, half way down and at the end."""
    angle = parameters.tilt_angle
    along, across = (cos(angle), -sin(angle)), (sin(angle), cos(angle))
    hinge = parameters.platform_height - parameters.platform_thickness
    length, _, thick = parameters.brick_size

    def box(x: float, z: float, half: float, lift: float) -> list[tuple[float, float]]:
        return [(x + a * half * along[0] + b * lift * across[0],
                 z + a * half * along[1] + b * lift * across[1])
                for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]

    lift = parameters.platform_thickness / 2.0
    axes.plot([0.0, 0.0], [hinge - 0.45, hinge], color=FAINT, linewidth=7.0, zorder=1)
    axes.add_patch(Polygon(
        box(lift * across[0], hinge + lift * across[1], parameters.platform_radius, lift),
        facecolor='#7fb2e5', edgecolor=CAUGHT, zorder=2))
    gone = laws.along_slope(slide[-1], parameters)
    for part in (0.0, 0.5, 1.0):
        place = next(place for place in slide
                     if laws.along_slope(place, parameters) >= part * gone)
        x, _, z = place.brick
        axes.add_patch(Polygon(box(x, z, length / 2.0, thick / 2.0), facecolor=REFUSED,
                               alpha=0.4 + 0.5 * part, edgecolor='white', zorder=3))
        axes.text(x + 0.13 * across[0], z + 0.13 * across[1], f'{place.time:.2f} s', zorder=4)
    axes.set_aspect('equal')
    axes.set(xlim=(-0.5, 0.95), ylim=(hinge - 0.6, hinge + 0.5), xlabel='x / m',
             ylabel='height / m')
    axes.set_title(f'The slide, at {degrees(angle):.0f}°')


def queue(parameters: Parameters, path: Path) -> None:
    """Draw what becomes of commands, and naive controllers beside ours."""
    styles = dict(zip(laws.controllers(parameters), (
        (MISSED, '-'), ('#d9822b', '-'), ('#8a63b8', '-'), (CAUGHT, '-'))))
    ways = {name: laws.approach(driver, parameters)
            for name, driver in laws.controllers(parameters).items()}
    with rc_context(STYLE):
        figure = Figure(figsize=(7.6, 6.4), layout='constrained')
        grid = figure.add_gridspec(2, 2, height_ratios=(0.8, 1.5), width_ratios=(1.0, 1.6))
        sawtooth = figure.add_subplot(grid[0, :])
        whole, near = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])

        sent = laws.commands(0.0001)
        for taken, mark, color, words in (
                (True, 'o', CAUGHT, 'taken by a tick'),
                (False, 'x', MISSED, 'pushed out: the next one is taken')):
            those = [one for one in sent if one.taken is taken]
            sawtooth.plot([1e3 * one.published for one in those],
                          [1e3 * one.latency for one in those], mark, color=color, markersize=5.0,
                          label=words)
        sawtooth.set(xlim=(-5.0, 495.0), ylim=(0.0, 90.0), xlabel='command published at / ms',
                     ylabel='shows in a pose\nafter / ms')
        sawtooth.set_title('What becomes of commands at 100 Hz in turtlesim')
        sawtooth.legend(loc='lower left', ncols=2)

        for name, seen in ways.items():
            color, style = styles[name]
            time = [moment for moment, _ in seen]
            whole.plot(time, [laws.WAY + beyond for _, beyond in seen], style, color=color,
                       linewidth=1.6)
            near.plot(time, [100.0 * beyond for _, beyond in seen], style, color=color,
                      linewidth=1.8, label=name)
        for axes, goal in ((whole, laws.WAY), (near, 0.0)):
            axes.axhline(goal, color=INK, linewidth=0.9, linestyle='--', zorder=1)
            axes.set_xlabel('time since the order / s')
        last = laws.WAY / parameters.max_velocity
        whole.set(xlim=(0.0, last + 1.5), ylim=(0.0, 1.12 * laws.WAY), ylabel='distance / m')
        near.set(xlim=(last - 0.1, last + 1.0), ylim=(-30.0, 20.0), ylabel='beyond the goal / cm')
        whole.set_title(f'{laws.WAY:g} m to drive')
        near.set_title('... and the end of it')
        near.legend(loc='lower right')
        save(figure, path)


def reach(parameters: Parameters, path: Path) -> None:
    """Draw from where a brick can be caught, and how the time goes by before the robot moves."""
    drops = laws.reaching(parameters)
    with rc_context(STYLE):
        figure = Figure(figsize=(7.6, 6.6), layout='constrained')
        plane, chain = figure.subplots(2, 1, height_ratios=(2.6, 1.0))
        for outcome, color, mark in (('caught', CAUGHT, 'o'), ('refused', '#e8b59f', 'o'),
                                     ('missed', MISSED, 'X')):
            those = [drop for drop in drops if drop.outcome == outcome]
            plane.plot([drop.distance for drop in those], [drop.brick_z for drop in those], mark,
                       color=color, markersize=4.5, label=f'{len(those)} {outcome}')
        low = resting_height(parameters)
        heights = [low + (10.4 - low) * (step / 300.0) ** 2 for step in range(301)]
        plane.plot([guaranteed_distance(height, parameters) for height in heights], heights,
                   color=INK, linewidth=1.8,
                   label=f'promised: v (t − {GUARANTEED_LATENCY:g} s) + r')
        plane.plot([farthest(height, parameters) for height in heights], heights, color=INK,
                   linewidth=1.4, linestyle=(0, (2, 2)), label='no latency at all: v t + r')
        plane.axhline(low, color=FAINT, linewidth=1.2)
        plane.text(5.5, low - 0.41, 'below the platform', ha='right', va='center',
                   bbox={'facecolor': 'white', 'edgecolor': 'none', 'pad': 1.5})
        plane.set(xlim=(-0.1, 5.6), ylim=(0.6, 10.4), ylabel='released at a height of / m',
                  xlabel='distance from the robot at rest / m')
        plane.set_title(f'Which bricks a robot of {parameters.max_velocity:g} m/s catches')
        plane.legend(loc='upper center', bbox_to_anchor=(0.5, -0.13), ncols=5, columnspacing=1.2,
                     handletextpad=0.4)

        begin = 0.0
        colors = (REFUSED, FAINT, ROBOT, CAUGHT, ROBOT, '#c9a227')
        for row, ((what, time), color) in enumerate(zip(laws.STEPS_OF_LATENCY, colors)):
            chain.barh(row, 1e3 * time, left=1e3 * begin, height=0.62, color=color)
            words = f'{what}, {1e3 * time:.0f} ms'
            if time > 0.05:
                chain.text(1e3 * begin + 1.0, row, words, va='center', color='white')
            elif begin < 0.05:
                chain.text(1e3 * (begin + time) + 1.0, row, words, va='center')
            else:
                chain.text(1e3 * begin - 1.0, row, words, va='center', ha='right')
            begin += time
        chain.set(yticks=[], ylim=(len(colors) - 0.5, -0.6), xlim=(0.0, 1e3 * GUARANTEED_LATENCY),
                  xlabel='time since the release / ms')
        chain.grid(axis='y', visible=False)
        chain.set_title("From the release to the robot's first motion, at worst")
        save(figure, path)
