# SPDX-License-Identifier: Apache-2.0
"""Observe a dropped brick, the robot's goal and the "Unreachable" marker."""

from collections import deque
from math import dist, nan
from typing import Any

import numpy
from turtle_graph.client.geometry import Array, inclination, Pose, Vector
from turtle_graph.client.profiles import NUMBERS
from turtle_graph.client.record import Record, Request, rest_start

UNREACHABLE = 'Unreachable'
"""Text of the marker for a brick that cannot be caught."""
STILL = 1e-3
"""Distance (m) by which a brick may move and still be considered at rest."""
MIN_FALL = 1e-5
"""Distance (m) from the starting position beyond which a brick is considered to be falling."""
LANDING_NS = 40_000_000
"""Duration (ns) at a constant height after which a brick is considered to have landed."""
FLOATING_NS = 150_000_000
"""Time (ns) without motion after which a brick that slid on the platform counts as floating."""
MIN_SLIDE = 0.02
"""Distance (m) that a brick must slide on the tilted platform before it can count as floating."""
TILTED, LEVEL = 0.05, 0.02
"""Minimum inclination of a tilted platform and maximum inclination of a level platform (rad)."""
MARGIN = 0.15
"""Maximum distance (m) by which the center of a caught brick may be beyond the platform edge."""
MAX_WAIT_NS = 1_000_000_000
"""Maximum time (ns) for which a transform of the brick waits for those of the platform."""
HISTORY = 400
"""Number of stored brick positions."""


def says_unreachable(marker: Any) -> bool:
    """Return whether the text of a marker contains "Unreachable"."""
    return UNREACHABLE.lower() in marker.text.lower()


class DropWatch:
    """The timestamps (ns) of all events in one drop."""

    def __init__(self, record: Record, begin: int, place: Vector) -> None:
        """Observe a brick from the time `begin` (ns), when the brick hovers at `place` (m)."""
        platform = record.pose('platform', begin)
        self._record = record
        self._track: deque[tuple[int, Vector]] = deque(maxlen=HISTORY)
        self._marker_count = len(record.markers)
        self._place_on_platform: Array | None = None
        self._last_stamp = begin
        self.begin = self.end = begin
        self.place = place
        # Horizontal distance (m) between the robot and the brick before the drop.
        self.distance = nan if platform is None else dist(place[:2], platform.position[:2])
        self.requested: int | None = None
        self.released: int | None = None
        self.down: int | None = None
        self.landed: Vector | None = None
        self.caught = False
        self.tilted: int | None = None
        self.carried_to: tuple[float, float] | None = None
        self.floated: int | None = None
        self.leveled: int | None = None
        self.refusals: list[int] = []
        self.goal: int | None = None  # Publication time (ns) of the first goal after the drop.
        self.request: Request | None = None
        self.should_be_caught: bool | None = None  # None if a miss is acceptable.

    @property
    def decided(self) -> int | None:
        """Return the time (ns) of the first goal or "Unreachable" marker, or None."""
        return min(filter(None, (self.goal, *self.refusals)), default=None)

    def update(self) -> None:
        """Process the messages received since the last call."""
        self._update_verdict()
        with numpy.errstate(all='ignore'):
            frame = self._record.frames.get(self._record.actual('brick'))
            samples = frame.between(self._last_stamp + 1, 1 << 62) if frame else []
            for sample in samples:
                pose = self._record.pose('brick', sample.stamp)
                if pose is None and samples[-1].stamp - sample.stamp < MAX_WAIT_NS:
                    break  # On a busy machine, the pose of the platform may be late.
                self._last_stamp = sample.stamp
                if pose is not None:
                    self._track.append((sample.stamp, pose.position))
                    self._follow(sample.stamp, pose)

    def _update_verdict(self) -> None:
        markers = self._record.markers
        for received in markers[self._marker_count:]:
            if says_unreachable(received.marker) and received.marker.action == 0:
                self.refusals.append(received.published)
        self._marker_count = len(markers)
        if self.requested is not None and self.goal is None and self.down is None:
            self.goal = next((received.published for received in self._record.messages(
                'goal_pose', self.requested)), None)

    def _follow(self, stamp: int, pose: Pose) -> None:
        track = self._track
        if self.released is None:
            if self.requested is not None and pose.position[2] < self.place[2] - MIN_FALL:
                self.released = track[-2][0] if len(track) > 1 else stamp
                self._track = deque(list(track)[-2:], maxlen=HISTORY)
        elif self.down is None:
            heights = [(time, position[2:]) for time, position in track]
            self.down = rest_start(heights, STILL / 10.0, LANDING_NS)
            if self.down is not None:
                self._land(pose, self.down)
        elif self.caught and self.floated is None:
            self._ride(stamp)
        elif self.floated is not None and self.leveled is None:
            platform = self._record.pose('platform', stamp)
            if platform is not None and inclination(platform) < LEVEL:
                self.leveled = stamp

    def _land(self, pose: Pose, down: int) -> None:
        record = self._record
        numbers = {**NUMBERS, **record.profile.numbers}
        self.landed = (record.pose('brick', down) or pose).position
        self.caught = bool(self.landed[2] > numbers['platform_height'] / 2.0)
        platform = record.pose('platform', down)
        if platform is not None:  # After a stall, the platform's pose may be unknown.
            self.caught &= bool(dist(self.landed[:2], platform.position[:2])
                                <= numbers['platform_radius'] + MARGIN)

    def _ride(self, stamp: int) -> None:
        platform, place = self._record.pose('platform', stamp), self._record.on_platform(stamp)
        if platform is None or place is None:
            return
        is_tilted = inclination(platform) > TILTED
        if self._place_on_platform is None or not (is_tilted or self.tilted):
            self._place_on_platform = place
        if self.tilted is None:
            if is_tilted:
                self.tilted = stamp
                self.carried_to = platform.position[:2]
        elif dist(place, self._place_on_platform) > MIN_SLIDE:
            since = rest_start(self._track, STILL, FLOATING_NS)
            # The brick may tilt later than the platform. Until then, it is still at rest.
            self.floated = since if since is not None and since > self.tilted else None
