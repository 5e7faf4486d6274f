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

"""A clock of equal steps that does not drift when callbacks are late."""

from typing import Any

NS_PER_SECOND = 1_000_000_000
"""Nanoseconds in a second."""

SECONDS_PER_NS = 1e-9
"""A nanosecond (s)."""


class StepClock:
    """
    Count the steps of a fixed period that have become due.

    Step k belongs to the instant t0 + k * period, in integer nanoseconds, so that rounding errors
    don't add up. A timer that is late or loses a period only delays steps: the next call returns
    every one that is due.
    """

    def __init__(self, period: int, longest_gap: int = NS_PER_SECOND) -> None:
        """
        Wait for the first call of `due`, which sets t0.

        :param period: time between two steps (ns)
        :param longest_gap: time since the last step (ns) beyond which t0 is set anew
        """
        self.period = period
        self.longest_gap = longest_gap
        self.last: int | None = None
        """Instant (ns) of the last step."""
        self.jump = 0
        """How far (ns) the clock had jumped if `due` has just set t0 anew, else 0."""

    def due(self, now: int, begin: int | None = None) -> list[int]:
        """
        Return the instants (ns) of the steps that have become due since the last call.

        :param now: the present instant (ns)
        :param begin: t0 if it is set in this call, at most `now`, the default; the instant at
            which the timer was due is best, so that a step is due in each of its calls
        :return: The instants in order. If the last step is more than `longest_gap` ago, or more
            than a period ahead because the clock was set back, t0 is set anew: [begin].
        """
        self.jump = 0
        if self.last is not None:
            elapsed = now - self.last
            if -self.period <= elapsed <= self.longest_gap:
                instants = list(range(self.last + self.period, now + 1, self.period))
                self.last += len(instants) * self.period
                return instants
            self.jump = elapsed
        self.last = now if begin is None else begin
        return [self.last]


def due_time(timer: Any, now: int) -> int:
    """
    Return when the timer was due whose callback runs now.

    :param timer: an rclpy.timer.Timer
    :param now: the present instant of its clock (ns)
    :return: The instant (ns), at most `now`.
    """
    return now - max(timer.timer_period_ns - timer.time_until_next_call(), 0)


def nanoseconds_of(stamp: Any) -> int:
    """
    Return the instant (ns) of a message's stamp.

    :param stamp: a builtin_interfaces/Time
    """
    return stamp.sec * NS_PER_SECOND + stamp.nanosec
