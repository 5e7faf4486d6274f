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

"""Test StepClock with late calls."""

from turtle_brick.core.time_steps import StepClock

GAP = 1_000_000_000


def test_due_returns_each_step_once():
    clock = StepClock(period=10)
    assert clock.due(100) == [100]
    assert clock.due(109) == []
    assert clock.due(135) == [110, 120, 130]


def test_first_step_is_at_the_due_time_of_the_timer():
    """A late first callback does not shift the times of the steps."""
    clock = StepClock(period=10)
    assert clock.due(107, start=100) == [100]
    assert clock.due(112, start=110) == [110]
    assert clock.due(110 + 2 * GAP + 7, start=110 + 2 * GAP) == [110 + 2 * GAP]
    assert clock.jump == 2 * GAP + 7
