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
"""Rules for the catcher's verdicts, the text "Unreachable" and the drive to the center."""

from collections.abc import Callable
from itertools import pairwise
from math import dist, inf, isnan, sqrt
from typing import Any

from graph_client.drops import DropWatch, UNREACHABLE
from graph_client.geometry import CENTER
from graph_client.profiles import NUMBERS
from graph_client.record import nanoseconds_of, ReceivedMarker, Record, SECONDS_PER_NS
from turtle_referee.rules.arena_rules import ADD, catches, dropped, TEXT
from turtle_referee.rules.rule import (Failed, Finding, from_faults, Plot, require_data, Rules,
                                       Series, within)

RULES = Rules()
rule = RULES.rule

LIFETIME = 3.0
"""Lifetime (s) of the text "Unreachable"."""
LIFETIME_TOLERANCE = 0.3
"""Tolerance (s) for LIFETIME."""
CENTER_DISTANCE = 0.1
"""Maximum distance (m) between the robot and the arena center when the robot tips a brick off."""

DELETE_ACTIONS = (2, 3)
"""The marker actions DELETE and DELETEALL."""


def completed(record: Record, is_relevant: Callable[[DropWatch], Any] = lambda drop: True
              ) -> list[DropWatch]:
    """Return all relevant drops whose brick has landed, or raise Open if there are none."""
    landed = require_data([drop for drop in dropped(record) if drop.down is not None],
                          'no brick has landed')
    return require_data([drop for drop in landed if is_relevant(drop)],
                        'no brick landed in a drop that tests this requirement')


def name_of(drop: DropWatch) -> str:
    """Return the starting position of a dropped brick as text."""
    return '({:.2f}, {:.2f}, {:.2f})'.format(*drop.place)


@rule('verdict: in time', 'it first computes … whether it can reach the brick on-time',
      'a goal or "Unreachable" is published before the brick lands', ['fall: acceleration'])
def verdicts_come_in_time(record: Record) -> Finding:
    # A brick that lands on a platform at rest does not require a verdict.
    drops = completed(record, lambda drop: drop.decided is not None or not drop.caught)
    faults = []
    for drop in drops:
        if drop.decided is None:
            faults.append(f'no verdict on {name_of(drop)}')
        elif (late := (drop.decided - (drop.down or 0)) * SECONDS_PER_NS) >= 0.0:
            faults.append(f'{late:.3f} s late on {name_of(drop)}')
    return from_faults(faults, len(drops), 'in time')


def reach_plot(record: Record) -> Plot:
    """Plot the duration of each fall against the required driving time."""
    numbers, series = {**NUMBERS, **record.profile.numbers}, []
    for label, is_caught in (('caught', True), ('not caught', False)):
        drops = [drop for drop in completed(record)
                 if drop.caught is is_caught and not isnan(drop.distance)]
        distances = [max(drop.distance - numbers['platform_radius'], 0.0) for drop in drops]
        depths = [max(drop.place[2] - numbers['platform_height'], 0.0) for drop in drops]
        series.append(Series(label, [distance / numbers['max_velocity'] for distance in distances],
                             [sqrt(2.0 * depth / numbers['gravity_accel']) for depth in depths]))
    longest = max((value for one in series for value in (*one.x, *one.y)), default=1.0)
    return Plot('Reach', 'driving time at max_velocity (s)', 'fall time (s)', series,
                Series('physically possible above', [0.0, longest], [0.0, longest]))


@rule('verdict: kept', 'If the brick cannot be caught … If the brick can be caught …',
      'a brick is caught if and only if it was not called Unreachable',
      ['verdict: out of reach', 'verdict: in reach'])
def verdicts_come_true(record: Record) -> Finding:
    drops = completed(record)
    return from_faults([
        f'{name_of(drop)} was {"refused but caught" if drop.caught else "missed but not refused"}'
        for drop in drops if bool(drop.refusals) is drop.caught], len(drops), 'bricks',
        reach_plot(record))


def texts(record: Record) -> list[ReceivedMarker]:
    """Return the "Unreachable" markers, or raise Failed or Open if there are none."""
    found = [received for received in record.markers
             if UNREACHABLE.lower() in received.marker.text.lower()]
    if not found and any(drop.should_be_caught is False for drop in completed(record)):
        raise Failed('no marker says Unreachable')
    return require_data(found, 'no brick was out of reach')


@rule('text: kind', 'the node publishes a Text marker … that says "Unreachable"',
      'a marker of type TEXT_VIEW_FACING (9) with the text "Unreachable"',
      ['verdict: out of reach'])
def text_is_a_text(record: Record) -> Finding:
    published = {(received.marker.text, received.marker.type) for received in texts(record)}
    found = ', '.join(f'{text!r} of type {kind}' for text, kind in sorted(published))
    return Finding(published == {(UNREACHABLE, TEXT)}, found)


def visible_time(record: Record, published: list[ReceivedMarker]) -> float:
    """Return the time (s) between the first marker and the expiry or deletion of the text."""
    first, last = published[0], published[-1]
    deleted = [received.published for received in record.markers if received.topic == last.topic
               and received.marker.action in DELETE_ACTIONS
               and received.published > first.published]
    end = last.published + (nanoseconds_of(last.marker.lifetime) or inf)
    return (min([end, *deleted]) - first.published) * SECONDS_PER_NS


@rule('text: time', 'a Text marker that lasts for 3 seconds',
      f'{LIFETIME:g} s ± {LIFETIME_TOLERANCE} s, once per fall', ['text: kind'])
def text_lasts(record: Record) -> Finding:
    begins = [*(drop.begin for drop in require_data(record.drops, 'nothing was dropped')), inf]
    texts_per_fall = [[received for received in texts(record)
                       if begin <= received.published < end and received.marker.action == ADD]
                      for begin, end in pairwise(begins)]
    times = [visible_time(record, published) for published in texts_per_fall if published]
    met = all(abs(time - LIFETIME) <= LIFETIME_TOLERANCE for time in times)
    return Finding(bool(times) and met, ', '.join(f'{time:.2f}' for time in times) + ' s')


@rule('carry', 'the robot drives back to the arena center and tilts the brick off',
      f'the platform is tilted within {CENTER_DISTANCE} m of the center',
      ['drive: goal', 'brick: rides'])
def bricks_are_carried_to_the_center(record: Record) -> Finding:
    off = []
    for drop in catches(record):
        if drop.carried_to is None:
            raise Failed(f'{name_of(drop)} was never tilted')
        off.append(dist(drop.carried_to, CENTER))
    return within(CENTER_DISTANCE, off, '', 'at most {:.3f} m from the center in {} catches')


@rule('verdict: out of reach', 'cannot be caught on time, the node publishes a Text marker',
      '"Unreachable" for each brick that no robot could catch', ['verdict: in time'])
def unreachable_bricks_are_refused(record: Record) -> Finding:
    drops = completed(record, lambda drop: drop.should_be_caught is False)
    return from_faults([f'{name_of(drop)} was not refused' for drop in drops
                        if not drop.refusals], len(drops), 'refused')


@rule('verdict: in reach', 'can be caught on time, the robot drives under the brick',
      'each brick within reach is caught', ['verdict: in time', 'drive: goal'])
def reachable_bricks_are_caught(record: Record) -> Finding:
    drops = completed(record, lambda drop: drop.should_be_caught)
    return from_faults([
        f'{name_of(drop)} was {"refused" if drop.refusals else "missed"}' for drop in drops
        if drop.refusals or not drop.caught], len(drops), 'caught')


@rule('tip off', 'the robot drives back to the arena center and tilts the brick off',
      'each caught brick leaves the platform', ['carry', 'slide: law', 'tilt'])
def caught_bricks_are_tipped_off(record: Record) -> Finding:
    drops = catches(record)
    return from_faults([f'{name_of(drop)} did not leave' for drop in drops
                        if not drop.floated], len(drops), 'tipped off')


@rule('again', 'the turtle to catch a falling brick',
      'the platform is level again after each brick', ['tip off'])
def platform_is_leveled(record: Record) -> Finding:
    drops = completed(record, lambda drop: drop.floated)
    return from_faults([f'still tilted after {name_of(drop)}' for drop in drops
                        if not drop.leveled], len(drops), 'leveled')
