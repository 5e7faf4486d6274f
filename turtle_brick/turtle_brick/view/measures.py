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
What the page measures: rates and curves. Pure.

Instants are in ns, of a clock that only goes on.
"""

from collections import deque
from collections.abc import Iterable

from turtle_brick.core.time_steps import NANOSECONDS


class Rate:
    """How often something came in the last seconds."""

    WINDOW = 2 * NANOSECONDS
    """How far back (ns) it looks."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._instants: deque[int] = deque()

    def add(self, now: int) -> None:
        """Count an event of the present instant."""
        self._instants.append(now)
        self._forget(now)

    def value(self, now: int) -> float | None:
        """Return the events per second, None while fewer than two instants are known."""
        self._forget(now)
        if not self._instants or self._instants[-1] == self._instants[0]:
            return None
        time = self._instants[-1] - self._instants[0]
        return (len(self._instants) - 1) * NANOSECONDS / time

    def _forget(self, now: int) -> None:
        """Forget what is too long ago."""
        while self._instants and self._instants[0] < now - self.WINDOW:
            self._instants.popleft()


class Curves:
    """Some quantities in the last seconds."""

    PERIOD = NANOSECONDS // 10
    """Time (ns) between two samples."""

    LENGTH = 120
    """How many samples there are."""

    def __init__(self, quantities: int) -> None:
        """
        Begin with nothing known.

        :param quantities: how many there are
        """
        self._samples: deque[tuple[float | None, ...]] = deque(
            [(None,) * quantities] * self.LENGTH, self.LENGTH)
        self._next: int | None = None

    def add(self, now: int, *values: float | None) -> bool:
        """
        Sample the quantities if that is due.

        :param now: the present instant
        :param values: of each quantity, None for what is unknown
        :return: Whether there are new samples: more than one after a gap.
        """
        if self._next is None:
            self._next = now
        due = max((now - self._next) // self.PERIOD + 1, 0)
        self._next += due * self.PERIOD
        self._samples.extend([values] * min(due, self.LENGTH))
        return due > 0

    def columns(self) -> list[list[float | None]]:
        """Return the times of all samples (s, 0 for the latest), then the values of each kind."""
        times = [(number - self.LENGTH + 1) * self.PERIOD / NANOSECONDS
                 for number in range(self.LENGTH)]
        return [times, *map(list, zip(*self._samples))]


def common_instant(latest: Iterable[int], apart: int) -> int:
    """
    Return the latest instant at which the poses of all things are known.

    Things that move together, each drawn at its own latest instant, would be drawn apart.

    :param latest: the latest instant (ns) at which each pose is known, 0 for one that stands still
    :param apart: how far (ns) before the median one may be; farther back it is ignored, as it has
        stopped coming or is stamped by another clock
    :return: The instant, 0 if nothing moves.
    """
    moving = sorted(stamp for stamp in latest if stamp > 0)
    return next((stamp for stamp in moving if stamp >= moving[len(moving) // 2] - apart), 0)
