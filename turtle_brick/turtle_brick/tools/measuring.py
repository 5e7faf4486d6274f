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
What a benchmark computes from what it has recorded, without ROS.

Intervals and their spread, steps that a simulation lost against the clock, the parts of the chain
from a brick's release to the robot's first motion; and, of Linux, what a process has used.
Instants are integer nanoseconds of the system's clock, unless a name says otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, hypot
import os
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from turtle_brick.core.time_steps import NANO

MOVED = 1e-6
"""Distance (m) from which a robot counts as having moved."""

PARTS = {
    'seen': 'release -> the third sample of the fall is published',
    'decided': '-> the goal is published',
    'commanded': '-> the first command to move is published',
    'moved': '-> the first pose that has moved is published',
    'known': '-> the first transform that has moved is published',
}
"""The links of the chain from a release to a motion that everyone knows of, in order."""


@dataclass(frozen=True)
class Spread:
    """How values are distributed."""

    count: int
    mean: float
    p01: float
    p50: float
    p99: float
    maximum: float


def percentile(ordered: Sequence[float], part: float) -> float:
    """
    Return a percentile, interpolated linearly between the two nearest values.

    :param ordered: the values in ascending order, at least one
    :param part: in [0, 1]
    :return: The value below which that part of the values lies.
    """
    place = part * (len(ordered) - 1)
    low, high = floor(place), ceil(place)
    return ordered[low] + (place - low) * (ordered[high] - ordered[low])


def spread(values: Sequence[float]) -> Spread:
    """Return how values are distributed; ValueError if there are none."""
    if not values:
        raise ValueError('nothing was heard that could be measured')
    ordered = sorted(values)
    return Spread(len(ordered), sum(ordered) / len(ordered), percentile(ordered, 0.01),
                  percentile(ordered, 0.50), percentile(ordered, 0.99), ordered[-1])


def intervals(instants: Sequence[int]) -> list[float]:
    """Return the times (s) between neighbouring instants (ns)."""
    return [(later - earlier) * NANO for earlier, later in zip(instants, instants[1:])]


@dataclass(frozen=True)
class Drift:
    """How a simulation of equal steps has kept up with the clock."""

    steps: int
    """How many were published."""
    lost: int
    """Gaps between their stamps, in steps; negative for steps that came twice."""
    behind: int
    """By how many steps the stamps have fallen behind the clock, from the begin to the end."""
    latest: float
    """The longest time (s) from a step's stamp to its publication."""

    @property
    def total(self) -> int:
        """Return the steps that are missing, by count or by clock."""
        return abs(self.lost) + abs(self.behind)


def drift(stamps: Sequence[int], published: Sequence[int], period: int) -> Drift:
    """
    Compare the stamps of steps with the clock at which they were published.

    :param stamps: the instant that each step belongs to (ns), in the order of publication
    :param published: when it was published (ns)
    :param period: the time of a step (ns)
    :return: The comparison. A publication may be late by some steps, but not later and later: the
        lags of the first and the last second are compared, each by its least, since what delays a
        publication comes and goes.
    """
    lost = sum((later - earlier) // period - 1 for earlier, later in zip(stamps, stamps[1:]))
    lags = [there - stamp for stamp, there in zip(stamps, published)]
    second = min(1_000_000_000 // period, len(lags))
    begin, end = min(lags[:second]), min(lags[-second:])
    return Drift(len(stamps), lost, round((end - begin) / period), max(lags) * NANO)


class BrickSample(NamedTuple):
    """A position of the brick."""

    stamp: int
    published: int
    z: float


class Place(NamedTuple):
    """A position of the robot."""

    published: int
    x: float
    y: float


class Events(NamedTuple):
    """What was heard from before a brick's release until the robot had moved, in order."""

    brick: Sequence[BrickSample]
    goals: Sequence[int]
    """When goals were published."""
    commands: Sequence[tuple[int, float]]
    """When commands were published, and their speeds (m/s)."""
    poses: Sequence[Place]
    """Poses of turtlesim."""
    transforms: Sequence[Place]
    """Transforms of base_link."""


def chain(events: Events) -> dict[str, float] | None:
    """
    Find the links of the chain from a brick's release to the robot's motion.

    :param events: what was heard
    :return: The time (s) from the release to the end of each of `PARTS`; None where the brick did
        not fall or the robot did not move.
    """
    start = next((index for index, (before, after) in enumerate(
        zip(events.brick, events.brick[1:])) if after.z < before.z), None)
    if start is None or start + 2 >= len(events.brick):
        return None
    # A release falls on a step: the last position before the first that is lower.
    release = events.brick[start].stamp
    third = events.brick[start + 2].published
    goal = next((published for published in events.goals if published >= release), None)
    if goal is None:
        return None
    command = next((published for published, speed in events.commands
                    if published >= release and speed > 0.0), None)
    moved = _first_motion(events.poses, release)
    known = _first_motion(events.transforms, release)
    if command is None or moved is None or known is None:
        return None
    return dict(zip(PARTS, ((instant - release) * NANO
                            for instant in (third, goal, command, moved, known))))


def _first_motion(places: Sequence[Place], since: int) -> int | None:
    """Return when the first place was published that differs from the one before."""
    for before, after in zip(places, places[1:]):
        if (after.published >= since
                and hypot(after.x - before.x, after.y - before.y) > MOVED):
            return after.published
    return None


def parts(ends: dict[str, float]) -> dict[str, float]:
    """Return how long (s) each part of a chain took, from the times of their ends."""
    begins = [0.0, *ends.values()]
    return {name: end - begin for (name, end), begin in zip(ends.items(), begins)}


def processor_time(process: int) -> float:
    """
    Return the time (s) that a process and its threads have had of processors so far.

    :param process: its id
    :return: User and system time; proc(5) gives them in clock ticks of, mostly, 10 ms.
    """
    # The name of the program, in brackets, may itself hold blanks and brackets.
    fields = Path('/proc', str(process), 'stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def peak_memory(process: int) -> int:
    """Return the most memory (bytes) that a process has had in RAM so far."""
    for line in Path('/proc', str(process), 'status').read_text().splitlines():
        if line.startswith('VmHWM:'):
            return int(line.split()[1]) * 1024
    return 0


def busy_time() -> float:
    """
    Return the time (s) that all processors together have worked, since any fixed instant.

    It is the time that they were not idle: a tickless Linux books that as it is, while it tells
    what they work on by looking some hundred times per second, and programs that wake up with the
    same timers are seen always or never.
    """
    spent = _spent()
    return (os.sysconf('SC_NPROCESSORS_ONLN') * monotonic()
            - spent['idle'] - spent['iowait'] - spent['steal'])


def stolen_time() -> float:
    """Return the time (s) that a virtual machine's processors have been kept from working."""
    return _spent()['steal']


def _spent() -> dict[str, float]:
    """Return what all processors together have spent their time (s) on since the start."""
    names = ('user', 'nice', 'system', 'idle', 'iowait', 'irq', 'softirq', 'steal')
    ticks = Path('/proc/stat').read_text().split('\n')[0].split()[1:]
    return {name: int(count) / os.sysconf('SC_CLK_TCK') for name, count in zip(names, ticks)}


def processor_model() -> str:
    """Return the name of the machine's processor."""
    for line in Path('/proc/cpuinfo').read_text().splitlines():
        if line.startswith('model name'):
            return ' '.join(line.partition(':')[2].split())
    return 'an unknown processor'
