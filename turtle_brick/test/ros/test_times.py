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

"""Test the conversion of the times of timers and messages."""

from types import SimpleNamespace

from builtin_interfaces.msg import Time as TimeMessage
import pytest
from turtle_brick.ros.times import due_time, nanoseconds_of


@pytest.mark.parametrize('until, due', [(30, 930), (100, 1000), (130, 1000), (-250, 650)])
def test_due_time_is_one_period_before_the_next_call(until, due):
    """The due time is never later than the current time."""
    timer = SimpleNamespace(timer_period_ns=100, time_until_next_call=lambda: until)
    assert due_time(timer, 1000) == due


def test_nanoseconds_of_a_timestamp():
    assert nanoseconds_of(TimeMessage(sec=2, nanosec=3)) == 2_000_000_003
