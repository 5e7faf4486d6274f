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
What the viewer derives from messages: markers, rates, curves, and what the robot does. Pure.

Instants are integer nanoseconds.
"""

from collections import deque
from collections.abc import Iterable
from math import hypot
from typing import NamedTuple

from turtle_brick.core.geometry import Pose
from turtle_brick.core.time_steps import NANOSECONDS
from turtle_brick.physics import Phase
from turtle_brick.view.urdf_scene import Shape

Key = tuple[str, str, int]
"""A marker's topic, namespace and id, which identify it."""


class Mark(NamedTuple):
    """A marker: a shape in a frame."""

    frame: str
    shape: Shape
    locked: bool
    """Whether it moves with its frame; otherwise it stays where its frame was."""
    stamp: int
    """If it isn't locked: the instant of its frame that is meant, 0 for the latest."""
    expires: int | None
    """When its lifetime ends, None for never."""
    placed: Pose | None = None
    """If it isn't locked: the pose of its frame in the world, once that is known."""
    heard: int = 0
    """When its lifetime began: a clock may be set back."""


class Marks:
    """The markers that are shown."""

    def __init__(self) -> None:
        """Begin with none."""
        self.shown: dict[Key, Mark] = {}
        """The markers by their keys."""

    def put(self, key: Key, mark: Mark) -> None:
        """Add a marker; it replaces the one with the same key."""
        self.shown[key] = mark

    def remove(self, key: Key) -> None:
        """Remove a marker, if it is there."""
        self.shown.pop(key, None)

    def clear(self, topic: str) -> None:
        """Remove all markers of a topic."""
        for key in [key for key in self.shown if key[0] == topic]:
            del self.shown[key]

    def count(self, topic: str) -> int:
        """Return how many markers of a topic there are."""
        return sum(key[0] == topic for key in self.shown)

    def expire(self, now: int) -> None:
        """Remove the markers whose lifetime is over, or has not begun."""
        for key in [key for key, mark in self.shown.items()
                    if mark.expires is not None and not mark.heard <= now < mark.expires]:
            del self.shown[key]


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


class Rate:
    """How often something came in the last seconds."""

    WINDOW = 2 * NANOSECONDS
    """How far back (ns) it looks."""

    MOST = 5000
    """How many instants it keeps."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._events: deque[tuple[int, int]] = deque(maxlen=self.MOST)

    def add(self, stamp: int, count: int = 1) -> None:
        """Count events at an instant (ns)."""
        events = self._events
        if events and stamp < events[-1][0] - self.WINDOW:
            events.clear()  # the clock was set back
        while events and events[0][0] < stamp - self.WINDOW:
            events.popleft()
        events.append((stamp, count))

    def value(self, now: int) -> float | None:
        """Return the events per second at an instant (ns), None with fewer than two instants."""
        recent = [event for event in self._events if abs(now - event[0]) <= self.WINDOW]
        if len(recent) < 2 or recent[-1][0] <= recent[0][0]:
            return None
        # The first ones end the interval before them, which is not in the window.
        count = sum(count for _, count in recent) - recent[0][1]
        return count * NANOSECONDS / (recent[-1][0] - recent[0][0])


class History:
    """Samples of some quantities in the last seconds, one for each period of the clock."""

    PERIOD = NANOSECONDS // 10
    """Time (ns) between two samples."""

    LENGTH = 120
    """How many samples it keeps."""

    def __init__(self, quantities: int) -> None:
        """
        Begin with nothing known.

        :param quantities: how many values a sample has
        """
        self._unknown: tuple[float | None, ...] = (None,) * quantities
        self._samples: deque[tuple[float | None, ...]] = deque(
            [self._unknown] * self.LENGTH, maxlen=self.LENGTH)
        self._latest = 0

    def is_due(self, now: int) -> bool:
        """Return whether there is no sample yet for the period of an instant (ns)."""
        return now // self.PERIOD != self._latest

    def add(self, now: int, values: tuple[float | None, ...]) -> None:
        """Add the sample of an instant (ns), None for what is unknown then."""
        periods = now // self.PERIOD - self._latest
        # After a long gap, or when the clock was set back, nothing before is known.
        missed = periods - 1 if 0 < periods <= self.LENGTH else self.LENGTH
        self._samples.extend([self._unknown] * missed)
        self._samples.append(values)
        self._latest += periods

    def columns(self) -> list[list[float | None]]:
        """Return the times of all samples (s, 0 for the latest), then the values of each kind."""
        times = [(number - self.LENGTH + 1) * self.PERIOD / NANOSECONDS
                 for number in range(self.LENGTH)]
        return [times, *map(list, zip(*self._samples))]


class Account:
    """What the robot does about the brick, as far as the topics tell."""

    UNDER = 0.05
    """How far (m) from the point below the brick a goal may be to count as catching it."""

    LEVEL = 1e-3
    """The largest tilt (rad) of a level platform."""

    def __init__(self) -> None:
        """Begin with nothing known."""
        self.phase: Phase | None = None
        """What the brick does, None if that is unknown."""
        self.unreachable = False
        """Whether the brick was declared unreachable in its present or last fall."""
        self._goal: tuple[float, float] | None = None
        self._tilt = 0.0
        self._pursued = False

    def see_phase(self, phase: Phase | None) -> None:
        """Note what the brick does; None if that is unknown."""
        if phase is not self.phase:
            self.phase = phase
            self._goal = None
            if phase in (Phase.FALLING, Phase.HOVERING):
                self.unreachable = False
                self._pursued = False

    def see_goal(self, x: float, y: float, brick: tuple[float, float] | None) -> None:
        """Note that the robot is sent to a point of the world (m), and where the brick is."""
        self._goal = (x, y)
        if self.phase is Phase.FALLING and brick is not None:
            self._pursued = hypot(x - brick[0], y - brick[1]) <= self.UNDER

    def see_tilt(self, angle: float) -> None:
        """Note the angle (rad) that the platform is set to."""
        self._tilt = angle

    def see_unreachable(self) -> None:
        """Note that the brick is declared unreachable."""
        self.unreachable = True

    def sentence(self) -> str:
        """Return what the robot does, in words."""
        tilted = abs(self._tilt) > self.LEVEL
        if self.phase is Phase.FALLING:
            if self.unreachable:
                return 'Unreachable'
            return 'Reachable: driving under the brick' if self._pursued else 'The brick falls'
        if self.phase is Phase.RIDING:
            if tilted:
                return 'Tipping the brick off'
            if self._goal is not None:
                return 'Caught: carrying it to ({:.2f}, {:.2f})'.format(*self._goal)
            return 'Caught'
        if self.phase is Phase.GROUNDED and self.unreachable:
            return 'Unreachable: it fell to the ground'
        if self.phase is Phase.GROUNDED and self._pursued:
            return 'Missed: it fell to the ground'
        if tilted:
            return 'Tipped off' if self.phase is Phase.FLOATING else 'Platform tilted'
        return 'Waiting for a brick to fall'
