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
How much longer orders take here than on one machine: measured, not assumed.

On one machine the latencies are those that `reachability` derives. Where the nodes are on several
hosts, the links between them add theirs, and `Latency` reckons with the worst of the recent past:
of the ages of transforms on arrival, of the time from an order to the first motion, and of lost
messages. On a machine whose processors do not suffice it also sees that robot and turtlesim stand
still again and again, and so how slow the robot is. Instants are integer nanoseconds of one clock.
"""

from bisect import bisect_left, insort
from collections import deque
from collections.abc import Iterable

from turtle_brick.core.driving import COMMAND_PERIOD
from turtle_brick.core.time_steps import SECONDS_PER_NS

MEMORY = 10.0
"""Time (s) for which what was seen counts."""

RARE = 0.01
"""Part of the messages that may be slower: a machine that stood still for a moment is no link. An
order and the motion that comes back are hardly ever both among them."""

STARVED, CALLS = 0.2, 50
"""Which part of the last calls of a timer is late where processes wait for a processor all the
time, and how many calls that is about."""

USUAL_AGE = 0.006
"""Age (s) on arrival that transforms have on one machine too: the latencies there allow for it."""

CLOCK_TOLERANCE = 0.006
"""Time (s) by which stamps may be ahead of their arrival before the clocks disagree: the arena
stamps a brick that rides a step, 0.004 s, ahead."""

LOSSES = 3
"""Number of gaps among the stamps of the brick within MEMORY that show that messages get lost: a
single one may be a node that stood still."""

LOSS_RESERVE = 0.06
"""Time (s) to spare where messages get lost: two orders in a row, 0.02 s each, and two of the
robot's poses, 0.01 s each."""

LONGEST = 1.0
"""Time (s) beyond which a delay is none: an order was ignored, a node stopped, a stamp wrong."""


class Recent:
    """The values of the last MEMORY, in order of size."""

    def __init__(self) -> None:
        """Know no value."""
        self._noted: deque[tuple[int, float]] = deque()
        self._sorted: list[float] = []

    def note(self, now: int, value: float) -> None:
        """Note a value at an instant (ns)."""
        self._noted.append((now, value))
        insort(self._sorted, value)

    def at(self, now: int, part: float) -> float:
        """Return the value, at an instant (ns), above a part (0 to 1) of them; 0 of none."""
        noted, values = self._noted, self._sorted
        while noted and (now - noted[0][0]) * SECONDS_PER_NS > MEMORY:
            _, value = noted.popleft()
            del values[bisect_left(values, value)]
        return values[round(part * (len(values) - 1))] if values else 0.0

    def total(self, now: int) -> float:
        """Return the sum of the values at an instant (ns)."""
        self.at(now, 1.0)
        return sum(self._sorted)


class Latency:
    """What is known of the time that messages and orders take here."""

    def __init__(self) -> None:
        """Assume one machine."""
        self._ages = Recent()
        """Of transforms on arrival (s)."""
        self._longer = Recent()
        """By how much motions came later (s) after their orders than on one machine."""
        self._lateness = 0.0
        """Which part of the listener's last calls was late."""
        self._pauses = Recent()
        """For how long the robot stood still (s) between two of its poses."""
        self._robot: int | None = None
        """Stamp of the robot's last pose (ns)."""
        self._since: int | None = None
        """When the robot was heard of first (ns)."""
        self._gaps: deque[int] = deque(maxlen=LOSSES)
        """Stamps of the brick before which one was missing (ns)."""
        self._stamp: int | None = None
        """The brick's last stamp (ns)."""
        self._period = 0.0
        """Usual time (s) between two stamps of the brick."""

    def hear(self, now: int, ages: Iterable[float], late: bool = False) -> None:
        """
        Note how old transforms were when they arrived.

        :param now: the present instant (ns)
        :param ages: of what has arrived since the last call (s)
        :param late: whether this call is late. Who stands still for once measures that, and no
            link; where it is the rule, all others wait for a processor, too.
        """
        self._lateness += (late - self._lateness) / CALLS
        if not late or self._is_starved:
            for age in ages:
                if abs(age) <= LONGEST:
                    self._ages.note(now, age)

    @property
    def _is_starved(self) -> bool:
        """Whether lateness is the rule."""
        return self._lateness > STARVED

    def see_robot(self, stamp: int) -> None:
        """Note the stamp (ns) of a pose of the robot, and so whether it stood still before."""
        if self._robot is None:
            self._since = stamp
        else:
            gap = (stamp - self._robot) * SECONDS_PER_NS
            if self._is_starved and 2.0 * COMMAND_PERIOD < gap < LONGEST:
                self._pauses.note(stamp, gap - COMMAND_PERIOD)
        self._robot = stamp

    def see_brick(self, stamp: int) -> None:
        """Note the stamp (ns) of a position of the brick, and so whether some are missing."""
        gap = 0.0 if self._stamp is None else (stamp - self._stamp) * SECONDS_PER_NS
        self._stamp = stamp
        if not 0.0 < gap < LONGEST:
            return
        if gap > 1.5 * self._period > 0.0:
            self._gaps.append(stamp)
        self._period += (0.02 if self._period else 1.0) * (gap - self._period)

    def obey(self, now: int, longer: float) -> None:
        """Note that the robot has moved, longer (s) after an order than on one machine."""
        self._longer.note(now, longer)

    def loses(self, now: int) -> bool:
        """Tell whether messages get lost."""
        return len(self._gaps) == LOSSES and (now - self._gaps[0]) * SECONDS_PER_NS <= MEMORY

    def ahead(self, now: int) -> float:
        """Return by how much (s) stamps are ahead of their arrival: 0 where the clocks agree."""
        ahead = -self._ages.at(now, RARE)
        return ahead if ahead > CLOCK_TOLERANCE else 0.0

    def standstill(self, now: int, duration: float) -> float:
        """
        Return how long (s) the robot may stand still because processes wait for a processor.

        :param now: the present instant (ns)
        :param duration: of its way (s)
        :return: As large a part of it as in the recent past, and one more pause like the longest.
        """
        known = 0.0 if self._since is None else (now - self._since) * SECONDS_PER_NS
        part = self._pauses.total(now) / min(max(known, 1.0), MEMORY)
        return part * duration + self._pauses.at(now, 1.0)

    def excess(self, now: int) -> float:
        """
        Return how much longer (s) an order takes than on one machine, at an instant (ns).

        It goes out over one link, and the motion comes back over another one: each is reckoned to
        be as slow as the slowest of those seen. Clocks that disagree hide how slow that is: then
        what is seen otherwise, by the motion, is added, and as much as they disagree.
        """
        ahead = self.ahead(now)
        link = max(self._ages.at(now, 1.0 - RARE) + ahead - USUAL_AGE, 0.0)
        seen = 2.0 * link + (LOSS_RESERVE if self.loses(now) else 0.0)
        motion = self._longer.at(now, 1.0)
        return seen + ahead + motion if ahead else max(seen, motion)
