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
What becomes of a brick that is dropped, seen from outside: from its transforms and the verdict.

`DropWatch` is fed with what was heard and knows no implementation; the demo and the referee tell
by it what happens. Instants are integer nanoseconds, lengths in m.
"""

from collections import deque
from math import dist, nan

import numpy
from turtle_referee.graph_client.constants import STILL, UNREACHABLE
from turtle_referee.graph_client.geometry import Array, inclination, Pose, Vector
from turtle_referee.graph_client.profile import NUMBERS
from turtle_referee.graph_client.record import Request, plateau, Record

MOVED = 1e-5  # how far (m) below its place a brick falls
STAY = 40_000_000  # time (ns) after which a brick that goes down no more has come down
FLOATS = 150_000_000  # time (ns) after which a brick that has slid and moves no more floats
SLID = 0.02  # how far (m) a brick slides at least before it may float
TILTED, LEVEL = 0.05, 0.02  # the inclination (rad) from which a platform is, and up to which
BESIDE = 0.15  # how far (m) outside its radius a brick may be that is on the platform
HEIGHT = slice(2, 3)  # of a place, the part that tells how high it is
HISTORY = 400  # the most positions of the brick that are looked back at


class DropWatch:
    """One drop, from shortly before it is asked for to the end."""

    def __init__(self, record: Record, begin: int, place: Vector, platform: Pose | None) -> None:
        """Begin to watch now (ns) a brick that hovers at a place, by what is heard."""
        self._record = record
        self._track: deque[tuple[int, Array]] = deque(maxlen=HISTORY)
        self._markers = len(record.markers)
        self._place_on_platform: Array | None = None
        self._looked_at = begin
        self.begin = begin
        self.end = begin
        self.place = place
        self.distance = nan if platform is None else dist(place[:2], platform.position[:2])
        """From the robot to the brick before the drop, seen from above."""
        self.asked: int | None = None
        self.released: int | None = None
        self.down: int | None = None
        self.landed: Array | None = None
        self.caught = False
        self.tilted: int | None = None
        self.carried_to: Array | None = None
        self.floated: int | None = None
        self.leveled: int | None = None
        self.refusals: list[int] = []  # when a marker said "Unreachable"
        self.goal: int | None = None  # when a goal was published first after the release
        self.ask: Request | None = None  # how the service drop answered
        self.should: bool | None = None  # whether it can be caught; None where both may be right

    @property
    def decided(self) -> int | None:
        """Return when it was known to everybody whether the brick can be caught, if it was."""
        return min(filter(None, (self.goal, *self.refusals)), default=None)

    def look(self) -> None:
        """Take note of what has been heard since the last time."""
        record = self._record
        self._look_for_verdicts()
        with numpy.errstate(all='ignore'):
            for stamp, pose in record.brick_track(self._looked_at + 1, 1 << 62):
                self._looked_at = stamp
                self._track.append((stamp, pose.position))
                self._follow(stamp, pose)

    def _look_for_verdicts(self) -> None:
        markers = self._record.markers
        for heard in markers[self._markers:]:
            if UNREACHABLE.lower() in heard.marker.text.lower() and heard.marker.action == 0:
                self.refusals.append(heard.published)
        self._markers = len(markers)
        if self.asked is not None and self.goal is None and self.down is None:
            self.goal = next((heard.published for heard in self._record.messages(
                'goal_pose', self.asked)), None)

    def _follow(self, stamp: int, pose: Pose) -> None:
        """Take note of a position of the brick."""
        track = self._track
        if self.released is None:
            if self.asked is not None and pose.position[2] < self.place[2] - MOVED:
                self.released = track[-2][0] if len(track) > 1 else stamp
                self._track = deque(list(track)[-2:], maxlen=HISTORY)
        elif self.down is None:
            self.down = plateau(track, STILL / 10.0, STAY, HEIGHT)
            if self.down is not None:
                self._land(pose)
        elif self.caught and self.floated is None:
            self._ride(stamp)
        elif self.floated is not None and self.leveled is None:
            platform = self._record.platform(stamp)
            if platform is not None and inclination(platform) < LEVEL:
                self.leveled = stamp

    def _land(self, pose: Pose) -> None:
        """Take note of where the brick has come down, by where it is shortly after."""
        assert self.down is not None
        record = self._record
        numbers = {**NUMBERS, **record.profile.numbers}
        self.landed = (record.brick(self.down) or pose).position
        self.caught = bool(self.landed[2] > numbers['platform_height'] / 2.0)
        platform = record.platform(self.down)
        # Where the machine stood still, nobody knows where the platform was meanwhile.
        if platform is not None:
            self.caught &= bool(dist(self.landed[:2], platform.position[:2])
                                <= numbers['platform_radius'] + BESIDE)

    def _ride(self, stamp: int) -> None:
        """Take note of what has become of a brick on the platform by an instant (ns)."""
        platform, place = self._record.platform(stamp), self._record.on_platform(stamp)
        if platform is None or place is None:
            return
        if self.tilted is None:
            if inclination(platform) > TILTED:
                self.tilted = stamp
                self.carried_to = platform.position[:2]
                self._place_on_platform = place
            return
        assert self._place_on_platform is not None
        if dist(place, self._place_on_platform) > SLID:
            self.floated = plateau(self._track, STILL, FLOATS)
