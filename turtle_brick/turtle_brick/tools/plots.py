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
from itertools import groupby
from math import degrees, dist, nan, pi
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke
import numpy as np
from turtle_brick.core.catch_logic import CENTER, State
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import (fall_time, guaranteed_distance, GUARANTEED_LATENCY,
                                            resting_height)
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.tools.drops import Drop, Sample

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

Value = TypeVar('Value')


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


def reachability_map(drops: Sequence[Drop], parameters: Parameters, cells: int | None,
                     path: Path) -> None:
    """
    Draw the arena from above: what was caught, refused and missed, and the boundaries in theory.

    :param cells: the number of cells along each side of the arena, each with a drop in its
        center; None for drops at random places
    """
    x, y, z = np.array([drop.result.brick for drop in drops]).T
    heights = sorted({z.min(), z.max()})
    least = min(-0.1, *(drop.margin for drop in drops if drop.margin is not None))
    margins = np.array([least if drop.margin is None else drop.margin for drop in drops])
    norm = TwoSlopeNorm(0.0, least, max(0.1, margins.max()))
    with drawn(path, 8.2, 7.6) as figure:
        axes = figure.subplots()
        axes.grid(False)
        axes.spines[:].set_visible(False)
        walls = axes.add_patch(Rectangle((0.0, 0.0), ARENA_SIZE, ARENA_SIZE, fill=False,
                                         edgecolor=INK, linewidth=2.5, zorder=5))
        if cells is not None:
            tiles = np.full((cells, cells), nan)
            tiles[(y / ARENA_SIZE * cells).astype(int), (x / ARENA_SIZE * cells).astype(int)] = (
                margins)
            axes.imshow(tiles, MARGIN_COLORS, norm, interpolation='none', origin='lower',
                        extent=(0.0, ARENA_SIZE, 0.0, ARENA_SIZE))
        else:
            # So large (in square points) that the drops together could cover the arena.
            size = min(max(430.0 ** 2 / len(drops), 1.0), 60.0)
            axes.scatter(x, y, s=size, c=margins, cmap=MARGIN_COLORS, norm=norm,
                         linewidths=0.0).set_clip_path(walls)
        missed = [drop.result.brick for drop in drops if drop.outcome == 'missed']
        axes.scatter([x for x, _, _ in missed], [y for _, y, _ in missed], s=50.0, c=MISSED,
                     marker='X', linewidths=0.0, zorder=4)
        turn = np.linspace(0.0, 2.0 * pi, 361)
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
                          color='black', linewidth=1.5, linestyle=style, zorder=4.5,
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
        bar.ax.set_title('s', fontsize=9.5, fontweight='normal', loc='center')
        for place, words in ((0.25, 'refused: too late by'), (0.75, 'caught: to spare')):
            bar.ax.annotate(words, (4.8, place), xycoords='axes fraction', rotation=90,
                            ha='center', va='center')
        axes.legend(
            loc='upper left', bbox_to_anchor=(0.0, -0.08), alignment='left',
            title=f'{len(drops):,} drops: ' + ', '.join(
                f'{sum(drop.outcome == outcome for drop in drops):,} {outcome}'
                for outcome in ('caught', 'refused', 'missed')))


def one_drop(samples: Sequence[Sample], drop: Drop, parameters: Parameters, path: Path) -> None:
    """Draw one drop over time, from its record and its result."""
    decided = drop.result.decision_time
    time = [sample.time for sample in samples]
    phases = _spans(time, [sample.phase for sample in samples])
    legible = 0.06 * (time[-1] - time[0])
    with drawn(path, 8.6, 9.4) as figure:
        strip, height, way, speed, tilt = figure.subplots(
            5, 1, sharex=True, height_ratios=(0.35, 2.0, 2.0, 2.0, 1.2))
        figure.suptitle(
            f'One drop, from {drop.result.brick[2]:.3g} m and {drop.distance:.2f} m away: '
            f'{drop.outcome}', x=0.01, ha='left', fontsize=13, fontweight='bold')
        for axes in (height, way, speed, tilt):
            for phase, begin, end in phases:
                axes.axvspan(begin, end, color=PHASE_COLORS[phase], linewidth=0.0, zorder=0)
            axes.axvline(decided, color=MISSED, linewidth=0.9, linestyle=':')

        strip.grid(False)
        strip.spines[:].set_visible(False)
        strip.tick_params(left=False, labelleft=False, bottom=False)
        strip.set_title('what the catcher does', fontsize=9, fontweight='normal')
        for state, begin, end in _spans(time, [sample.state for sample in samples]):
            strip.barh(0.0, end - begin, left=begin, height=1.0, color=STATE_COLORS[state])
            if end - begin > legible:
                strip.text((begin + end) / 2.0, 0.0, state.name.lower(), ha='center',
                           va='center', fontsize=8)

        height.plot(time, [sample.brick[2] for sample in samples], color=REFUSED, linewidth=1.8)
        height.set_ylim(bottom=0.0)
        height.set_ylabel('height of the\nbrick / m')
        _level(height, resting_height(parameters), 'lying on the level platform ')
        for phase, begin, end in phases:
            if end - begin > legible:
                height.text((begin + end) / 2.0, 0.96, phase.value, ha='center', va='top',
                            transform=height.get_xaxis_transform(), fontsize=8)
        height.annotate(f'decided after {1000.0 * decided:.0f} ms',
                        (decided, 0.08), xycoords=('data', 'axes fraction'),
                        xytext=(5, 0), textcoords='offset points', color=MISSED, fontsize=8)

        for place, color, label in ((drop.result.brick[:2], CAUGHT, 'to where the brick falls'),
                                    (CENTER, ROBOT, 'to the center of the arena')):
            way.plot(time, [dist(sample.robot, place) for sample in samples], color=color,
                     linewidth=1.8, label=label)
        way.set_ylim(0.0, 1.3 * way.get_ylim()[1])
        way.set_ylabel("robot's distance / m")
        way.legend(loc='upper right')
        _level(way, parameters.platform_radius, 'platform under the brick ')

        for speeds, color, label in (
                ([sample.commanded for sample in samples], STATE_COLORS[State.APPROACHING],
                 'commanded, 100 per second'),
                ([sample.speed for sample in samples], CAUGHT, "turtlesim's, some 0.07 s behind")):
            speed.step(time, speeds, where='post', color=color, linewidth=1.6, label=label)
        speed.set(ylabel='speed / (m/s)', ylim=(0.0, 1.35 * parameters.max_velocity))
        speed.legend(loc='upper right')

        tilt.plot(time, [degrees(sample.tilt) for sample in samples],
                  color=STATE_COLORS[State.TILTING], linewidth=1.8)
        tilt.set(ylabel='tilt / degrees', xlabel='time since the release / s',
                 xlim=(time[0], time[-1]))


def _level(axes: Axes, value: float, words: str) -> None:
    """Draw a horizontal line at a value, with words on it."""
    axes.axhline(value, color=INK, linewidth=0.9, linestyle='--')
    axes.text(0.995, value, words, transform=axes.get_yaxis_transform(), ha='right', va='bottom',
              fontsize=8)


def _spans(time: Sequence[float], values: Sequence[Value]) -> list[tuple[Value, float, float]]:
    """Return (value, first instant, last instant) of each stretch of equal values."""
    begins = [(value, next(stretch)[0])
              for value, stretch in groupby(zip(time, values), key=lambda pair: pair[1])]
    ends = [begin for _, begin in begins[1:]] + [time[-1]]
    return [(value, begin, end) for (value, begin), end in zip(begins, ends)]


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
