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
"""The rules for the catcher: its verdict, the text, the way to the center. No ROS."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from math import dist, inf, isnan, sqrt
from typing import Any

from turtle_referee.graph_client.constants import AT_CENTER, CENTER, LIFETIME, SECONDS_PER_NS, SHOWN, UNREACHABLE
from turtle_referee.graph_client.drops import DropWatch
from turtle_referee.graph_client.profile import NUMBERS
from turtle_referee.graph_client.record import ReceivedMarker, nanoseconds_of, Record
from turtle_referee.rules.arena_rules import ADD, catches, dropped, TEXT
from turtle_referee.rules.rule import from_faults, Broken, Finding, Plot, Rules, Series, require_data, within

RULES = Rules()
rule = RULES.rule

REMOVES = (2, 3)  # the actions of a marker that remove it, and all


def completed(record: Record) -> list[DropWatch]:
    """Return the bricks that were let go and have come down; Open if none has."""
    return require_data([drop for drop in dropped(record) if drop.down is not None],
                'no brick has come down')


def name_of(drop: DropWatch) -> str:
    """Return which drop it was."""
    return '({:.2f}, {:.2f}, {:.2f})'.format(*drop.place)


@rule('verdict: in time', 'it first computes … whether it can reach the brick on-time',
      ['fall: acceleration'])
def verdicts_come_in_time(record: Record) -> Finding:
    """Expect goal or text before the brick is down."""
    # Who has the brick come down on a platform below it need not say anything.
    drops = require_data([drop for drop in completed(record) if drop.decided is not None
                  or not drop.caught], 'no verdict was needed')
    late = [((drop.decided or inf) - (drop.down or 0)) * SECONDS_PER_NS for drop in drops]
    return from_faults([
        f'{"no verdict" if time == inf else f"{time:.3f} s late"} on {name_of(drop)}'
        for drop, time in zip(drops, late) if time >= 0.0], len(drops), 'in time')


def reach_plot(record: Record) -> Plot:
    """Return what was caught and what was not, over the way and the time for it."""
    numbers, series = {**NUMBERS, **record.profile.numbers}, []
    for words, is_caught in (('caught', True), ('not caught', False)):
        drops = [drop for drop in completed(record)
                 if drop.caught is is_caught and not isnan(drop.distance)]
        series.append(Series(
            words, [max(drop.distance - numbers['platform_radius'], 0.0) / numbers['max_velocity']
                    for drop in drops],
            [sqrt(max(2.0 * (drop.place[2] - numbers['platform_height']), 0.0)
                  / numbers['gravity_accel']) for drop in drops]))
    longest = max((value for one in series for value in (*one.x, *one.y)), default=1.0)
    return Plot('Reach', 'time for the way at max_velocity (s)', 'time of the fall (s)', series,
                Series('physically possible above', [0.0, longest], [0.0, longest]))


@rule('verdict: kept', 'If the brick cannot be caught … If the brick can be caught …',
      ['verdict: out of reach', 'verdict: in reach'])
def verdicts_come_true(record: Record) -> Finding:
    """Expect what is called Unreachable not to be caught, and all else."""
    drops = completed(record)
    return from_faults([
        f'{name_of(drop)} {"refused, but caught" if drop.caught else "missed silently"}'
        for drop in drops if bool(drop.refusals) is drop.caught], len(drops),
        plot=reach_plot(record))


def texts(record: Record) -> list[ReceivedMarker]:
    """Return the markers that say it; Broken or Open if there are none."""
    found = [heard for heard in record.markers if UNREACHABLE.lower() in heard.marker.text.lower()]
    if not found and any(drop.should is False for drop in completed(record)):
        raise Broken('nobody said Unreachable')
    return require_data(found, 'no brick was out of reach')


@rule('text: kind', 'the node publishes a Text marker … that says "Unreachable"',
      ['verdict: out of reach'])
def text_is_a_text(record: Record) -> Finding:
    """Expect TEXT_VIEW_FACING, and "Unreachable"."""
    said = {(heard.marker.text, heard.marker.type) for heard in texts(record)}
    return Finding(said == {(UNREACHABLE, TEXT)}, ', '.join(
        f'{text!r} of type {kind}' for text, kind in sorted(said)))


def seconds_shown(record: Record, shown: list[ReceivedMarker]) -> float:
    """Return how long (s) a text was to be seen that was said, and perhaps repeated or removed."""
    first, last = shown[0], shown[-1]
    removed = [heard.published for heard in record.markers if heard.topic == last.topic
               and heard.marker.action in REMOVES and heard.published > first.published]
    end = last.published + (nanoseconds_of(last.marker.lifetime) or inf)
    return (min([end, *removed]) - first.published) * SECONDS_PER_NS


@rule('text: time', 'a Text marker that lasts for 3 seconds', ['text: kind'])
def text_lasts(record: Record) -> Finding:
    """Expect {LIFETIME:g} s ± {SHOWN} s for each fall, once."""
    begins = [*(drop.begin for drop in require_data(record.drops, 'nothing was dropped')), inf]
    falls = [[heard for heard in texts(record)
              if begin <= heard.published < end and heard.marker.action == ADD]
             for begin, end in pairwise(begins)]
    times = [seconds_shown(record, shown) for shown in falls if shown]
    return Finding(bool(times) and all(abs(time - LIFETIME) <= SHOWN for time in times),
                   ', '.join(f'{time:.2f}' for time in times) + ' s')


@rule('carry', 'the robot drives back to the arena center and tilts the brick off',
      ['drive: goal', 'brick: rides'])
def bricks_are_carried_to_the_center(record: Record) -> Finding:
    """Expect a tilt within {AT_CENTER} m of the center."""
    off = []
    for drop in catches(record):
        if drop.carried_to is None:
            raise Broken(f'{name_of(drop)} was never tilted')
        off.append(dist(drop.carried_to, CENTER))
    return within(AT_CENTER, off, '')


def judge_drops(which: Callable[[DropWatch], Any], fault: Callable[[DropWatch], str],
                record: Record) -> Finding:
    """Judge some of the bricks, by what is wrong with each."""
    drops = require_data([drop for drop in completed(record) if which(drop)], 'there was no such brick')
    return from_faults([f'{name_of(drop)} {fault(drop)}' for drop in drops if fault(drop)], len(drops))


for name, words, law, rests_on, which, fault in (
        ('verdict: out of reach', 'cannot be caught on time, the node publishes a Text marker',
         '"Unreachable" for each brick that nobody could catch', ['verdict: in time'],
         lambda drop: drop.should is False, lambda drop: '' if drop.refusals else 'not'),
        ('verdict: in reach', 'can be caught on time, the robot drives under the brick',
         'each brick within reach is caught', ['verdict: in time', 'drive: goal'],
         lambda drop: drop.should,
         lambda drop: 'refused' if drop.refusals else '' if drop.caught else 'missed'),
        ('tip off', 'the robot drives back to the arena center and tilts the brick off',
         'each caught brick leaves the platform', ['carry', 'slide: law', 'tilt'],
         lambda drop: drop.caught, lambda drop: '' if drop.floated else 'not'),
        ('again', 'the turtle to catch a falling brick',
         'level again after each brick, ready for the next', ['tip off'],
         lambda drop: drop.floated, lambda drop: '' if drop.leveled else 'still tilted')):
    rule(name, words, rests_on, law)(partial(judge_drops, which, fault))
