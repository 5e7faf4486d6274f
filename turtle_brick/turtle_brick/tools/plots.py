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
Figures of what was measured: the map of the arena, margins, one drop in detail.

Importing this module imports matplotlib, so only code that draws does it. It needs no display and
leaves matplotlib's global state alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from math import degrees, hypot
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from matplotlib import rc_context
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PatchCollection
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from turtle_brick.core.catch_logic import CENTER, State
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import (fall_time, guaranteed_distance, GUARANTEED_LATENCY,
                                            resting_height)
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.tools.measuring import percentile

if TYPE_CHECKING:
    from turtle_brick.tools.sweeping import Drop, Trace

INK = '#1f2933'
FAINT = '#9aa5b1'
CAUGHT = '#0b6e99'
REFUSED = '#c2542d'
MISSED = '#d6006c'
PROMISE = '#111111'
ROBOT = '#2f855a'

STYLE = {
    'font.family': 'DejaVu Sans',
    'font.size': 9.5,
    'axes.titlesize': 11.5,
    'axes.titleweight': 'bold',
    'axes.titlelocation': 'left',
    'axes.edgecolor': FAINT,
    'axes.labelcolor': INK,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'axes.grid': True,
    'axes.axisbelow': True,
    'grid.color': '#e4e7eb',
    'grid.linewidth': 0.7,
    'text.color': INK,
    'xtick.color': INK,
    'ytick.color': INK,
    'legend.frameon': False,
    'legend.fontsize': 8.5,
    'figure.dpi': 110,
    'savefig.facecolor': 'white',
}

MARGIN_COLORS = LinearSegmentedColormap.from_list('margin', [
    (0.0, '#5c1f1a'), (0.25, '#b5452f'), (0.5, '#f7b36b'),
    (0.5, '#a5dcc4'), (0.75, '#3a8fb7'), (1.0, '#183a6b')])
"""Refused and caught, with a step between the two."""

FINE_DASHES = (0, (2, 2))

PHASE_COLORS = {
    Phase.HOVERING: '#eef2f6',
    Phase.FALLING: '#ffe3c4',
    Phase.RIDING: '#d5ecd8',
    Phase.FLOATING: '#d9e6f8',
    Phase.GROUNDED: '#e6ddd8',
}

STATE_COLORS = {
    State.WAITING: '#cbd2d9',
    State.APPROACHING: '#f0a04b',
    State.CARRYING: '#4caf6e',
    State.TILTING: '#b565c9',
    State.LEVELING: '#5b8def',
}

STATE_WORDS = {
    State.WAITING: 'waiting',
    State.APPROACHING: 'approaching',
    State.CARRYING: 'carrying',
    State.TILTING: 'tilting',
    State.LEVELING: 'leveling',
}

Value = TypeVar('Value')


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a small PNG; a half-written file is never seen."""
    unfinished = path.with_name(f'.{path.name}.part')
    try:
        figure.savefig(unfinished, format='png', pil_kwargs={'optimize': True})
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def farthest(height: float, parameters: Parameters) -> float:
    """Return the distance (m) that a robot without any latency could cover during a fall."""
    return (parameters.max_velocity * fall_time(height, parameters)
            + parameters.platform_radius)


def reachability_map(drops: Sequence[Drop], parameters: Parameters, cell: float | None,
                     path: Path) -> None:
    """
    Draw the arena from above: what was caught, refused and missed, and the boundaries in theory.

    :param drops: The results, each from the robot at rest in the center.
    :param parameters: The physical numbers.
    :param cell: Side (m) of the square of the arena that each drop stands for; None for points.
    :param path: The PNG to write.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(8.2, 7.6), layout='constrained')
        axes = figure.subplots()
        axes.set_aspect('equal')
        axes.set_xlim(-0.2, ARENA_SIZE + 0.2)
        axes.set_ylim(-0.2, ARENA_SIZE + 0.2)
        axes.grid(False)
        for side in axes.spines.values():
            side.set_visible(False)
        margins = [drop.margin for drop in drops if drop.margin is not None]
        least = min(min(margins, default=0.0), -0.1)
        norm = TwoSlopeNorm(0.0, least, max(max(margins, default=0.0), 0.1))
        walls = Rectangle((0.0, 0.0), ARENA_SIZE, ARENA_SIZE, fill=False, edgecolor=INK,
                          linewidth=2.5, zorder=5)
        axes.add_patch(walls)
        count = {}
        for outcome in ('caught', 'refused', 'missed'):
            those = [drop for drop in drops if drop.outcome == outcome]
            count[outcome] = len(those)
            x, y = [drop.brick_x for drop in those], [drop.brick_y for drop in those]
            margin = [least if drop.margin is None else drop.margin for drop in those]
            if outcome == 'missed':
                axes.scatter(x, y, s=50.0, color=MISSED, marker='X', linewidths=0.0, zorder=4)
            elif cell is None:
                # So large (in square points) that the drops together could cover the arena.
                size = min(max(430.0 ** 2 / len(drops), 1.0), 60.0)
                axes.scatter(x, y, s=size, c=margin, cmap=MARGIN_COLORS, norm=norm, zorder=2,
                             linewidths=0.0).set_clip_path(walls)
            else:
                tiles = PatchCollection(
                    [Rectangle((a - cell / 2.0, b - cell / 2.0), cell, cell)
                     for a, b in zip(x, y)],
                    cmap=MARGIN_COLORS, norm=norm, linewidths=0.0, antialiased=False, zorder=2)
                tiles.set_array(margin)
                axes.add_collection(tiles)
        heights = _extremes(drops)
        for height in heights:
            for radius, style in ((guaranteed_distance(height, parameters), '-'),
                                  (farthest(height, parameters), FINE_DASHES)):
                if radius > 0.0:
                    axes.add_patch(Circle(CENTER, radius, fill=False, edgecolor=PROMISE,
                                          linewidth=1.5, linestyle=style, zorder=4.5))
        axes.add_patch(Circle(CENTER, parameters.platform_radius, facecolor='white',
                              edgecolor=INK, linewidth=1.2, zorder=6))
        axes.text(*CENTER, 'robot', ha='center', va='center', fontsize=8, zorder=7)
        axes.set_xlabel('x in the world / m')
        axes.set_ylabel('y in the world / m')
        axes.set_title(f'Where a robot of {parameters.max_velocity:g} m/s catches a brick that '
                       f'falls from {_in_words(heights)}')
        bar = figure.colorbar(ScalarMappable(norm, MARGIN_COLORS), ax=axes, shrink=0.85,
                              pad=0.01, aspect=28)
        bar.outline.set_visible(False)  # type: ignore[operator]
        bar.ax.set_title('s', fontsize=9.5, fontweight='normal', loc='center')
        for place, words in ((0.25, 'refused: too late by'), (0.75, 'caught: to spare')):
            bar.ax.annotate(words, (4.8, place), xycoords='axes fraction', rotation=90,
                            ha='center', va='center')
        figure.legend(
            [Line2D([], [], color=PROMISE, linewidth=1.5),
             Line2D([], [], color=PROMISE, linewidth=1.5, linestyle=FINE_DASHES)],
            [f'within this a catch is promised: {parameters.max_velocity:g} m/s x (fall - '
             f'{GUARANTEED_LATENCY:g} s) + radius of the platform',
             'beyond this no robot is in time, not even without any latency'
             + (' (both for the lowest and the highest)' if len(heights) > 1 else '')],
            loc='outside lower center', alignment='left',
            title=f'{len(drops):,} drops: {count["caught"]:,} caught, '
                  f'{count["refused"]:,} refused, {count["missed"]:,} missed')
        save(figure, path)


def _extremes(drops: Sequence[Drop]) -> list[float]:
    """Return the lowest and the highest release (m) of some drops; one if they are the same."""
    heights = [drop.brick_z for drop in drops]
    return sorted({min(heights), max(heights)})


def _in_words(heights: Sequence[float]) -> str:
    """Return one or two heights (m) in words."""
    return ' to '.join(f'{height:.3g}' for height in heights) + ' m'


def margins(drops: Sequence[Drop], parameters: Parameters, path: Path) -> None:
    """
    Draw the margins against the distance, as estimated and as measured.

    :param drops: The results, each from the robot at rest in the center.
    :param parameters: The physical numbers.
    :param path: The PNG to write.
    """
    heights = _extremes(drops)
    single = len(heights) == 1
    promise = max(guaranteed_distance(heights[0], parameters), 0.0) if single else 0.0

    def place(drop: Drop) -> float:
        if single:
            return drop.distance
        return drop.distance - guaranteed_distance(drop.brick_z, parameters)

    groups = [(f'{outcome}: estimated when the fall was recognized', color,
               [(place(drop), drop.margin) for drop in drops
                if drop.outcome == outcome and drop.margin is not None])
              for outcome, color in (
                  ('caught', CAUGHT), ('refused', REFUSED), ('missed', MISSED))]
    groups.append(('caught: measured, how long the platform had been there', ROBOT, [
        (place(drop), drop.spare) for drop in drops
        if drop.spare is not None and drop.distance > parameters.platform_radius]))
    with rc_context(STYLE):
        figure = Figure(figsize=(9.4, 5.2), layout='constrained')
        whole, near = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        for axes, size in ((whole, 1.5), (near, 4.0)):
            for label, color, points in groups:
                if points:
                    axes.plot(*zip(*points), '.', color=color, markersize=size, label=label)
            axes.axhline(0.0, color=INK, linewidth=0.9)
            axes.axvline(promise, color=PROMISE, linewidth=1.4)
            axes.set_xlabel('distance robot - brick on the ground / m' if single else
                            'distance beyond the promised one / m')
        near.set_xlim(promise - 0.25, promise + 0.25)
        reach = 0.25 / parameters.max_velocity
        near.set_ylim(-1.1 * reach, 2.1 * reach)
        near.annotate('a catch is promised', (promise, 0.03), xytext=(-5, 0),
                      xycoords=('data', 'axes fraction'), textcoords='offset points',
                      ha='right', va='bottom', fontsize=8.5)
        whole.set_ylabel('time to spare / s')
        whole.set_title(f'Time to spare for a brick from {_in_words(heights)}')
        near.set_title('... at the edge of the promise')
        figure.legend(*whole.get_legend_handles_labels(), loc='outside lower center',
                      ncols=2 if len(groups) > 3 else 1, markerscale=8.0)
        save(figure, path)


def one_drop(trace: Trace, drop: Drop, parameters: Parameters, path: Path) -> None:
    """
    Draw one drop over time.

    :param trace: The record of the drop.
    :param drop: Its result.
    :param parameters: The physical numbers.
    :param path: The PNG to write.
    """
    time = trace.time
    legible = 0.06 * (time[-1] - time[0])
    with rc_context(STYLE):
        figure = Figure(figsize=(8.6, 9.4), layout='constrained')
        strip, height, way, speed, tilt = figure.subplots(
            5, 1, sharex=True, height_ratios=(0.35, 2.0, 2.0, 2.0, 1.2))
        figure.suptitle(
            f'One drop, from {drop.brick_z:.3g} m and {drop.distance:.2f} m away: '
            f'{drop.outcome}', x=0.01, ha='left',
            fontsize=13, fontweight='bold')
        for axes in (height, way, speed, tilt):
            for phase, begin, end in _spans(time, trace.phase):
                axes.axvspan(begin, end, color=PHASE_COLORS[phase], linewidth=0.0, zorder=0)

        strip.set_yticks([])
        strip.grid(False)
        for side in strip.spines.values():
            side.set_visible(False)
        strip.tick_params(bottom=False)
        for state, begin, end in _spans(time, trace.state):
            strip.barh(0.0, end - begin, left=begin, height=1.0, color=STATE_COLORS[state])
            if end - begin > legible:
                strip.text((begin + end) / 2.0, 0.0, STATE_WORDS[state], ha='center',
                           va='center', fontsize=8)
        strip.set_title('what the catcher does', fontsize=9, fontweight='normal')

        height.plot(time, [brick[2] for brick in trace.brick], color=REFUSED, linewidth=1.8)
        height.axhline(resting_height(parameters), color=INK, linewidth=0.9, linestyle='--')
        height.text(0.995, resting_height(parameters), 'lying on the level platform ',
                    transform=height.get_yaxis_transform(), ha='right', va='bottom', fontsize=8)
        height.set_ylim(bottom=0.0)
        height.set_ylabel('height of the\nbrick / m')
        for phase, begin, end in _spans(time, trace.phase):
            if end - begin > legible:
                height.text((begin + end) / 2.0, 0.96, phase.value, ha='center', va='top',
                            transform=height.get_xaxis_transform(), fontsize=8)

        landing = trace.brick[0][:2]
        way.plot(time, [hypot(x - landing[0], y - landing[1]) for x, y in trace.robot],
                 color=CAUGHT, linewidth=1.8, label='to where the brick falls')
        way.plot(time, [hypot(x - CENTER[0], y - CENTER[1]) for x, y in trace.robot],
                 color=ROBOT, linewidth=1.8, label='to the center of the arena')
        way.axhline(parameters.platform_radius, color=INK, linewidth=0.9, linestyle='--')
        way.text(0.995, parameters.platform_radius, 'platform under the brick ',
                 transform=way.get_yaxis_transform(), ha='right', va='bottom', fontsize=8)
        way.set_ylim(0.0, 1.3 * way.get_ylim()[1])
        way.set_ylabel("robot's distance / m")
        way.legend(loc='upper right')

        speed.step(trace.command_time, trace.command, where='post', color=STATE_COLORS[
            State.APPROACHING], linewidth=1.6, label='commanded, 100 per second')
        speed.step(time, trace.speed, where='post', color=CAUGHT, linewidth=1.6,
                   label="turtlesim's, some 0.07 s behind")
        speed.set_ylabel('speed / (m/s)')
        speed.set_ylim(0.0, 1.35 * parameters.max_velocity)
        speed.legend(loc='upper right')

        tilt.plot(time, [degrees(angle) for angle in trace.tilt],
                  color=STATE_COLORS[State.TILTING], linewidth=1.8)
        tilt.set_ylabel('tilt / degrees')
        tilt.set_xlabel('time since the release / s')
        tilt.set_xlim(time[0], time[-1])
        for axes in (height, way, speed, tilt):
            axes.axvline(trace.decision_time, color=MISSED, linewidth=0.9, linestyle=':')
        height.annotate(f'decided after {1000.0 * trace.decision_time:.0f} ms',
                        (trace.decision_time, 0.08), xycoords=('data', 'axes fraction'),
                        xytext=(5, 0), textcoords='offset points', color=MISSED, fontsize=8)
        save(figure, path)


def _spans(time: Sequence[float], values: Sequence[Value]) -> list[tuple[Value, float, float]]:
    """Return (value, first instant, last instant) of each stretch of equal values."""
    spans: list[tuple[Value, float, float]] = []
    for value, group in groupby(zip(time, values), key=lambda pair: pair[1]):
        begin = next(group)[0]
        if spans:
            spans[-1] = (*spans[-1][:2], begin)
        spans.append((value, begin, time[-1]))
    return spans


CHAIN = {
    'seen': ('arena', 'a fall shows in its third sample, 8 ms after the release', REFUSED),
    'decided': ('catcher', 'recognizes the fall, decides, publishes the goal', MISSED),
    'commanded': ('turtle_robot', 'waits for its next cycle of 10 ms', ROBOT),
    'moved': ('turtlesim', 'its queue of seven commands is always full', CAUGHT),
    'known': ('turtle_robot', 'says so to TF in its next cycle', ROBOT),
}
"""Each part of the chain from a release to a motion: who does it, what, and its color."""


def latency(chains: Sequence[dict[str, float]], path: Path) -> None:
    """
    Draw the chain from the release of a brick to the robot's first motion.

    :param chains: Of each drop the times (s) from the release to the end of each part, in order.
    :param path: The PNG to write.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(9.4, 3.9), layout='constrained')
        axes = figure.subplots()
        axes.grid(axis='y', visible=False)
        begin = 0.0
        last = max(links['known'] for links in chains) * 1000.0
        for row, (part, (who, what, color)) in enumerate(CHAIN.items()):
            ends = sorted(1000.0 * links[part] for links in chains)
            end = percentile(ends, 0.5)
            axes.barh(row, end - begin, left=begin, height=0.5, color=color, alpha=0.85)
            axes.plot(ends, [row] * len(ends), '|', color=INK, markersize=9.0, alpha=0.35,
                      markeredgewidth=1.0)
            words = f'{end - begin:.1f} ms: {what}'
            if end - begin > 0.5 * last:
                axes.text(begin + 0.012 * last, row, words, va='center', color='white')
            elif end < 0.5 * last:
                axes.text(ends[-1] + 0.012 * last, row, words, va='center')
            else:
                axes.text(min(begin, ends[0]) - 0.012 * last, row, words, va='center', ha='right')
            if part != 'known':
                axes.plot([end, end], [row, row + 1], color=INK, linewidth=0.8, linestyle=':')
            begin = end
        axes.set_yticks(range(len(CHAIN)), [who for who, _, _ in CHAIN.values()])
        axes.tick_params(axis='y', length=0)
        axes.set_ylim(len(CHAIN) - 0.4, -0.6)
        axes.set_xlim(0.0, 1.02 * last)
        axes.set_xlabel('time since the release / ms (bars: medians, ticks: each of '
                        f'{len(chains)} drops)')
        medians = {part: percentile(sorted(1000.0 * links[part] for links in chains), 0.5)
                   for part in CHAIN}
        axes.set_title(f'{medians["decided"]:.0f} ms from release to decision, '
                       f'{medians["moved"]:.0f} ms to the first motion')
        save(figure, path)
