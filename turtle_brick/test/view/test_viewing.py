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
"""What the viewer derives from messages: lifetimes, rates, curves, and the account of a fall."""

from hypothesis import given
from hypothesis import strategies as st
import pytest
from turtle_brick.physics import Phase
from turtle_brick.view.urdf_scene import Shape
from turtle_brick.view.viewing import (Account, common_instant, History, Mark, Marks, NANOSECONDS,
                                       Rate)

SHAPE = Shape('box', (1.0, 1.0, 1.0), (1.0, 0.0, 0.0, 1.0))


def mark(expires=None):
    """Return a marker with the end of its lifetime."""
    return Mark('world', SHAPE, False, 0, expires)


@given(st.lists(st.tuples(st.integers(0, 3), st.none() | st.integers(0, 100)), max_size=20),
       st.lists(st.integers(0, 120), min_size=1))
def test_a_marker_is_seen_until_its_lifetime_is_over(put, looks):
    marks, latest = Marks(), {}
    for number, expires in put:
        marks.put(('topic', '', number), mark(expires))
        latest[number] = expires
    for now in sorted(looks):
        marks.expire(now)
        assert {number for _, _, number in marks.shown} == {
            number for number, expires in latest.items() if expires is None or now < expires}


def test_markers_are_told_apart_by_topic_namespace_and_id():
    marks = Marks()
    keys = [(topic, space, number) for topic in 'ab' for space in 'xy' for number in (0, 1)]
    for key in keys:
        marks.put(key, mark())
    marks.remove(('a', 'x', 1))
    marks.remove(('a', 'x', 7))
    assert set(marks.shown) == set(keys) - {('a', 'x', 1)}
    marks.clear('b')
    assert {key[0] for key in marks.shown} == {'a'}


@given(st.integers(1, 400), st.integers(0, 10**18), st.integers(1, 9))
def test_the_rate_of_what_comes_regularly_is_its_rate(frequency, start, burst):
    rate = Rate()
    for number in range(3 * frequency + 2):
        now = start + number * NANOSECONDS // frequency
        rate.add(now, burst)
    assert rate.value(now) == pytest.approx(frequency * burst, rel=1e-6)


def test_there_is_no_rate_of_what_has_stopped_or_has_hardly_begun():
    rate = Rate()
    assert rate.value(0) is None
    rate.add(NANOSECONDS)
    assert rate.value(NANOSECONDS) is None
    rate.add(2 * NANOSECONDS)
    assert rate.value(2 * NANOSECONDS) == pytest.approx(1.0)
    assert rate.value(10 * NANOSECONDS) is None


def test_a_change_of_rate_is_seen_after_the_window():
    rate = Rate()
    for now in range(0, 5 * NANOSECONDS, NANOSECONDS // 100):
        rate.add(now)
    for now in range(5 * NANOSECONDS, 8 * NANOSECONDS, NANOSECONDS // 50):
        rate.add(now)
    assert rate.value(now) == pytest.approx(50.0, rel=0.01)


@given(st.lists(st.integers(0, 100)), st.integers(1, 40), st.integers(1_000, 2_000))
def test_the_common_instant_is_the_least_of_those_that_are_about_the_same(stamps, apart, far):
    found = common_instant(stamps, apart)
    moving = sorted(filter(None, stamps))
    if not moving:
        assert found == 0
        return
    middle = moving[len(moving) // 2]
    assert found == min(stamp for stamp in moving if stamp >= middle - apart)
    if moving[-1] - moving[0] <= apart:
        assert found == moving[0]
        # Whoever is far ahead, or far behind, has no say, as long as these are the majority.
        others = [10_000 + stamp for stamp in moving] + [far] * (len(moving) - 1)
        assert common_instant(others, apart) == 10_000 + moving[0]


def test_a_rate_begins_again_when_time_goes_back():
    rate = Rate()
    for step in range(300):
        rate.add(1000 * NANOSECONDS + step * NANOSECONDS // 100)
    for step in range(300):
        now = step * NANOSECONDS // 50
        rate.add(now)
    assert rate.value(now) == pytest.approx(50.0)


def test_what_comes_from_the_future_does_not_pile_up():
    rate = Rate()
    for step in range(2 * Rate.MOST):
        rate.add(3600 * NANOSECONDS + step)
    assert rate.value(0) is None
    assert len(rate._events) == Rate.MOST


@given(st.lists(st.integers(0, 10 * NANOSECONDS)), st.integers(0, 12 * NANOSECONDS))
def test_to_ask_for_a_rate_changes_nothing(stamps, now):
    rate = Rate()
    for stamp in stamps:
        rate.add(stamp)
    before = list(rate._events)
    assert rate.value(now) == rate.value(now)
    assert list(rate._events) == before


@given(st.lists(st.integers(1, 20 * History.PERIOD), min_size=1, max_size=40),
       st.integers(History.PERIOD, 10**18))
def test_a_history_has_what_was_added_at_its_time_and_nothing_where_nothing_was(gaps, now):
    history, added = History(2), {}
    for number, gap in enumerate(gaps):
        now += gap
        if history.is_due(now):
            history.add(now, (float(number), None))
            added[now // History.PERIOD] = float(number)
        assert not history.is_due(now)
    times, numbers, nothing = history.columns()
    assert len(times) == len(numbers) == len(nothing) == History.LENGTH
    latest = max(added)
    for time, number in zip(times, numbers):
        assert number == added.get(latest + round(time * NANOSECONDS / History.PERIOD))
    assert times[-1] == 0.0 and set(nothing) == {None}


def test_a_history_begins_again_when_time_goes_back():
    history = History(1)
    for now in (100 * NANOSECONDS, 101 * NANOSECONDS, 50 * NANOSECONDS):
        history.add(now, (now / NANOSECONDS,))
    assert history.columns()[1] == [None] * (History.LENGTH - 1) + [50.0]


def test_the_account_of_a_catch():
    account = Account()
    assert account.sentence() == 'Waiting for a brick to fall'
    account.see_phase(Phase.HOVERING)
    assert account.sentence() == 'Waiting for a brick to fall'
    account.see_phase(Phase.FALLING)
    assert account.sentence() == 'The brick falls'
    account.see_goal(7.5, 7.0, (7.5, 7.0))
    assert account.sentence() == 'Reachable: driving under the brick'
    account.see_phase(Phase.RIDING)
    assert account.sentence() == 'Caught'
    account.see_goal(5.54, 5.54, (7.5, 7.0))
    assert account.sentence() == 'Caught: carrying it to (5.54, 5.54)'
    account.see_tilt(0.3)
    assert account.sentence() == 'Tipping the brick off'
    account.see_phase(Phase.FLOATING)
    account.see_tilt(0.0)
    assert account.sentence() == 'Waiting for a brick to fall'
    assert not account.unreachable


def test_the_account_of_a_brick_out_of_reach():
    account = Account()
    account.see_phase(Phase.FALLING)
    account.see_unreachable()
    assert account.unreachable
    assert account.sentence() == 'Unreachable'
    account.see_phase(Phase.GROUNDED)
    assert account.sentence() == 'Unreachable: it fell to the ground'
    account.see_phase(Phase.HOVERING)
    assert not account.unreachable
    assert account.sentence() == 'Waiting for a brick to fall'


def test_a_goal_elsewhere_is_no_pursuit_and_a_pursuit_may_miss():
    account = Account()
    account.see_phase(Phase.FALLING)
    account.see_goal(1.0, 1.0, (7.5, 7.0))
    assert account.sentence() == 'The brick falls'
    account.see_phase(Phase.GROUNDED)
    assert account.sentence() == 'Waiting for a brick to fall'
    account.see_phase(Phase.HOVERING)
    account.see_phase(Phase.FALLING)
    account.see_goal(7.5, 7.0, (7.5, 7.0))
    account.see_phase(Phase.GROUNDED)
    assert account.sentence() == 'Missed: it fell to the ground'
