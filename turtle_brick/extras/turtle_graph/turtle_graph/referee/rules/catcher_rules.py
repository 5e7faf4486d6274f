# SPDX-License-Identifier: Apache-2.0
"""Rules for the catcher: its verdicts, the text "Unreachable", and what it does with a brick."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from math import dist, inf
from typing import Any

from turtle_graph.client.drops import DropWatch, LEVEL, says_unreachable, UNREACHABLE
from turtle_graph.client.geometry import CENTER, inclination
from turtle_graph.client.messages import nanoseconds_of, SECONDS_PER_NS
from turtle_graph.client.record import ReceivedMarker, Record
from turtle_graph.referee.rules.arena_rules import ADD, catches, dropped, TEXT
from turtle_graph.referee.rules.robot_rules import IMPRECISION
from turtle_graph.referee.rules.rule import (Failed, Finding, from_faults, Open, require_data,
                                             Rules, within)

RULES = Rules(node='catcher')
rule = RULES.rule

DELETE_ACTIONS = 2, 3
"""The marker actions DELETE and DELETEALL."""
LIFETIME, LIFETIME_TOLERANCE = 3.0, 0.3
"""Required lifetime (s) of the "Unreachable" marker, and its tolerance (s)."""
CENTER_DISTANCE = 0.1
"""Maximum distance (m) between the robot and the arena center when the robot tips a brick off."""


def completed(record: Record, is_relevant: Callable[[DropWatch], Any]) -> list[DropWatch]:
    """Return all completed drops that satisfy `is_relevant`, or raise Open if there are none."""
    # A catcher may be busy with the previous brick.
    busy = {id(later) for drop, later in pairwise(record.whole.drops)
            if drop.caught and not drop.leveled}
    landed = [drop for drop in dropped(record) if drop.down is not None and id(drop) not in busy]
    require_data(landed, 'no brick has landed')
    return require_data([drop for drop in landed if is_relevant(drop)],
                        'no brick landed in a drop that tests this requirement')


def name_of(drop: DropWatch) -> str:
    """Return the starting position of a dropped brick as text."""
    return '({:.2f}, {:.2f}, {:.2f})'.format(*drop.place)


def judge_drops(record: Record, is_relevant: Callable[[DropWatch], Any],
                fault_of: Callable[[DropWatch], str], items: str) -> Finding:
    """
    Judge the completed drops that satisfy `is_relevant`.

    :param fault_of: function that returns what is wrong with a drop, or ''
    """
    drops = completed(record, is_relevant)
    faults = [fault for fault in map(fault_of, drops) if fault]
    judged = {drop.place for drop in drops}
    unjudged = [drop for drop in completed(record.whole, is_relevant) if drop.place not in judged]
    if not faults and any(map(fault_of, unjudged)):
        raise Open('a drop that was not calm has a fault')
    return from_faults(faults, len(drops), items)


@rule('verdict: in time', 'it first computes … whether it can reach the brick on-time',
      'a goal or "Unreachable" is published before the brick lands', needs_calm=True)
def verdicts_come_in_time(record: Record) -> Finding:
    # If the brick falls onto a robot at rest, neither a goal nor "Unreachable" is required.
    return judge_drops(record, lambda drop: drop.decided is not None or not drop.caught,
                       partial(verdict_fault, record), 'in time')


def verdict_fault(record: Record, drop: DropWatch) -> str:
    """Return what is wrong with the time of the verdict on a brick, or ''."""
    begin, requested = drop.begin, drop.requested or 0
    before = [*(request.begin for request in record.whole.places),
              *(earlier.end for earlier in record.whole.drops)]
    placed = max((time for time in before if time < begin), default=begin)
    early = [received for received in record.markers if placed <= received.published < requested
             and says_unreachable(received.marker) and received.marker.action == ADD]
    if early or record.messages('goal_pose', begin, drop.requested):
        return f'{name_of(drop)} was judged before it fell'
    if drop.decided is None:
        return f'no verdict on {name_of(drop)}'
    late = (drop.decided - (drop.down or 0)) * SECONDS_PER_NS
    return f'{late:.3f} s late on {name_of(drop)}' if late >= 0.0 else ''


@rule('verdict: kept', 'If the brick cannot be caught … If the brick can be caught …',
      'a brick is caught if and only if it was not called Unreachable',
      ['verdict: in time', 'verdict: out of reach', 'verdict: in reach'], needs_calm=True)
def verdicts_come_true(record: Record) -> Finding:
    def fault_of(drop: DropWatch) -> str:
        if drop.caught and drop.refusals:
            return f'{name_of(drop)} was refused but caught'
        if not drop.caught and not drop.refusals:
            return f'{name_of(drop)} was missed but not refused'
        return ''

    return judge_drops(record, lambda drop: True, fault_of, 'bricks')


def texts(record: Record) -> list[ReceivedMarker]:
    """Return all "Unreachable" markers, or raise Open if there are none."""
    return require_data([received for received in record.markers
                         if says_unreachable(received.marker)], 'no marker says Unreachable')


@rule('text: kind', 'the node publishes a Text marker … that says "Unreachable"',
      'a marker of type TEXT_VIEW_FACING (9) with the text "Unreachable"',
      ['verdict: out of reach'])
def text_is_a_text(record: Record) -> Finding:
    others = {received.marker.text for received in record.markers if received.marker.type == TEXT
              for drop in record.drops if drop.begin < received.published < drop.end}
    if others and not any(says_unreachable(received.marker) for received in record.markers):
        raise Failed(f'no marker says Unreachable, but a text is {", ".join(sorted(others))!r}')
    published = {(received.marker.text, received.marker.type) for received in texts(record)}
    measured = ', '.join(f'{text!r} of type {kind}' for text, kind in sorted(published))
    return Finding(published == {(UNREACHABLE, TEXT)}, measured)


def visible_until(record: Record, text: ReceivedMarker) -> float:
    """Return the time (ns) of a text marker's expiration or deletion, or infinity."""
    expired = text.published + (nanoseconds_of(text.marker.lifetime) or inf)
    ends = [received.published for received in record.markers
            if received.topic == text.topic and received.published > text.published
            and removes(received.marker, text.marker)]
    return min([expired, *ends])


def removes(marker: Any, text: Any) -> bool:
    """Return whether a marker on the same topic deletes a text marker or replaces the text."""
    return marker.action in DELETE_ACTIONS or (
        (marker.ns, marker.id) == (text.ns, text.id) and not says_unreachable(marker))


def is_text_visible(record: Record, time: int) -> bool:
    """Return whether, at a time (ns), an "Unreachable" marker is neither expired nor deleted."""
    for received in reversed(record.markers):
        if says_unreachable(received.marker) and received.marker.action == ADD:
            return visible_until(record, received) > time
    return False


def visible_time(record: Record, group: list[ReceivedMarker]) -> float:
    """Return how long (s) the text of repeated markers is visible."""
    return (visible_until(record, group[-1]) - group[0].published) * SECONDS_PER_NS


@rule('text: time', 'a Text marker that lasts for 3 seconds',
      f'{LIFETIME:g} s ± {LIFETIME_TOLERANCE} s, once per fall', ['text: kind'], needs_calm=True)
def text_lasts(record: Record) -> Finding:
    require_data(record.drops, 'nothing was dropped')
    end = max(end for _, end in record.whole.trial_spans())
    added = [text for text in texts(record) if text.marker.action == ADD]
    groups = [(drop, texts_about(record, drop, added)) for drop in record.drops]
    # At the end of an interrupted record, a short text may still be repeated.
    groups = require_data(
        [(drop, group) for drop, group in groups if group and (
            visible_until(record, group[-1]) < end or visible_time(record, group) >= LIFETIME)],
        'no text was observed until its end')

    times = [visible_time(record, group) for _, group in groups]
    lifetimes = [lifetime_of(group[-1]) for _, group in groups if len(group) == 1]
    off = [abs(time - LIFETIME) for time in times]
    measured = ', '.join(f'{time:.2f} s' if time < inf else 'without end' for time in times)
    if max(off) > LIFETIME_TOLERANCE and all(
            abs(lifetime_of(text) - LIFETIME) <= LIFETIME_TOLERANCE
            and text.published <= (drop.down or 0) for drop, group in groups for text in group):
        raise Open(f'{measured}: each marker lasts for {LIFETIME:g} s, but it is published again '
                   'during the fall')
    if min(off) > LIFETIME_TOLERANCE and (lifetimes == times or min(times) == inf):
        raise Failed(measured)
    return Finding(max(off) <= LIFETIME_TOLERANCE, measured)


def lifetime_of(text: ReceivedMarker) -> float:
    """Return the lifetime (s) of a marker, or 0 if it is visible until it is deleted."""
    return nanoseconds_of(text.marker.lifetime) * SECONDS_PER_NS


def texts_about(record: Record, drop: DropWatch, added: list[ReceivedMarker]
                ) -> list[ReceivedMarker]:
    """Return the texts that were added between the start of a drop and that of the next one."""
    end = min((later.begin for later in record.whole.drops if later.begin > drop.begin),
              default=inf)
    return [text for text in added if drop.begin <= text.published < end]


@rule('carry', 'the robot drives back to the arena center and tilts the brick off',
      f'the platform is tilted within {CENTER_DISTANCE} m of the center', needs_calm=True)
def bricks_are_carried_to_the_center(record: Record) -> Finding:
    off = []
    for drop in catches(record):
        if drop.carried_to is None:
            return Finding(False, f'{name_of(drop)} was never tilted')
        off.append(dist(drop.carried_to, CENTER))
    return within(CENTER_DISTANCE, off, '', 'at most {:.3f} m from the center with {} bricks',
                  IMPRECISION)


@rule('verdict: out of reach', 'cannot be caught on time, the node publishes a Text marker',
      '"Unreachable" for each brick that no robot could catch',
      ['verdict: in time', 'fall: acceleration'], needs_calm=True)
def unreachable_bricks_are_refused(record: Record) -> Finding:
    return judge_drops(
        record, lambda drop: drop.should_be_caught is False,
        lambda drop: '' if drop.refusals else f'{name_of(drop)} was not refused', 'refused')


@rule('verdict: in reach', 'can be caught on time, the robot drives under the brick',
      'each brick within reach is caught', ['verdict: in time', 'fall: acceleration'],
      needs_calm=True)
def reachable_bricks_are_caught(record: Record) -> Finding:
    def fault_of(drop: DropWatch) -> str:
        if drop.refusals:
            return f'{name_of(drop)} was refused'
        return '' if drop.caught else f'{name_of(drop)} was missed'

    return judge_drops(record, lambda drop: drop.should_be_caught, fault_of, 'caught')


@rule('tip off', 'the robot drives back to the arena center and tilts the brick off',
      'each caught brick leaves the platform', ['carry', 'slide: law', 'tilt'], needs_calm=True)
def caught_bricks_are_tipped_off(record: Record) -> Finding:
    drops = catches(record)
    return from_faults([f'{name_of(drop)} did not leave' for drop in drops
                        if not drop.floated], len(drops), 'tipped off')


@rule('again', 'the turtle to catch a falling brick',
      'the platform is level again, at the latest when the next brick is dropped', needs_calm=True)
def platform_is_leveled(record: Record) -> Finding:
    # After the last drop, the referee does not wait until a slow catcher levels the platform.
    last = record.whole.drops[-1:]
    drops = completed(record, lambda drop: drop.floated and (drop.leveled or drop not in last))
    faults = [f'still tilted after {name_of(drop)}' for drop in drops
              if not drop.leveled and not is_level_at_next_drop(record, drop)]
    return from_faults(faults, len(drops), 'leveled')


def is_level_at_next_drop(record: Record, drop: DropWatch) -> bool:
    """Return whether the platform is level when the next brick is dropped."""
    for later in record.whole.drops:
        if later.begin > drop.begin:
            platform = record.pose('platform', later.begin)
            return platform is not None and inclination(platform) < LEVEL
    return False
