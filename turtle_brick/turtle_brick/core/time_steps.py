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

"""Time conversions and a step clock that does not drift if callbacks are late."""

NS_PER_SECOND = 1_000_000_000
SECONDS_PER_NS = 1e-9

LONGEST_GAP = NS_PER_SECOND
"""Age (ns) of the last step beyond which a step clock restarts."""


class StepClock:
    """
    Compute the times of the periodic steps that have become due.

    The time of step k is t0 + k * period in integer nanoseconds, so rounding errors do not
    accumulate. After a late or skipped callback, the next call to `due` returns all due times.
    """

    def __init__(self, period: int) -> None:
        """Create a clock with a given period (ns). The first call to `due` starts the clock."""
        self.period = period
        self.last: int | None = None
        """Time (ns) of the last step."""
        self.jump = 0
        """Signed time jump (ns) if the last call to `due` restarted this clock, otherwise 0."""

    def due(self, now: int, start: int | None = None) -> list[int]:
        """
        Return the times (ns) of the steps that have become due since the last call.

        The step clock restarts with a single step if the last step is older than LONGEST_GAP or
        more than one period ahead of `now`.

        :param now: current time (ns)
        :param start: time (ns) of the first step after a start or restart, by default `now`
        """
        self.jump = 0
        if self.last is not None:
            elapsed = now - self.last
            if -self.period <= elapsed <= LONGEST_GAP:
                times = list(range(self.last + self.period, now + 1, self.period))
                self.last += len(times) * self.period
                return times
            self.jump = elapsed
        self.last = now if start is None else start
        return [self.last]
