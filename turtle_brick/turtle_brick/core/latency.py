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

"""
Estimate the excess latency of the command path.

The excess latency is the difference between the actual latency and COMMAND_LATENCY in
`reachability`. Slow links, lost messages and overloaded machines cause excess latency.
`LatencyMonitor` estimates the excess latency from the worst values recorded in the last WINDOW
seconds. All timestamps (ns) come from one clock.
"""

from bisect import bisect_left, insort
from collections import deque
from collections.abc import Iterable

from turtle_brick.core.driving import COMMAND_PERIOD
from turtle_brick.core.time_steps import SECONDS_PER_NS

WINDOW = 10.0
"""Time (s) for which a measurement is used."""

OUTLIER_FRACTION = 0.01
"""Fraction of transforms ignored as outliers, for example after a single stall."""

OVERLOAD_FRACTION = 0.2
"""Fraction of late timer callbacks above which the machine is considered overloaded."""

AVERAGED_CALLBACKS = 50
"""Number of timer callbacks over which the fraction of late callbacks is averaged."""

USUAL_AGE = 0.006
"""Usual age (s) of transforms on arrival. The latencies in `reachability` include this age."""

CLOCK_TOLERANCE = 0.006
"""Maximum time (s) by which a timestamp can be ahead of a synchronized clock. For example, the
arena simulates a brick on the platform one step (0.004 s) ahead."""

MIN_GAPS = 3
"""Number of long gaps between brick timestamps within WINDOW that indicates lost messages."""

LOSS_RESERVE = 0.06
"""Excess latency (s) due to lost messages. This reserve covers two catcher updates (0.02 s each)
and two robot poses (0.01 s each)."""

MAX_DELAY = 1.0
"""Maximum valid delay (s). Longer delays are due to ignored goals or invalid timestamps."""


class RecentValues:
    """Values recorded in the last WINDOW seconds."""

    def __init__(self) -> None:
        self._history: deque[tuple[int, float]] = deque()
        self._sorted: list[float] = []

    def add(self, now: int, value: float) -> None:
        """Add a value recorded at a given time (ns)."""
        self._history.append((now, value))
        insort(self._sorted, value)

    def quantile(self, now: int, fraction: float) -> float:
        """Return the quantile for a fraction from 0 to 1, or 0 if there are no values."""
        values = self.recent(now)
        return values[round(fraction * (len(values) - 1))] if values else 0.0

    def largest(self, now: int, rank: int) -> float:
        """Return the value with a given rank (1 = largest), or 0 if there are fewer values."""
        values = self.recent(now)
        return values[-rank] if len(values) >= rank else 0.0

    def recent(self, now: int) -> list[float]:
        """Remove values older than WINDOW and return the remaining values in ascending order."""
        while self._history and (now - self._history[0][0]) * SECONDS_PER_NS > WINDOW:
            _, value = self._history.popleft()
            del self._sorted[bisect_left(self._sorted, value)]
        return self._sorted


class LatencyMonitor:
    """Estimate the excess latency from transform ages, response delays and timestamp gaps."""

    def __init__(self) -> None:
        self._ages = RecentValues()
        """Ages (s) of transforms on arrival."""
        self._response_delays = RecentValues()
        """Delays (s) from a goal to the robot's first motion, minus the usual delay."""
        self._pauses = RecentValues()
        """Intervals (s) between consecutive poses of the robot, minus the usual interval."""
        self._late_fraction = 0.0
        self._first_robot_stamp = 0
        self._robot_stamp: int | None = None
        self._brick_stamp: int | None = None
        self._brick_period = 0.0
        """Average interval (s) between consecutive brick timestamps."""
        self._gaps: deque[int] = deque(maxlen=MIN_GAPS)
        """Timestamps (ns) of the brick transforms that followed a gap."""

    def record_ages(self, now: int, ages: Iterable[float], late: bool = False) -> None:
        """
        Record the ages (s) of the transforms received before a timer callback at `now` (ns).

        Ages recorded at an isolated late callback are too high and are therefore ignored. If
        frequent late callbacks show that the machine is overloaded, such ages are recorded.
        """
        self._late_fraction += (float(late) - self._late_fraction) / AVERAGED_CALLBACKS
        if late and not self._is_overloaded:
            return
        for age in ages:
            if abs(age) <= MAX_DELAY:
                self._ages.add(now, age)

    @property
    def _is_overloaded(self) -> bool:
        return self._late_fraction > OVERLOAD_FRACTION

    def record_robot_stamp(self, stamp: int) -> None:
        """Record the timestamp (ns) of a robot transform and any preceding pause."""
        if self._robot_stamp is None:
            self._first_robot_stamp = stamp
        else:
            gap = (stamp - self._robot_stamp) * SECONDS_PER_NS
            if self._is_overloaded and 2.0 * COMMAND_PERIOD < gap < MAX_DELAY:
                self._pauses.add(stamp, gap - COMMAND_PERIOD)
        self._robot_stamp = stamp

    def record_brick_stamp(self, stamp: int) -> None:
        """Record the timestamp (ns) of a brick transform and any preceding gap."""
        gap = 0.0 if self._brick_stamp is None else (stamp - self._brick_stamp) * SECONDS_PER_NS
        self._brick_stamp = stamp
        if not 0.0 < gap < MAX_DELAY:
            return
        if self._brick_period == 0.0:
            self._brick_period = gap
            return
        if gap > 1.5 * self._brick_period:
            self._gaps.append(stamp)
        self._brick_period += 0.02 * (gap - self._brick_period)

    def record_response_delay(self, now: int, excess: float) -> None:
        """Record the time (s) by which the robot's response delay exceeded COMMAND_LATENCY."""
        self._response_delays.add(now, excess)

    def loses_messages(self, now: int) -> bool:
        """Return whether messages were lost in the WINDOW seconds before `now` (ns)."""
        return (len(self._gaps) == MIN_GAPS
                and (now - self._gaps[0]) * SECONDS_PER_NS <= WINDOW)

    def clock_error(self, now: int) -> float:
        """Return the time (s) by which timestamps are in the future, or 0 if the clocks agree."""
        ahead = -self._ages.quantile(now, OUTLIER_FRACTION)
        return ahead if ahead > CLOCK_TOLERANCE else 0.0

    def expected_standstill(self, now: int, duration: float) -> float:
        """
        Return the total expected pause time (s) during a drive of a given duration (s).

        On an overloaded machine, the robot sometimes pauses. The result is the duration times the
        fraction of recent time spent in pauses, plus the longest recent pause.
        """
        observed = (now - self._first_robot_stamp) * SECONDS_PER_NS
        fraction = sum(self._pauses.recent(now)) / min(max(observed, 1.0), WINDOW)
        return fraction * duration + self._pauses.largest(now, 1)

    def excess(self, now: int) -> float:
        """
        Return the excess latency (s) at time `now` (ns).

        The goal and the resulting pose each cross one link, so the delay of the slowest link
        counts twice. A brief stall of one node can cause a single late response. Such a response
        counts only if messages are late or lost. If the clocks disagree, the transform ages are
        unreliable, so the result includes the clock error and the response delay.
        """
        clock_error = self.clock_error(now)
        link = max(
            self._ages.quantile(now, 1.0 - OUTLIER_FRACTION) + clock_error - USUAL_AGE, 0.0)
        transport = 2.0 * link + (LOSS_RESERVE if self.loses_messages(now) else 0.0)
        is_link_slow = transport > 0.0 or clock_error > 0.0
        response = self._response_delays.largest(now, 1 if is_link_slow else 2)
        if clock_error > 0.0:
            return transport + clock_error + response
        return max(transport, response)
