# SPDX-License-Identifier: Apache-2.0

"""Lesson 5: reachable bricks and the delays before the robot moves."""

from bisect import bisect
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from turtle_brick.core.driving import COMMAND_PERIOD
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import resting_height
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, QUEUE_DEPTH, TICK
from turtle_brick_tools.lesson.falling import DT
from turtle_brick_tools.plots import (CAUGHT, distance_without_latency, FAINT, FINE_DASHES, INK,
                                      MISSED, new_figure, REFUSED, ROBOT, waterfall)
from turtle_brick_tools.simulation import (DETECTION_TIME, fall_time, guaranteed_distance,
                                           outcome_counts, simulate_drop, SimulatedDrop,
                                           TRANSPORT_DELAY)

HEIGHTS = tuple(float(number) for number in range(1, 11))
DISTANCES = tuple(0.2 * number for number in range(28))
"""Heights (m) of the brick above the ground and horizontal distances (m) from the robot."""

WORST_DELAYS = (
    ('third sample of the fall', 3 * DT),
    ('message transport', 3 * TRANSPORT_DELAY),
    ('next command of the robot', COMMAND_PERIOD),
    ('turtlesim queue', (QUEUE_DEPTH - 1) * COMMAND_PERIOD + TICK + TRANSPORT_DELAY),
    ('next transform of the robot', COMMAND_PERIOD),
    ('next physics step', DT),
)
"""Maximum delays (s) between the release of a brick and the robot's first motion."""


def guaranteed_latency(parameters: Parameters) -> float:
    """Return the assumed maximum time (s) from a brick's release to the robot's first motion."""
    return DETECTION_TIME + parameters.command_latency


@cache
def all_drops(parameters: Parameters) -> list[SimulatedDrop]:
    """Simulate one drop for each combination of HEIGHTS and DISTANCES."""
    return [drop_at(distance, height, parameters) for height in HEIGHTS for distance in DISTANCES]


def drop_at(distance: float, height: float, parameters: Parameters) -> SimulatedDrop:
    """Simulate a drop from a given height (m) at a given distance (m) from the robot."""
    return simulate_drop(parameters, 0, 1, (ARENA_CENTER + distance, ARENA_CENTER, height))


def largest_caught_distance(height: float, parameters: Parameters) -> float:
    """Find the maximum distance (m) at which the robot catches a brick dropped from `height`."""
    millimeters = range(round(1e3 * (ARENA_SIZE - ARENA_CENTER)))
    return 1e-3 * bisect(millimeters, False, key=lambda distance: drop_at(
        1e-3 * distance, height, parameters).outcome != 'caught')


def report(parameters: Parameters) -> Iterator[str]:
    """Yield the results for this lesson, one line at a time."""
    drops = all_drops(parameters)
    yield f'  {outcome_counts(drops)}'
    yield '  height      fall   guaranteed distance    simulated distance'
    for height in (3.0, 5.0, 8.0, 10.0):
        fall = fall_time(height, parameters)
        yield (f'  {height:4g} m{fall:8.3f} s{guaranteed_distance(height, parameters):20.2f} m'
               f'{largest_caught_distance(height, parameters):20.2f} m')
    yield '  maximum delays from the release to the first motion:'
    for label, time in WORST_DELAYS:
        yield f'    {label:32}{1e3 * time:6.1f} ms'
    yield f'    {"total":32}{1e3 * sum(time for _, time in WORST_DELAYS):6.1f} ms'
    yield f'    {"assumed by the guarantee":32}{1e3 * guaranteed_latency(parameters):6.1f} ms'


def draw(parameters: Parameters, path: Path) -> None:
    """Plot the outcome of each drop, and the maximum delays before the robot moves."""
    with new_figure(path, 7.6, 6.6) as figure:
        plane, chain = figure.subplots(2, 1, height_ratios=(2.6, 1.0))
        for outcome, color, mark in (('caught', CAUGHT, 'o'), ('refused', '#e8b59f', 'o'),
                                     ('missed', MISSED, 'X')):
            selected = [drop for drop in all_drops(parameters) if drop.outcome == outcome]
            plane.plot([drop.distance for drop in selected],
                       [drop.result.brick[2] for drop in selected], mark, color=color,
                       markersize=4.5, label=f'{len(selected)} {outcome}')
        low = resting_height(parameters)
        heights = low + (10.4 - low) * np.linspace(0.0, 1.0, 301) ** 2
        for limit, width, style, label in (
                (guaranteed_distance, 1.8, '-',
                 f'guaranteed: v (t − {guaranteed_latency(parameters):g} s) + r'),
                (distance_without_latency, 1.4, FINE_DASHES, 'without latency: v t + r')):
            distances = [max(limit(height, parameters), -1.0) for height in heights]
            plane.plot(distances, heights, color=INK, linewidth=width, linestyle=style,
                       label=label)
        plane.axhline(low, color=FAINT, linewidth=1.2)
        plane.text(5.55, low - 0.28, 'below the platform', ha='right', va='center', fontsize=8.5)
        plane.set(xlim=(-0.1, 5.6), ylim=(0.6, 10.4), ylabel='height of the release / m',
                  xlabel='distance from the robot at rest / m',
                  title=f'Bricks caught at {parameters.max_velocity:g} m/s')
        plane.legend(loc='upper center', bbox_to_anchor=(0.5, -0.13), ncols=5, columnspacing=1.2,
                     handletextpad=0.4)

        colors = (REFUSED, FAINT, ROBOT, CAUGHT, ROBOT, '#c9a227')
        waterfall(chain, [(f'{label}, {1e3 * time:.0f} ms', 1e3 * time, color, ())
                          for (label, time), color in zip(WORST_DELAYS, colors)])
        chain.set(xlim=(0.0, 1e3 * guaranteed_latency(parameters)),
                  xlabel='time since the release / ms',
                  title='Maximum delays from the release to the first motion')
