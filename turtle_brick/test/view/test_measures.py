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

from hypothesis import given
from hypothesis import strategies as st
import pytest
from turtle_brick.core.time_steps import NANOSECONDS
from turtle_brick.view.measures import common_instant, Curves, Rate


@given(st.lists(st.sampled_from([0, 1, 10, NANOSECONDS // 100, NANOSECONDS, 2 * NANOSECONDS + 1])),
       st.sampled_from([0, 1, NANOSECONDS, 2 * NANOSECONDS, 2 * NANOSECONDS + 1]))
def test_a_rate_is_that_of_the_last_two_seconds(gaps, later):
    rate, instants, now = Rate(), [], 10**15
    for gap in gaps:
        now += gap
        rate.add(now)
        instants.append(now)
    recent = [instant for instant in instants if instant >= now + later - 2 * NANOSECONDS]
    assert rate.value(now + later) == (
        None if len(set(recent)) < 2
        else pytest.approx((len(recent) - 1) * NANOSECONDS / (recent[-1] - recent[0])))


@given(st.lists(st.integers(0, 2 * Curves.PERIOD), min_size=1, max_size=300))
def test_curves_are_sampled_once_per_period_and_what_comes_late_fills_the_gap(gaps):
    curves, samples, now = Curves(2), [], 10**15
    for number, gap in enumerate(gaps):
        now += gap if number else 0
        due = (now - 10**15) // Curves.PERIOD + 1
        assert curves.add(now, number, None) is (due > len(samples))
        samples += [number] * (due - len(samples))
        times, numbers, nothing = curves.columns()
        latest = ([None] * Curves.LENGTH + samples)[-Curves.LENGTH:]
        assert numbers == latest and set(nothing) == {None}
    assert times == pytest.approx([0.1 * (step - 119) for step in range(120)])
    curves.add(now + 10**15, 7.0, 8.0)  # after a very long gap
    assert curves.columns()[1:] == [[7.0] * 120, [8.0] * 120]


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
