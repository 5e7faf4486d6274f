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
Figures: the map of the arena, one drop in detail, and the latency of the live graph.

Besides, what all figures are drawn with, those of the lesson included. They need no display and
leave matplotlib's global state alone.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from math import degrees, dist
from pathlib import Path
from statistics import median
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke
import numpy as np
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import (fall_time, guaranteed_distance, GUARANTEED_LATENCY,
                                            resting_height)
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.tools.simulation import counted, Drop, Sample

INK = '#1f2933'
FAINT = '#9aa5b1'
CAUGHT = '#0b6e99'
REFUSED = '#c2542d'
MISSED = '#d6006c'
ROBOT = '#2f855a'

STYLE: dict[Any, Any] = {
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

STATE_COLORS = {'waiting': '#cbd2d9', 'approaching': '#f0a04b', 'carrying': '#4caf6e',
                'tilting': '#b565c9', 'leveling': '#5b8def'}
PHASE_COLORS = {'hovering': '#eef2f6', 'falling': '#ffe3c4', 'riding': '#d5ecd8',
                'floating': '#d9e6f8', 'grounded': '#e6ddd8'}


@contextmanager
def drawn(path: Path, width: float, height: float) -> Iterator[Figure]:
    """Make a figure of a width and a height (inches), to be drawn and then written as a PNG."""
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout='constrained')
        yield figure
        figure.savefig(path, format='png', pil_kwargs={'optimize': True})


def farthest(height: float, parameters: Parameters) -> float:
    """Return the distance (m) that a robot without any latency could cover during a fall."""
    return (parameters.max_velocity * fall_time(height, parameters)
            + parameters.platform_radius)


def reachability_map(drops: Sequence[Drop], parameters: Parameters, path: Path) -> None:
    """Draw the arena from above: what was caught, refused and missed, and the theory's limits."""
    x, y, z = np.array([drop.result.brick for drop in drops]).T
    heights = sorted({z.min(), z.max()})
    known = [drop.margin for drop in drops if drop.margin is not None]
    least = min([-0.1, *known])
    norm = TwoSlopeNorm(0.0, least, max([0.1, *known]))
    with drawn(path, 8.2, 7.6) as figure:
        axes = figure.subplots()
        axes.grid(False)
        axes.spines[:].set_visible(False)
        walls = axes.add_patch(Rectangle((0.0, 0.0), ARENA_SIZE, ARENA_SIZE, fill=False,
                                         edgecolor=INK, linewidth=2.5, zorder=5))
        # So large (in square points) that the drops together could cover the arena.
        axes.scatter(x, y, s=min(max(450.0 ** 2 / len(drops), 1.0), 60.0), marker='s',
                     c=[least if drop.margin is None else drop.margin for drop in drops],
                     cmap=MARGIN_COLORS, norm=norm, linewidths=0.0).set_clip_path(walls)
        for drop in drops:
            if drop.outcome == 'missed':
                axes.plot(*drop.result.brick[:2], 'X', color=MISSED, markersize=7.0)
        turn = np.linspace(0.0, 2.0 * np.pi, 361)
        for law, style, words in (
                (guaranteed_distance, '-',
                 f'within this a catch is promised: {parameters.max_velocity:g} m/s x (fall - '
                 f'{GUARANTEED_LATENCY:g} s) + radius of the platform'),
                (farthest, FINE_DASHES,
                 'beyond this no robot is in time, not even without any latency'
                 + ' (both for the lowest and the highest)' * (len(heights) > 1))):
            for height in heights:
                radius = max(law(height, parameters), 0.0)
                axes.plot(CENTER[0] + radius * np.cos(turn), CENTER[1] + radius * np.sin(turn),
                          color='black', linewidth=1.5, linestyle=style,
                          label=words if height == heights[0] else None)
        axes.add_patch(Circle(CENTER, parameters.platform_radius, facecolor='white',
                              edgecolor=INK, linewidth=1.2, zorder=6))
        axes.text(*CENTER, 'robot', ha='center', va='center', fontsize=8, zorder=7)
        axes.set(aspect='equal', xlim=(-0.2, ARENA_SIZE + 0.2), ylim=(-0.2, ARENA_SIZE + 0.2),
                 xlabel='x in the world / m', ylabel='y in the world / m',
                 title=f'Where a robot of {parameters.max_velocity:g} m/s catches a brick that '
                 f'falls from {" to ".join(f"{height:.3g}" for height in heights)} m')
        bar = figure.colorbar(ScalarMappable(norm, MARGIN_COLORS), ax=axes, shrink=0.85,
                              pad=0.01, aspect=28)
        bar.ax.spines[:].set_visible(False)
        bar.set_label('refused: too late by / s' + 24 * ' ' + 'caught: to spare / s')
        figure.legend(loc='outside lower left', alignment='left', title=counted(drops))


def one_drop(samples: Sequence[Sample], drop: Drop, parameters: Parameters, path: Path) -> None:
    """Draw one drop over time, from its record and its result."""
    time, bricks, robots, tilts, commanded, speeds, phases, states = zip(*samples)
    decided = drop.result.decision_time
    with drawn(path, 8.6, 9.4) as figure:
        strip, height, way, speed, tilt = figure.subplots(
            5, 1, sharex=True, height_ratios=(0.35, 2.0, 2.0, 2.0, 1.2))
        figure.suptitle(
            f'One drop, from {drop.result.brick[2]:.3g} m and {drop.distance:.2f} m away: '
            f'{drop.outcome}', x=0.01, ha='left', fontsize=13, fontweight='bold')
        strip.axis('off')
        strip.set_title('what the catcher does', fontsize=9, fontweight='normal')
        _stretches(strip, time, [state.name.lower() for state in states], STATE_COLORS, 0.7)
        for axes in (height, way, speed, tilt):
            _stretches(axes, time, [phase.value for phase in phases], PHASE_COLORS,
                       0.96 if axes is height else 0.0)
            axes.axvline(decided, color=MISSED, linewidth=0.9, linestyle=':')
        for axes, values, color, label in (
                (height, [z for _, _, z in bricks], REFUSED, None),
                (way, [dist(robot, drop.result.brick[:2]) for robot in robots], CAUGHT,
                 'to where the brick falls'),
                (way, [dist(robot, CENTER) for robot in robots], ROBOT,
                 'to the center of the arena'),
                (speed, commanded, STATE_COLORS['approaching'], 'commanded, 100 per second'),
                (speed, speeds, CAUGHT, "turtlesim's, some 0.07 s behind"),
                (tilt, [degrees(angle) for angle in tilts], STATE_COLORS['tilting'], None)):
            axes.step(time, values, where='post', color=color, linewidth=1.7, label=label)
        for axes, value, words in (
                (height, resting_height(parameters), 'lying on the level platform '),
                (way, parameters.platform_radius, 'platform under the brick ')):
            axes.axhline(value, color=INK, linewidth=0.9, linestyle='--')
            axes.text(0.995, value, words, transform=axes.get_yaxis_transform(), ha='right',
                      va='bottom', fontsize=8)
        height.annotate(f'decided after {1000.0 * decided:.0f} ms',
                        (decided, 0.08), xycoords=('data', 'axes fraction'),
                        xytext=(5, 0), textcoords='offset points', color=MISSED, fontsize=8)
        height.set(ylabel='height of the\nbrick / m', ylim=(0.0, None))
        way.set(ylabel="robot's distance / m", ylim=(0.0, 1.3 * way.get_ylim()[1]))
        speed.set(ylabel='speed / (m/s)', ylim=(0.0, 1.35 * parameters.max_velocity))
        tilt.set(ylabel='tilt / degrees', xlabel='time since the release / s',
                 xlim=(time[0], time[-1]))
        way.legend(loc='upper right')
        speed.legend(loc='upper right')


def _stretches(axes: Axes, time: Sequence[float], values: Sequence[str], colors: dict[str, str],
               top: float) -> None:
    """Color each stretch of equal values, with the value below a top (0: none) if it has room."""
    changes = [index for index, (last, value) in enumerate(pairwise(values), 1) if value != last]
    for first, end in pairwise([0, *changes, len(values) - 1]):
        axes.axvspan(time[first], time[end], color=colors[values[first]], linewidth=0.0, zorder=0)
        if top and time[end] - time[first] > 0.06 * (time[-1] - time[0]):
            axes.text((time[first] + time[end]) / 2.0, top, values[first], ha='center', va='top',
                      transform=axes.get_xaxis_transform(), fontsize=8)


LINKS = {
    'seen': ('arena', 'a fall shows in its third sample, 8 ms after the release', REFUSED),
    'decided': ('catcher', 'recognizes the fall, decides, publishes the goal', MISSED),
    'commanded': ('turtle_robot', 'waits for its next cycle of 10 ms', ROBOT),
    'moved': ('turtlesim', 'its queue of seven commands is always full', CAUGHT),
    'known': ('turtle_robot', 'says so to TF in its next cycle', ROBOT),
}
"""Each link of the chain from a release to a motion: who does it, what, and its color."""


def waterfall(axes: Axes, links: Sequence[tuple[str, float, str]]) -> None:
    """Draw what passes one after another: the words, the time (ms) and the color of each link."""
    whole = sum(time for _, time, _ in links)
    begin = 0.0
    for row, (words, time, color) in enumerate(links):
        axes.barh(row, time, left=begin, height=0.6, color=color)
        end = begin + time
        inside, early = time > 0.5 * whole, end < 0.5 * whole
        axes.text(max(0.23 * whole, end + 0.06 * whole) if early
                  else begin + (0.01 if inside else -0.01) * whole, row,
                  words, ha='left' if inside or early else 'right', va='center',
                  color='white' if inside else INK,
                  path_effects=[] if inside else [withStroke(linewidth=3.0, foreground='white')])
        begin = end
    axes.grid(axis='y', visible=False)
    axes.set(yticks=[], ylim=(len(links) - 0.4, -0.6), xlim=(0.0, 1.02 * whole))


def latency(chains: Sequence[dict[str, float]], path: Path) -> None:
    """
    Draw the chain from the release of a brick to the robot's first motion.

    :param chains: of each drop, the times (s) from the release to the end of each of LINKS
    :param path: of the PNG
    """
    medians = {link: 1e3 * median(chain[link] for chain in chains) for link in LINKS}
    times = np.diff([0.0, *medians.values()])
    with drawn(path, 9.4, 3.9) as figure:
        axes = figure.subplots()
        waterfall(axes, [(f'{time:.1f} ms: {what}', time, color)
                         for (_, what, color), time in zip(LINKS.values(), times)])
        for row, link in enumerate(LINKS):
            ends = [1e3 * chain[link] for chain in chains]
            axes.plot(ends, [row] * len(ends), '|', color=INK, markersize=9.0, alpha=0.35)
        axes.set_yticks(range(len(LINKS)), [who for who, _, _ in LINKS.values()])
        axes.tick_params(axis='y', length=0)
        axes.set(xlim=(0.0, 1.02e3 * max(chain['known'] for chain in chains)),
                 xlabel='time since the release / ms (bars: medians, ticks: each of '
                 f'{len(chains)} drops)',
                 title=f'{medians["decided"]:.0f} ms from release to decision, '
                 f'{medians["moved"]:.0f} ms to the first motion')
