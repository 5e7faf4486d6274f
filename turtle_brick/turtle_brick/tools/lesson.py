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
lesson: the numbers and figures of the lesson in doc/lesson, made anew.

Five parts, each a page there: frames, rolling, falling, queue and reach. Each prints its numbers,
computed from config/turtle.yaml or the file that --params-file names, and draws its figure,
lesson-<part>.png.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from math import degrees, e, hypot, pi
from pathlib import Path
import sys

from turtle_brick.core.geometry import Pose2D
from turtle_brick.core.parameters import load, ParameterError, Parameters
from turtle_brick.core.reachability import fall_time, guaranteed_distance, resting_height
from turtle_brick.core.turtlesim_kinematics import TICK
from turtle_brick.tools import lesson_laws as laws
from turtle_brick.tools.measuring import percentile


def tell_frames(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the first part."""
    _, stops = laws.frames(parameters)
    yield ' ' * 9 + 'in world: x       y   theta    in odom: x       y   theta    distance'
    for name, stop, before in zip('SABC', stops, (None, *stops)):
        yield (f'  at {name}  {_pose(stop.world)}       {_pose(stop.odom)}'
               + (f'  {_distance(stop.world, before.world):6.3f} = '
                  f'{_distance(stop.odom, before.odom):.3f} m' if before else ''))


def _pose(pose: Pose2D) -> str:
    # Rounding must leave no sign on a zero.
    return (f'{round(pose.x, 3) + 0.0:8.3f} {round(pose.y, 3) + 0.0:7.3f} '
            f'{round(degrees(pose.yaw), 1) + 0.0:5.1f}°')


def _distance(one: Pose2D, other: Pose2D) -> float:
    return hypot(one.x - other.x, one.y - other.y)


def tell_rolling(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the second part."""
    rolls = laws.rolling(parameters)
    radius, speed = parameters.wheel_radius, parameters.max_velocity
    yield f'  wheel_radius {radius:g} m: one turn is {2.0 * pi * radius:.3f} m'
    yield (f'  at {speed:g} m/s: {speed / radius:.2f} rad/s, {speed / (2.0 * pi * radius):.2f} '
           f'turns per second, {degrees(speed / radius * TICK):.1f}° per tick of turtlesim')
    yield '                                     commanded   between poses   wheel'
    for what, time in (('after 1 s of driving', 1.2), ('after the teleport', 2.3),
                       ('after 1.5 s towards a wall 1 s away', 4.4)):
        roll = next(roll for roll in rolls if roll.time >= time)
        yield (f'  {what:35}{roll.commanded:9.3f} m{roll.seen:13.3f} m'
               f'{roll.rolled:9.3f} m = {roll.rolled / radius:.2f} rad')


def tell_falling(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the third part."""
    fall, slide = laws.falling(parameters), laws.sliding(parameters)
    fallen = fall[:-1]  # the last place is that of the brick at rest
    exact = fall_time(fall[0].brick[2], parameters)
    speed = parameters.gravity_accel * exact
    error = max(abs(place.brick[2] - laws.closed_fall(place.time, parameters)) for place in fallen)
    sums = laws.summed(len(fallen), parameters)[len(fallen) - 1]
    yield (f'  from {fall[0].brick[2]:g} m down to {resting_height(parameters):g} m: '
           f'{exact:.4f} s, then at {speed:.2f} m/s; landed at step {len(fall) - 1}, '
           f'{fall[-1].time:.3f} s')
    yield (f'  largest distance from the closed form: {1e3 * error:.3f} mm; summed by Euler: '
           f'{1e3 * (sums - fallen[-1].brick[2]):.1f} mm')
    yield f'  a stamp that is wrong by 1 ms is a height that is wrong by {speed:.1f} mm'
    gone = [laws.along_slope(place, parameters) for place in slide]
    error = max(abs(distance - laws.closed_slide(place.time, parameters))
                for distance, place in zip(gone, slide))
    rim = parameters.platform_radius
    clear = rim + parameters.brick_size[0] / 2.0
    yield (f'  slide at {degrees(parameters.tilt_angle):.1f}°: {rim:g} m (center at the rim) in '
           f'{laws.slide_time(rim, parameters):.4f} s, {clear:g} m (brick clear) in '
           f'{laws.slide_time(clear, parameters):.4f} s;')
    yield f'  clear at step {len(slide)}, {slide[-1].time:.3f} s, {gone[-1]:.3f} m'
    yield f'  largest distance from the closed form: {1e3 * error:.3f} mm'


def tell_queue(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the fourth part."""
    every = [sent for phase in range(16) for sent in laws.commands(1e-3 * phase + 1e-4)]
    latencies = sorted(1e3 * sent.latency for sent in every)
    median = percentile(latencies, 0.5)
    taken = sum(sent.taken for sent in every) / len(every)
    yield f'  of the commands turtlesim takes {100.0 * taken:.1f} %'
    yield (f'  from publishing one to the pose that shows it, or a newer one: '
           f'{latencies[0]:.0f} to {latencies[-1]:.0f} ms, median {median:.0f} ms')
    yield (f'  at {parameters.max_velocity:g} m/s that is '
           f'{0.1 * parameters.max_velocity * median:.0f} cm of motion')
    yield (f'  a delay of {median:.0f} ms has a proportional controller overshoot above '
           f'{1e3 / (e * median):.1f} per second,')
    yield f'  and swing for ever above {1e3 * pi / (2.0 * median):.1f} per second'
    yield (f'  {laws.WAY:g} m to drive:                overshoot   '
           f'within {100.0 * laws.NEAR:g} cm for good')
    for name, driver in laws.controllers(parameters).items():
        seen = laws.approach(driver, parameters)
        settled = max(time for time, beyond in seen if abs(beyond) > laws.NEAR)
        yield (f'    {name:31}{100.0 * max(max(beyond for _, beyond in seen), 0.0):6.1f} cm'
               + (f'{settled:13.2f} s' if settled < seen[-1][0] - 0.1 else '        never'))


def tell_reach(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of the fifth part."""
    drops = laws.reaching(parameters)
    count = {outcome: sum(drop.outcome == outcome for drop in drops)
             for outcome in ('caught', 'refused', 'missed')}
    yield f'  {len(drops):,} drops: ' + ', '.join(
        f'{number:,} {outcome}' for outcome, number in count.items())
    yield '  from       fall    a catch is promised to    and found to'
    for height in laws.SAMPLES:
        fall = fall_time(height, parameters)
        yield (f'  {height:4g} m{fall:8.3f} s{guaranteed_distance(height, parameters):16.2f} m'
               f'{laws.farthest_caught(height, parameters):20.2f} m')
    yield '  at worst, from the release to the first motion:'
    for what, time in laws.STEPS_OF_LATENCY:
        yield f'    {what:32}{1e3 * time:6.1f} ms'
    yield f'    {"in all":32}{1e3 * sum(time for _, time in laws.STEPS_OF_LATENCY):6.1f} ms'


PARTS: dict[str, Callable[[Parameters], Iterator[str]]] = {
    'frames': tell_frames,
    'rolling': tell_rolling,
    'falling': tell_falling,
    'queue': tell_queue,
    'reach': tell_reach,
}


def part(name: str) -> str:
    """Return the name of a part as it was typed, or refuse it."""
    if name not in PARTS:
        raise argparse.ArgumentTypeError(f'{name!r} is none of {", ".join(PARTS)}')
    return name


def main(args: Sequence[str] | None = None) -> int:
    """Print and draw the parts that are asked for; return the exit status."""
    first, second = (__doc__ or '').strip().split('\n\n')[:2]
    parser = argparse.ArgumentParser(
        prog='lesson', description=first.partition(': ')[2].capitalize(), epilog=second)
    parser.add_argument('parts', nargs='*', type=part, metavar='PART',
                        help=f'{", ".join(PARTS)} (default: all)')
    parser.add_argument('--params-file', type=Path, metavar='FILE',
                        help='the parameters (default: config/turtle.yaml of the package)')
    parser.add_argument('--output', type=Path, default=Path('lesson'), metavar='DIR',
                        help='where the figures go (default: lesson)')
    options = parser.parse_args(args)
    try:
        parameters = load(options.params_file)
        if resting_height(parameters) >= min(parameters.brick_start[2], laws.SAMPLES[0]):
            raise ParameterError(
                f'platform_height {parameters.platform_height:g} m is too high for this lesson: '
                f'a brick falls from {laws.SAMPLES[0]:g} m, and from that of brick_start')
        for name in options.parts or PARTS:
            print(f'{name}:', *PARTS[name](parameters), sep='\n', flush=True)
            draw(name, parameters, options.output)
    except (OSError, ParameterError) as error:
        print(f'lesson: {error}', file=sys.stderr)
        return 2
    return 0


def draw(name: str, parameters: Parameters, directory: Path) -> None:
    """
    Draw the figure of a part, if matplotlib is here.

    :param name: the part's
    :param parameters: the physical numbers
    :param directory: where the figure goes; made if it is not there
    :raises OSError: it cannot be written
    """
    if find_spec('matplotlib') is None:
        print('  no figure: it needs matplotlib (apt: python3-matplotlib, pip: matplotlib)')
        return
    from turtle_brick.tools import lesson_figures
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / f'lesson-{name}.png'
    getattr(lesson_figures, name)(parameters, path)
    print(f'  {path}', flush=True)


if __name__ == '__main__':
    sys.exit(main())
