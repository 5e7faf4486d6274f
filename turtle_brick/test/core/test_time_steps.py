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


"""A clock of equal steps, under any pattern of late calls."""

from random import Random

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.time_steps import StepClock

PERIOD = 4_000_000
GAP = 1_000_000_000

starts = st.integers(0, 2 ** 62)
pauses = st.one_of(
    st.integers(0, 3 * PERIOD),  # a timer's
    st.integers(0, GAP - PERIOD),  # a stall's
    st.sampled_from((0, 1, PERIOD - 1, PERIOD, PERIOD + 1, GAP - PERIOD)))


def calls(clock, start, gaps):
    """Ask a clock after each of the pauses; return all steps and the last instant."""
    now = start
    steps = clock.due(now)
    for gap in gaps:
        now += gap
        steps = steps + clock.due(now)
        assert clock.jump == 0
    return steps, now


@law(50)
@given(start=starts, gaps=st.lists(pauses, max_size=30),
       period=st.just(PERIOD) | st.integers(1, 10 ** 8))
def test_no_pattern_of_late_calls_makes_it_drift(start, gaps, period):
    """Every step of the grid that is due has come, once, in order, and nothing else."""
    clock = StepClock(period, 10 * GAP)
    steps, now = calls(clock, start, [min(gap, 1000 * period) for gap in gaps])
    assert steps == list(range(start, now + 1, period))
    assert clock.last == steps[-1]


@law(40)
@given(start=starts, seen=st.integers(0, 250), lag=st.integers(0, PERIOD - 1),
       jump=st.one_of(st.integers(GAP + 1, 100 * GAP), st.integers(-100 * GAP, -PERIOD - 1)),
       gaps=st.lists(pauses, max_size=10))
def test_a_jump_begins_a_new_grid(start, seen, lag, jump, gaps):
    """Beyond the longest gap, or backward, the grid begins anew with the instant of the call."""
    clock = StepClock(PERIOD)
    calls(clock, start, [PERIOD] * seen + [lag])
    restart = start + seen * PERIOD + jump
    assert clock.due(restart) == [restart]
    assert clock.jump == jump
    assert clock.due(restart) == [] and clock.jump == 0
    steps, now = calls(clock, restart, gaps)
    assert steps == list(range(restart + PERIOD, now + 1, PERIOD))


@law(30)
@given(start=starts, seen=st.integers(0, 50), back=st.integers(0, PERIOD))
def test_a_clock_that_is_slewed_back_only_waits(start, seen, back):
    """No step comes twice and no stamp goes back; the grid stays."""
    clock = StepClock(PERIOD)
    calls(clock, start, [PERIOD] * seen)
    last = start + seen * PERIOD
    steps = [clock.due(now) for now in (last - back, last, last + PERIOD)]
    assert (steps, clock.jump) == ([[], [], [last + PERIOD]], 0)


def test_the_longest_gap_is_still_made_up_for():
    clock = StepClock(PERIOD)
    clock.due(7)
    assert clock.due(7 + GAP) == list(range(7 + PERIOD, 7 + GAP + 1, PERIOD))
    assert clock.jump == 0


@pytest.mark.parametrize('first', (0.0, 0.9))
def test_each_call_of_a_timer_has_its_step_on_the_timers_own_grid(first):
    """However late the first call was; on the grid of the calls, some would come too early."""
    clock, random = StepClock(PERIOD), Random(1)
    due = 1_700_000_000_000_000_123
    assert clock.due(due + round(first * PERIOD), due) == [due]
    for _ in range(1000):
        due += PERIOD
        assert clock.due(due + round(random.uniform(0.0, 0.9) * PERIOD), due) == [due]
    late = due + 2 * GAP
    assert clock.due(late + 7, late) == [late] and clock.jump == 2 * GAP + 7
