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
"""The measure of a rate that the tests of the live graph rely on."""

from random import Random

import pytest
from witness import rate


def received(times):
    """Make a recording of messages that came at some times."""
    return [(time, None) for time in times]


@pytest.mark.parametrize('wanted', (62.5, 99.0, 100.0, 250.0))
def test_even_messages_have_their_rate(wanted):
    assert rate(received(number / wanted for number in range(300))) == pytest.approx(wanted)


@pytest.mark.parametrize('begin', (0, 40, 150, 230, 280))
@pytest.mark.parametrize('length', (0.05, 0.2, 0.4))
def test_messages_that_are_held_up_change_nothing(begin, length):
    """All that was to come during a stall comes at its end, at once."""
    times = [number * 0.01 for number in range(300)]
    end = times[begin] + length
    late = [end if times[begin] <= time < end else time for time in times]
    assert rate(received(late)) == pytest.approx(100.0, rel=0.001)


@pytest.mark.parametrize('seed', range(20))
def test_a_machine_that_stands_still_most_of_the_time_changes_little(seed):
    """After each stall of 20 to 80 ms there are 10 ms in which messages come in time."""
    random = Random(seed)
    late, begin, end = [], 0.0, 0.0
    for number in range(750):
        time = number * 0.004
        while time >= end + 0.01:
            begin = end + 0.01
            end = begin + random.uniform(0.02, 0.08)
        late.append(end if begin <= time < end else time)
    assert rate(received(late)) == pytest.approx(250.0, abs=0.01)


@pytest.mark.parametrize('every, wanted', ((100, 99.0), (50, 98.0), (4, 75.0)))
def test_cycles_that_are_left_out_count(every, wanted):
    times = [number * 0.01 for number in range(600) if number % every]
    assert rate(received(times)) == pytest.approx(wanted, rel=0.002)


def test_too_few_have_none():
    assert rate(received((0.0, 0.1, 0.2, 0.3, 0.4))) == 0.0
