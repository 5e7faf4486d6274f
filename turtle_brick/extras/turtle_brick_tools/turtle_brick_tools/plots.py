# SPDX-License-Identifier: Apache-2.0

"""
Plot a map of the arena, one drop in detail, and the latency in the live ROS graph.

The figures in the lesson also use the colors and helper functions in this module. The module
neither requires a display nor changes matplotlib's global state.
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
import numpy as np
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import resting_height
from turtle_brick.core.tilting_platform import PlatformShape
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick_tools.simulation import (DETECTION_TIME, fall_time, guaranteed_distance,
                                           outcome_counts, SimulatedDrop, TraceSample)

INK = '#1f2933'
FAINT = '#9aa5b1'
CAUGHT = '#0b6e99'
REFUSED = '#c2542d'
MISSED = '#d6006c'
ROBOT = '#2f855a'

STYLE: dict[Any, Any] = {
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
    'text.color': INK,
    'xtick.color': INK,
    'ytick.color': INK,
    'legend.frameon': False,
    'legend.fontsize': 8.5,
    'figure.dpi': 110,
}

MARGIN_COLORS = LinearSegmentedColormap.from_list('margin', [
    (0.0, '#5c1f1a'), (0.25, '#b5452f'), (0.5, '#f7b36b'),
    (0.5, '#a5dcc4'), (0.75, '#3a8fb7'), (1.0, '#183a6b')])
"""Colormap for `SimulatedDrop.margin`: red to orange if refused, green to blue if caught."""

FINE_DASHES = (0, (2, 2))

STATE_COLORS = {'waiting': '#cbd2d9', 'approaching': '#f0a04b', 'carrying': '#4caf6e',
                'tilting': '#b565c9', 'leveling': '#5b8def'}
BRICK_COLORS = {'hovering': '#eef2f6', 'falling': '#ffe3c4', 'riding': '#d5ecd8',
                'floating': '#d9e6f8', 'grounded': '#e6ddd8'}


@contextmanager
def new_figure(path: Path, width: float, height: float) -> Iterator[Figure]:
    """Yield an empty figure of a given size (inches), and then write the figure to a PNG file."""
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout='constrained')
        yield figure
        figure.savefig(path, format='png', pil_kwargs={'optimize': True})


def distance_without_latency(height: float, parameters: Parameters) -> float:
    """Return the maximum distance (m) to a brick that a robot without latency could catch."""
    reach = PlatformShape(parameters.platform_radius).reach
    return parameters.max_velocity * fall_time(height, parameters) + reach


def reachability_map(drops: Sequence[SimulatedDrop], parameters: Parameters, path: Path) -> None:
    """Draw the outcomes of drops and the theoretical limits on a top view of the arena."""
    heights = sorted({min(drop.result.brick[2] for drop in drops),
                      max(drop.result.brick[2] for drop in drops)})
    margins = [drop.margin for drop in drops if drop.margin is not None]
    lowest = min([-0.1, *margins])
    norm = TwoSlopeNorm(0.0, lowest, max([0.1, *margins]))
    with new_figure(path, 8.2, 7.6) as figure:
        axes = figure.subplots()
        axes.grid(False)
        axes.spines[:].set_visible(False)
        _draw_outcomes(axes, drops, norm, lowest)
        _draw_limits(axes, heights, parameters)
        axes.add_patch(Circle(CENTER, parameters.platform_radius, facecolor='white',
                              edgecolor=INK, linewidth=1.2, zorder=6))
        axes.text(*CENTER, 'robot', ha='center', va='center', fontsize=8, zorder=7)
        axes.set(aspect='equal', xlim=(-0.2, ARENA_SIZE + 0.2), ylim=(-0.2, ARENA_SIZE + 0.2),
                 xlabel='x in the world frame / m', ylabel='y in the world frame / m',
                 title=f'Catches at {parameters.max_velocity:g} m/s for a brick dropped from '
                 f'{" to ".join(f"{height:.3g}" for height in heights)} m')
        bar = figure.colorbar(ScalarMappable(norm, MARGIN_COLORS), ax=axes, shrink=0.85,
                              pad=0.01, aspect=28)
        bar.ax.spines[:].set_visible(False)
        bar.set_label(f'refused: missing time / s{24 * " "}caught: spare time / s')
        figure.legend(loc='outside lower left', alignment='left', title=outcome_counts(drops))


def _draw_outcomes(axes: Axes, drops: Sequence[SimulatedDrop], norm: TwoSlopeNorm,
                   lowest: float) -> None:
    walls = axes.add_patch(Rectangle((0.0, 0.0), ARENA_SIZE, ARENA_SIZE, fill=False,
                                     edgecolor=INK, linewidth=2.5, zorder=5))
    x, y, _ = zip(*(drop.result.brick for drop in drops))
    # The squares (size in points squared) are just large enough to cover the arena without gaps.
    size = min(max(450.0 ** 2 / len(drops), 1.0), 60.0)
    colors = [lowest if drop.margin is None else drop.margin for drop in drops]
    axes.scatter(x, y, s=size, marker='s', c=colors, cmap=MARGIN_COLORS, norm=norm,
                 linewidths=0.0).set_clip_path(walls)
    for drop in drops:
        if drop.outcome == 'missed':
            axes.plot(*drop.result.brick[:2], 'X', color=MISSED, markersize=7.0)


def _draw_limits(axes: Axes, heights: Sequence[float], parameters: Parameters) -> None:
    guarantee = (f'a catch is guaranteed inside: {parameters.max_velocity:g} m/s × (fall time − '
                 f'{DETECTION_TIME + parameters.command_latency:g} s) + platform radius')
    impossible = 'a catch is impossible outside, even without any latency'
    if len(heights) > 1:
        impossible += ' (for the lowest and the highest release)'
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    for limit, style, label in ((guaranteed_distance, '-', guarantee),
                                (distance_without_latency, FINE_DASHES, impossible)):
        for height in heights:
            radius = max(limit(height, parameters), 0.0)
            axes.plot(CENTER[0] + radius * np.cos(angle), CENTER[1] + radius * np.sin(angle),
                      color='black', linewidth=1.5, linestyle=style,
                      label=label if height == heights[0] else None)


def one_drop(samples: Sequence[TraceSample], drop: SimulatedDrop, parameters: Parameters,
             path: Path) -> None:
    """Plot the motion of the brick, robot and platform against time for one simulated drop."""
    time = [sample.time for sample in samples]
    with new_figure(path, 8.6, 9.4) as figure:
        strip, height, distance, speed, tilt = figure.subplots(
            5, 1, sharex=True, height_ratios=(0.35, 2.0, 2.0, 2.0, 1.2))
        figure.suptitle(
            f'One drop, from {drop.result.brick[2]:.3g} m and {drop.distance:.2f} m away: '
            f'{drop.outcome}', x=0.01, ha='left', fontsize=13, fontweight='bold')
        strip.axis('off')
        strip.set_title('state of the catcher', fontsize=9, fontweight='normal')
        _color_spans(strip, time, [sample.state.name.lower() for sample in samples],
                     STATE_COLORS, 0.7)
        brick_states = [sample.brick_state.value for sample in samples]
        for axes in (height, distance, speed, tilt):
            _color_spans(axes, time, brick_states, BRICK_COLORS, 0.96 if axes is height else None)
            axes.axvline(drop.result.decision_time, color=MISSED, linewidth=0.9, linestyle=':')
        _draw_curves(samples, drop, height, distance, speed, tilt)
        for axes, value, label in (
                (height, resting_height(parameters), 'on the level platform '),
                (distance, parameters.platform_radius, 'platform below the brick ')):
            axes.axhline(value, color=INK, linewidth=0.9, linestyle='--')
            axes.text(0.995, value, label, transform=axes.get_yaxis_transform(), ha='right',
                      va='bottom', fontsize=8)
        height.annotate(f'decision after {1000.0 * drop.result.decision_time:.0f} ms',
                        (drop.result.decision_time, 0.08), xycoords=('data', 'axes fraction'),
                        xytext=(5, 0), textcoords='offset points', color=MISSED, fontsize=8)
        height.set(ylabel='brick height / m', ylim=(0.0, None))
        distance.set(ylabel='robot distance / m', ylim=(0.0, 1.3 * distance.get_ylim()[1]))
        speed.set(ylabel='robot speed / (m/s)', ylim=(0.0, 1.35 * parameters.max_velocity))
        tilt.set(ylabel='tilt angle / °', xlabel='time since the release / s',
                 xlim=(time[0], time[-1]))
        distance.legend(loc='upper right')
        speed.legend(loc='upper right')


def _draw_curves(samples: Sequence[TraceSample], drop: SimulatedDrop, height: Axes,
                 distance: Axes, speed: Axes, tilt: Axes) -> None:
    def plot(axes: Axes, values: Sequence[float], color: str, label: str | None = None) -> None:
        axes.step([sample.time for sample in samples], values, where='post', color=color,
                  linewidth=1.7, label=label)

    plot(height, [sample.brick[2] for sample in samples], REFUSED)
    plot(distance, [dist(sample.robot, drop.result.brick[:2]) for sample in samples], CAUGHT,
         'to the landing point')
    plot(distance, [dist(sample.robot, CENTER) for sample in samples], ROBOT,
         'to the center of the arena')
    plot(speed, [sample.commanded for sample in samples], STATE_COLORS['approaching'],
         'commanded at 100 Hz')
    plot(speed, [sample.speed for sample in samples], CAUGHT, 'turtlesim, about 0.07 s later')
    plot(tilt, [degrees(sample.tilt) for sample in samples], STATE_COLORS['tilting'])


def _color_spans(axes: Axes, time: Sequence[float], values: Sequence[str],
                 colors: dict[str, str], label_height: float | None) -> None:
    changes = [index for index, (last, value) in enumerate(pairwise(values), 1) if value != last]
    for first, end in pairwise([0, *changes, len(values) - 1]):
        axes.axvspan(time[first], time[end], color=colors[values[first]], linewidth=0.0, zorder=0)
        if label_height is not None and time[end] - time[first] > 0.06 * (time[-1] - time[0]):
            axes.text((time[first] + time[end]) / 2.0, label_height, values[first], ha='center',
                      va='top', transform=axes.get_xaxis_transform(), fontsize=8)


LINKS = {
    'seen': ('arena', 'third sample of the fall, 8 ms after the release', REFUSED),
    'decided': ('catcher', 'detects the fall, decides, publishes the goal', MISSED),
    'commanded': ('turtle_robot', 'waits for its next cycle of 10 ms', ROBOT),
    'moved': ('turtlesim', 'its queue of seven commands is always full', CAUGHT),
    'known': ('turtle_robot', 'broadcasts the motion in its next cycle', ROBOT),
}
"""Node, description and color for each successive delay from the release of a brick to the first
transform that shows the motion of the robot."""


def waterfall(axes: Axes, delays: Sequence[tuple[str, float, str, Sequence[float]]]) -> None:
    """Draw successive delays (label, duration, color, end times) as bars on a time axis in ms."""
    total = sum(duration for _, duration, _, _ in delays)
    begin = 0.0
    for row, (label, duration, color, ends) in enumerate(delays):
        end = begin + duration
        axes.barh(row, duration, left=begin, height=0.6, color=color)
        axes.plot(ends, [row] * len(ends), '|', color=INK, markersize=9.0, alpha=0.35)
        if duration > 0.5 * total:  # The label fits inside the bar.
            axes.text(begin + 0.01 * total, row, label, va='center', color='white')
        elif end < 0.5 * total:
            axes.text(max([end, *ends]) + 0.01 * total, row, label, va='center')
        else:
            axes.text(min([begin, *ends]) - 0.01 * total, row, label, ha='right', va='center')
        begin = end
    axes.grid(axis='y', visible=False)
    axes.set(yticks=[], ylim=(len(delays) - 0.4, -0.6))


def latency(drops: Sequence[dict[str, float]], path: Path) -> None:
    """Plot the times (s) from the release of each brick to the end of each delay in LINKS."""
    medians = {link: 1e3 * median(drop[link] for drop in drops) for link in LINKS}
    durations = np.diff([0.0, *medians.values()])
    with new_figure(path, 9.4, 3.9) as figure:
        axes = figure.subplots()
        waterfall(axes, [(f'{duration:.1f} ms: {description}', duration, color,
                          [1e3 * drop[link] for drop in drops])
                         for (link, (_, description, color)), duration
                         in zip(LINKS.items(), durations)])
        axes.set_yticks(range(len(LINKS)), [node for node, _, _ in LINKS.values()])
        axes.tick_params(axis='y', length=0)
        axes.set(xlim=(0.0, 1.02e3 * max(drop['known'] for drop in drops)),
                 xlabel='time since the release / ms (bars: medians, ticks: each of '
                 f'{len(drops)} drops)',
                 title=f'{medians["decided"]:.0f} ms from release to decision, '
                 f'{medians["moved"]:.0f} ms to the first motion')
