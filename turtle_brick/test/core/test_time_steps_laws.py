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
"""Test StepClock with random pauses and clock jumps."""

from hypothesis import given
from hypothesis import strategies as st
from laws import law
from test_time_steps import GAP
from turtle_brick.core.time_steps import StepClock

PERIOD = 4_000_000

starts = st.integers(0, 2 ** 62)


@law(20)
@given(start=starts, period=st.just(PERIOD) | st.integers(1, 10 ** 8),
       pauses=st.lists(st.floats(-1.0, 3.0) | st.sampled_from((-1.0, 1.0, 249.0, 500.0)),
                       max_size=30))
def test_steps_are_neither_skipped_nor_repeated(start, period, pauses):
    """The time never jumps far enough to restart the step clock."""
    clock, now = StepClock(period), start
    latest, steps = now, clock.due(now)
    for pause in pauses:
        now = min(max(now + round(pause * period), clock.last - period), clock.last + GAP)
        latest = max(latest, now)
        steps += clock.due(now)
        assert clock.jump == 0
    assert steps == list(range(start, latest + 1, period))
    assert clock.last == steps[-1]


@law(20)
@given(start=starts, jump=st.integers(GAP + 1, 100 * GAP) | st.integers(-100 * GAP, -PERIOD - 1)
       | st.sampled_from((GAP + 1, -PERIOD - 1)))
def test_clock_jump_restarts_the_step_clock(start, jump):
    clock, restart = StepClock(PERIOD), start + jump
    clock.due(start)
    assert (clock.due(restart), clock.jump) == ([restart], jump)
    assert (clock.due(restart), clock.jump) == ([], 0)
    assert clock.due(restart + PERIOD) == [restart + PERIOD]
