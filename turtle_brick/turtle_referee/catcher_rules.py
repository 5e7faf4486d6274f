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

from math import dist, isnan, nan, sqrt

from turtle_referee.arena_rules import ADD, catches, dropped, TEXT
from turtle_referee.constants import AT_CENTER, CENTER, LIFETIME, NANO, SHOWN, UNREACHABLE
from turtle_referee.drops import DropWatch
from turtle_referee.record import MarkerHeard, Record
from turtle_referee.rules import Broken, Finding, number, Open, Plot, Rules, Series, some

RULES = Rules()
rule = RULES.rule

DELETE, DELETEALL = 2, 3
"""The actions of a marker that remove it, and all."""


def completed(record: Record) -> list[DropWatch]:
    """Return the bricks that were let go and have come down; Open or Broken if none has."""
    return some([drop for drop in dropped(record) if drop.down is not None],
                'no brick has come down')


def name_of(drop: DropWatch) -> str:
    """Return which drop it was."""
    return '({:.2f}, {:.2f}, {:.2f})'.format(*drop.place)


def all_but(faults: list[str], drops: list[DropWatch], plot: Plot | None = None) -> Finding:
    """Find that all of some bricks did what they should, but those with a fault."""
    return Finding(not faults, f'{len(drops) - len(faults)} of {len(drops)}'
                   + ': ' * bool(faults) + '; '.join(faults[:3]), plot)


@rule('verdict: in time', 'When the node detects that the brick is falling it first computes '
      'whether it can reach the brick on-time', 'before the brick is down',
      rests_on=['fall: acceleration'])
def verdicts_come_in_time(record: Record) -> Finding:
    """Check that goal or text come while the brick still falls."""
    left, late = [], []
    for drop in completed(record):
        assert drop.down is not None
        if drop.decided is None:
            # Who has the brick come down on a platform below it need not say anything.
            if not drop.caught:
                late.append(f'no verdict on {name_of(drop)}')
            continue
        left.append((drop.down - drop.decided) * NANO)
        if left[-1] <= 0.0:
            late.append(f'{-left[-1]:.3f} s late on {name_of(drop)}')
    return Finding(not late, '; '.join(late[:3]) or (
        f'{len(left)} verdicts, at least {min(left):.3f} s before' if left else 'none needed'))


def times(record: Record, drop: DropWatch) -> tuple[float, float]:
    """Return the time (s) that the way takes at the greatest speed, and that of the fall."""
    radius, speed = number(record, 'platform_radius'), number(record, 'max_velocity')
    way = max(drop.distance - radius, 0.0) / speed
    depth = drop.place[2] - number(record, 'platform_height')
    return way, sqrt(max(2.0 * depth / number(record, 'gravity_accel'), 0.0))


def reach_plot(record: Record) -> Plot:
    """Return what was caught and what was not, over the way and the time for it."""
    series = []
    for words, is_caught in (('caught', True), ('not caught', False)):
        points = [times(record, drop) for drop in completed(record) if drop.caught is is_caught]
        points = [point for point in points if not isnan(point[0])]
        series.append(Series(words, [x for x, _ in points], [y for _, y in points]))
    longest = max((value for one in series for value in (*one.x, *one.y)), default=1.0)
    return Plot('Reach', 'time for the way at max_velocity (s)', 'time of the fall (s)', series,
                Series('physically possible above', [0.0, longest], [0.0, longest]))


@rule('verdict: out of reach', 'If the brick cannot be caught on time, the node publishes a Text '
      'marker', '"Unreachable" for each brick that nobody could catch',
      rests_on=['verdict: in time'])
def hopeless_bricks_are_refused(record: Record) -> Finding:
    """Check that what a robot at max_velocity could not reach is called Unreachable."""
    hopeless = some([drop for drop in completed(record) if drop.should is False],
                    'no brick was dropped out of reach')
    return all_but([f'{name_of(drop)} not' for drop in hopeless if not drop.refusals], hopeless,
                   reach_plot(record))


@rule('verdict: in reach', 'If the brick can be caught on time, the robot drives under the brick',
      'each brick within reach is caught', rests_on=['verdict: in time', 'drive: goal'])
def bricks_in_reach_are_caught(record: Record) -> Finding:
    """Check that what can be caught with some time to react is caught."""
    easy = some([drop for drop in completed(record) if drop.should],
                'no brick was dropped within reach')
    return all_but([f'{name_of(drop)} {"refused" if drop.refusals else "missed"}'
                    for drop in easy if not drop.caught or drop.refusals], easy)


@rule('verdict: kept', 'If the brick cannot be caught on time … If the brick can be caught on '
      'time …', 'Unreachable is not caught, and all else is',
      rests_on=['verdict: out of reach', 'verdict: in reach'])
def verdicts_come_true(record: Record) -> Finding:
    """Check that what was said is what happens, for every brick."""
    drops = completed(record)
    return all_but([
        f'{name_of(drop)} {"refused, but caught" if drop.caught else "missed silently"}'
        for drop in drops if bool(drop.refusals) is drop.caught], drops)


def texts(record: Record) -> list[MarkerHeard]:
    """Return the markers that say it; Broken or Open if there are none."""
    found = [heard for heard in record.markers if UNREACHABLE.lower() in heard.marker.text.lower()]
    if not found:
        if any(drop.should is False for drop in completed(record)):
            raise Broken('nobody said Unreachable')
        raise Open('no brick was out of reach')
    return found


@rule('text: kind', 'the node publishes a Text marker … that says "Unreachable"',
      'TEXT_VIEW_FACING, "Unreachable"', rests_on=['verdict: out of reach'])
def text_is_a_text(record: Record) -> Finding:
    """Check that the marker is a text that faces the viewer, and says the word."""
    said = {heard.marker.text for heard in texts(record)}
    kinds = {heard.marker.type for heard in texts(record)}
    return Finding(said == {UNREACHABLE} and kinds == {TEXT},
                   f'{", ".join(map(repr, sorted(said)))}, type {sorted(kinds)}')


def seconds_shown(record: Record, shown: list[MarkerHeard]) -> float:
    """Return how long (s) a text was to be seen that was said, and perhaps repeated or removed."""
    first, last = shown[0], shown[-1]
    lifetime = last.marker.lifetime.sec + last.marker.lifetime.nanosec * NANO
    ends = [last.published * NANO + (lifetime or float('inf'))]
    for heard in record.markers:
        same = (heard.marker.ns, heard.marker.id) == (last.marker.ns, last.marker.id)
        removes = heard.marker.action == DELETEALL or heard.marker.action == DELETE and same
        if removes and heard.topic == last.topic and heard.published > first.published:
            ends.append(heard.published * NANO)
    return min(ends) - first.published * NANO


@rule('text: time', 'a Text marker that lasts for 3 seconds',
      f'{LIFETIME:g} s ± {SHOWN} s for each fall, once', rests_on=['text: kind'])
def text_lasts(record: Record) -> Finding:
    """Check that the text is to be seen for three seconds, and not again."""
    times = []
    for drop in completed(record):
        end = min((one.begin for one in record.drops if one.begin > drop.begin), default=1 << 62)
        shown = [heard for heard in texts(record)
                 if drop.begin <= heard.published < end and heard.marker.action == ADD]
        if shown:
            times.append(seconds_shown(record, shown))
    kept = bool(times) and all(abs(time - LIFETIME) <= SHOWN for time in times)
    return Finding(kept, ', '.join(f'{time:.2f}' for time in times) + ' s')


@rule('carry', 'When the brick is caught, the robot drives back to the arena center and tilts the '
      'brick off', f'tilted within {AT_CENTER} m of the center',
      rests_on=['drive: goal', 'brick: rides'])
def bricks_are_carried_to_the_center(record: Record) -> Finding:
    """Check that the platform is tilted at the center, and not on the way."""
    off = []
    for drop in catches(record):
        if drop.carried_to is None:
            raise Broken(f'{name_of(drop)} was never tilted')
        off.append(dist(drop.carried_to, CENTER))
    return Finding(max(off, default=nan) <= AT_CENTER,
                   f'{len(off)} times, at most {max(off):.3f} m away')


@rule('tip off', 'the robot drives back to the arena center and tilts the brick off',
      'each caught brick leaves the platform', rests_on=['carry', 'slide: law', 'tilt'])
def bricks_are_tipped_off(record: Record) -> Finding:
    """Check that the tilt is large and long enough for each brick to leave."""
    return all_but([f'{name_of(drop)} not' for drop in catches(record) if drop.floated is None],
                   catches(record))


@rule('again', 'the turtle to catch a falling brick', 'level again after each brick, ready for '
      'the next', rests_on=['tip off'])
def robot_is_ready_again(record: Record) -> Finding:
    """Check that after each brick the platform is leveled, and the next one can come."""
    tipped = some([drop for drop in catches(record) if drop.floated is not None],
                  'no brick was tipped off')
    return all_but([f'still tilted after {name_of(drop)}' for drop in tipped
                    if drop.leveled is None], tipped)
