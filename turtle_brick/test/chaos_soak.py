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
"""A long day of drops: whether promises are kept, and memory and open files stay as they are."""

from __future__ import annotations

from math import cos, dist, pi, sin
import os
from pathlib import Path
from random import Random
from statistics import linear_regression
from time import monotonic
from typing import Any

from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import load
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase

PARAMETERS = load()

GROWTH = 0.02
"""MB of memory per minute that a process may grow by."""

WARM_UP = 120.0
"""Time (s) from which on memory and open files count."""

TELLING = 300.0
"""Time (s) of which a growth is told from what comes and goes."""

EDGE = 0.3
"""How far (m) from the walls bricks fall, at least."""

HEIGHTS = (2.5, 9.0)
"""From which they fall (m)."""


def memory(process: int) -> float:
    """Return how many MB of memory a process has of its own, not as a part of a file."""
    status = Path(f'/proc/{process}/status').read_text(encoding='ascii')
    sizes = dict(line.split(':', 1) for line in status.splitlines())
    return sum(int(sizes[name].split()[0]) for name in ('RssAnon', 'RssShmem')) / 1024


def open_files(process: int) -> int:
    """Return how many file descriptors a process has open."""
    return len(os.listdir(f'/proc/{process}/fd'))


def somewhere(random: Random, robot: Vector) -> Vector:
    """Return where a brick is to fall (m): from near the robot to somewhat out of reach."""
    while True:
        height, way = random.uniform(*HEIGHTS), random.uniform(-pi, pi)
        distance = random.uniform(0.0, 1.2) * guaranteed_distance(height, PARAMETERS)
        x, y = robot[0] + distance * cos(way), robot[1] + distance * sin(way)
        if EDGE < x < ARENA_SIZE - EDGE and EDGE < y < ARENA_SIZE - EDGE:
            return (x, y, height)


def soak(scene: Any, seconds: float, every: float, watch: Any) -> list[str]:
    """
    Drop a brick again and again, whatever the robot is doing.

    :param scene: the graph
    :param seconds: how long (s)
    :param every: time (s) from one drop to the next
    :param watch: knows when the machine stood still
    :return: What went wrong, in words.
    """
    seen = scene.spectator
    faults: list[str] = []
    counts = dict.fromkeys(('drops', 'caught', 'unreachable', 'on the ground'), 0)
    samples: dict[str, list[tuple[float, float, int]]] = {name: [] for name in scene.names}
    begin = monotonic()
    while (start := monotonic()) < begin + seconds:
        place = somewhere(scene.random, seen.see('platform').position)
        scene.place(*place)
        before = seen.see('platform').position
        scene.graph.spin_for(0.2)
        robot = seen.see('platform').position
        at_rest = dist(robot, before) < 1e-3 and scene.is_level()
        distance = dist(robot[:2], place[:2])
        verdicts, goals = seen.verdicts, len(seen.sent)
        scene.drop()
        scene.until(lambda: seen.phase in (Phase.RIDING, Phase.GROUNDED), 10.0,
                    'the brick is down')
        caught = seen.phase is Phase.RIDING
        refused = seen.verdicts > verdicts
        promised = any(dist(goal, place[:2]) < 1e-6 for goal in seen.sent[goals:])
        counts['drops'] += 1
        counts['caught'] += caught
        counts['unreachable'] += refused
        counts['on the ground'] += not caught
        wrong = ''
        if promised and not caught:
            wrong = 'said to be reachable, but missed'
        elif refused and at_rest and distance <= guaranteed_distance(place[2], PARAMETERS):
            wrong = 'refused within the promised distance'
        elif refused == promised:
            wrong = 'said to be both, reachable and not' if refused else 'not seen to fall'
        if wrong:
            stall = watch.longest(start)
            faults.append(
                '{:.0f} s: brick ({:.2f}, {:.2f}, {:.2f}), '.format(start - begin, *place)
                + f'{distance:.2f} m from the robot{" at rest" if at_rest else ""}: {wrong}'
                + (f'; the machine stood still for {stall:.2f} s' if stall else ''))
            print(f'  {faults[-1]}', flush=True)
        scene.check()
        for name, process in scene.processes.items():
            samples[name].append(
                (monotonic() - begin, memory(process.pid), open_files(process.pid)))
        scene.graph.spin_for(max(start + every - monotonic(), 0.0))
    print('\n' + ', '.join(f'{number} {name}' for name, number in counts.items())
          + f'; broken promises: {len(faults)}; the machine stood still '
          + f'{len(watch.stalls(begin))} times, {watch.longest(begin):.2f} s '
          'at most')
    print(f'{"after the first 2 min":24s}{"MB":>9s}{"MB in the end":>15s}{"MB/min":>10s}'
          f'{"open files":>12s}')
    for name, taken in samples.items():
        taken = [sample for sample in taken if sample[0] >= WARM_UP] or taken[-1:]
        growth = 0.0 if len(taken) < 2 else linear_regression(
            [time / 60.0 for time, _, _ in taken], [size for _, size, _ in taken]).slope
        files = sorted({count for *_, count in taken})
        print(f'{name:24s}{taken[0][1]:9.2f}{taken[-1][1]:15.2f}{growth:10.3f}'
              f'{"-".join(map(str, files)):>12s}')
        if growth > GROWTH and taken[-1][0] - taken[0][0] > TELLING:
            faults.append(f'{name} grows by {growth:.3f} MB/min')
        if len(files) > 1:
            faults.append(f'{name} has had {files[0]} to {files[-1]} files open')
    return faults
