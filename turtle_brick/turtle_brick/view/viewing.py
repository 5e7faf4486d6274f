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
What the viewer makes of what it hears: markers, rates, and what the robot is up to. Pure.

Instants are integer nanoseconds.
"""

from collections import deque
from collections.abc import Iterable
from math import hypot
from typing import NamedTuple

from turtle_brick.geometry import Pose
from turtle_brick.physics import Phase
from turtle_brick.step_clock import NANOSECONDS
from turtle_brick.view.urdf_scene import Shape

Key = tuple[str, str, int]
"""A marker's topic, namespace and id, which tell it from every other."""


class Mark(NamedTuple):
    """A marker: something to draw in a frame."""

    frame: str
    shape: Shape
    locked: bool
    """Whether it moves with its frame; otherwise it stays where its frame was."""
    stamp: int
    """The instant at which its frame is meant if it isn't locked, 0 for the latest."""
    expires: int | None
    """The instant from which it is not to be seen any more, None for never."""
    placed: Pose | None = None
    """Pose of its frame in the world, once that is known for one that isn't locked."""
    heard: int = 0
    """The instant before which it is not to be seen if it expires: time may go back."""


class Marks:
    """The markers that are to be seen."""

    def __init__(self) -> None:
        """Begin with none."""
        self.shown: dict[Key, Mark] = {}

    def put(self, key: Key, mark: Mark) -> None:
        """Add a marker, in place of what has the same key."""
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
    Return an instant at which it is known of all things where they are: the latest one.

    At their own latest instants things that move together are drawn at places that they had one
    after the other.

    :param latest: the latest instant at which it is known of each (ns), 0 for one that stands
        still
    :param apart: how far (ns) from the median one may be; farther from it one counts for nothing,
        as it has stopped coming, or is stamped by another clock
    :return: The instant, 0 if none moves.
    """
    moving = sorted(stamp for stamp in latest if stamp > 0)
    return next((stamp for stamp in moving if stamp >= moving[len(moving) // 2] - apart), 0)


class Rate:
    """How often something comes, over the last few seconds."""

    def __init__(self, window: int = 2 * NANOSECONDS) -> None:
        """
        Count from nothing.

        :param window: how far back it looks (ns)
        """
        self._window = window
        self._events: deque[tuple[int, int]] = deque()
        self._count = 0

    def add(self, stamp: int, count: int = 1) -> None:
        """Count events at an instant, long before that of the last ones if time has gone back."""
        if self._events and stamp < self._events[-1][0] - self._window:
            self._clear()
        self._events.append((stamp, count))
        self._count += count

    def value(self, now: int) -> float | None:
        """Return events per second, None where fewer than two instants are in sight."""
        events = self._events
        if events and events[-1][0] > now + self._window:
            self._clear()
        while events and events[0][0] < now - self._window:
            self._count -= events.popleft()[1]
        if len(events) < 2 or events[-1][0] <= events[0][0]:
            return None
        # The first ones end the interval before them, which is not in the window.
        return (self._count - events[0][1]) * NANOSECONDS / (events[-1][0] - events[0][0])

    def _clear(self) -> None:
        """Begin again."""
        self._events.clear()
        self._count = 0


class Account:
    """What the robot is up to with the brick, as far as the topics tell."""

    UNDER = 0.05
    """How far (m) from beneath the brick a goal is still taken for one to catch it."""

    LEVEL = 1e-3
    """The tilt (rad) up to which a platform is level."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self.phase: Phase | None = None
        self._goal: tuple[float, float] | None = None
        self._tilt = 0.0
        self._unreachable = False
        self._pursued = False

    def see_phase(self, phase: Phase | None) -> None:
        """Take note of what the brick does; None if that can't be told."""
        if phase is not self.phase:
            self.phase = phase
            self._goal = None
            if phase in (Phase.FALLING, Phase.HOVERING):
                self._unreachable = False
                self._pursued = False

    def see_goal(self, x: float, y: float, brick: tuple[float, float] | None) -> None:
        """Take note that the robot is sent to a point of the world, the brick being at another."""
        self._goal = (x, y)
        if self.phase is Phase.FALLING and brick is not None:
            self._pursued = hypot(x - brick[0], y - brick[1]) <= self.UNDER

    def see_tilt(self, angle: float) -> None:
        """Take note of the angle (rad) that the platform is given."""
        self._tilt = angle

    def see_unreachable(self) -> None:
        """Take note that the brick is declared out of reach."""
        self._unreachable = True

    @property
    def unreachable(self) -> bool:
        """Whether the brick is out of reach, since it began to fall."""
        return self._unreachable

    def sentence(self) -> str:
        """Say it."""
        tilted = abs(self._tilt) > self.LEVEL
        if self.phase is Phase.FALLING:
            if self._unreachable:
                return 'Unreachable'
            return 'Reachable: driving under the brick' if self._pursued else 'The brick falls'
        if self.phase is Phase.RIDING:
            if tilted:
                return 'Tipping the brick off'
            if self._goal is not None:
                return 'Caught: carrying it to ({:.2f}, {:.2f})'.format(*self._goal)
            return 'Caught'
        if self.phase is Phase.GROUNDED and self._unreachable:
            return 'Unreachable: it fell to the ground'
        if self.phase is Phase.GROUNDED and self._pursued:
            return 'Missed: it fell to the ground'
        if tilted:
            return 'Tipped off' if self.phase is Phase.FLOATING else 'Platform tilted'
        return 'Waiting for a brick to fall'
