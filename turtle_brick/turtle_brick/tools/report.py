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

"""What the benchmark has found, as a text, as JSON and as a figure."""

from collections.abc import Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from turtle_brick.arena import STEP
from turtle_brick.tools.measuring import Drift, Spread, spread
from turtle_brick.tools.processes import FOREIGN, OURS

OTHERS = 0.05
"""Cores in use by other programs from which on the numbers are worth little."""


def report(found: dict[str, Any]) -> str:
    """
    Make a table of what was found.

    :param found: by `Benchmark.run`
    :return: The text for the terminal.
    """
    what = found['machine']
    lines = [
        f'turtle_brick {what["turtle_brick"]} on {what["cores"]} cores of {what["processor"]}, '
        f'Python {what["python"]}, rclpy {what["rclpy"]},',
        f'{what["middleware"]}, turtlesim {what["turtlesim"]}, '
        f'robot_state_publisher {what["robot_state_publisher"]}, {what["date"]}',
        f'{found["seconds"]:g} s per window; other programs used {found["others_cores"]:.2f} '
        'cores at most' + (
            ': TOO MUCH for numbers that are worth something'
            if found['others_cores'] > OTHERS else ''),
        f'the host of this virtual machine kept {found["stolen_cores"]:.3f} cores for itself',
        '', 'processor time, % of a core      idle  catching     floor  idle/floor   peak memory']

    def usage(name: str, which: Sequence[str], run: dict[str, Any]) -> str:
        idle, catching, floor = (sum(cores[one] for one in which) for cores in (
            run['idle'], run['catching'], run['floor']['cores']))
        most = sum(run['memory'][one] for one in which)
        return (f'  {name:26}{100 * idle:9.1f}{100 * catching:10.1f}{100 * floor:10.1f}'
                f'{idle / floor:12.2f}{most / 2 ** 20:11.0f} MB')

    run = found['processes']
    for name in (*OURS, *FOREIGN):
        lines.append(usage(name, [name], run))
    lines.append(usage('the three of ours', OURS, run))
    lines.append(usage('all five', [*OURS, *FOREIGN], run))
    run = found['composed']
    count = 5 - sum(name in run['idle'] for name in FOREIGN)
    lines.append(usage(f'{count} in one process', ['composed'], run))

    for name in ('processes', 'composed'):
        run = found[name]
        lines += ['', f'intervals, ms ({name})     nominal     mean      p01      p50      p99'
                  '      max   with two busy loops: p99      max']
        for topic, found_spread in run['intervals'].items():
            nominal = STEP * 1e-6 if topic.startswith('world') else 10.0
            busy = run['intervals_busy'][topic]
            lines.append(
                f'  {topic:26}{nominal:6.1f}{1e3 * found_spread.mean:9.3f}'
                f'{1e3 * found_spread.p01:9.3f}{1e3 * found_spread.p50:9.3f}'
                f'{1e3 * found_spread.p99:9.3f}{1e3 * found_spread.maximum:9.2f}'
                f'{1e3 * busy.p99:27.3f}{1e3 * busy.maximum:9.2f}')
        idle, busy = run['drift'], run['drift_busy']
        lines.append(
            f'  drift of the physics: {idle.total} steps of {idle.steps:,} '
            f'(published at most {1e3 * idle.latest:.1f} ms late), '
            f'with two busy loops {busy.total} of {busy.steps:,} ({1e3 * busy.latest:.1f} ms)')

    for name in ('processes', 'composed'):
        counts = ', '.join(f'{count} {outcome}'
                           for outcome, count in sorted(found[name]['outcomes'].items()))
        lines.append(f'  drops, all within reach ({name}): {counts}')
    lines += ['', f'latency from the release, ms ({found["drops"]} drops)     '
              'processes: p50      p01      p99    composed: p50      p01      p99']
    for name, words in (('decided', 'decision (goal published)'),
                        ('commanded', 'first command to move'),
                        ('moved', 'first motion (pose of turtlesim)'),
                        ('known', 'first motion in TF')):
        row = f'  {words:38}'
        for run, width in (('processes', 22), ('composed', 17)):
            of = spread([links[name] for links in found[run]['latency']])
            row += f'{1e3 * of.p50:{width}.1f}{1e3 * of.p01:9.1f}{1e3 * of.p99:9.1f}'
        lines.append(row)

    return '\n'.join(lines)


def plain(value: Any) -> Any:
    """Return a value as JSON can hold it, numbers to seven digits."""
    if isinstance(value, (Spread, Drift)):
        return plain(asdict(value))
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return float(f'{value:.7g}') if isinstance(value, float) else value


def draw(found: dict[str, Any], path: Path) -> None:
    """Make the figure of the chain from release to motion, if matplotlib is there."""
    if find_spec('matplotlib') is None:
        print('No figure: it needs matplotlib (apt: python3-matplotlib, pip: matplotlib).')
        return
    from turtle_brick.tools.plots import latency
    latency(found['processes']['latency'], path)
    print(path)
