# SPDX-License-Identifier: Apache-2.0

"""Record and replay the last drop. Times (ns) come from a monotonic clock, not from ROS."""

from bisect import bisect
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from turtle_graph.client.geometry import interpolate, Vector
from turtle_graph.view.shapes import SceneObject

MAX_SNAPSHOTS = 600
"""Maximum number of snapshots in a recording, enough for 30 s."""


class Snapshot(NamedTuple):
    """The objects in the scene at a given time (ns), and the points (m) to keep in the picture."""

    time: int
    objects: Mapping[str, SceneObject]
    points: Sequence[Vector]


class Replay:
    """Records the scene during each drop and replays the last recording."""

    def __init__(self) -> None:
        self._snapshots: list[Snapshot] = []
        self._brick_state = ''
        self._start: int | None = None
        self._speed = 1.0

    def record(self, snapshot: Snapshot, brick_state: str) -> None:
        """Record a snapshot if the brick is falling or riding. A new drop stops the replay."""
        if brick_state == 'falling' and self._brick_state != 'falling':
            self._snapshots = []
            self._start = None
        self._brick_state = brick_state
        if brick_state in ('falling', 'riding') and len(self._snapshots) < MAX_SNAPSHOTS:
            self._snapshots.append(snapshot)

    def toggle(self, now: int, speed: float) -> bool:
        """Start or stop the replay, and return whether a drop has been recorded."""
        self._start = now if self._snapshots and self._start is None else None
        self._speed = speed
        return bool(self._snapshots)

    def snapshot(self, now: int) -> Snapshot | None:
        """Return the current snapshot of the replay, or None if no replay is running."""
        if self._start is None:
            return None
        time = self._snapshots[0].time + round((now - self._start) * self._speed)
        index = bisect(self._snapshots, time, key=lambda snapshot: snapshot.time)
        if index == len(self._snapshots):
            self._start = None
            return None
        before, after = self._snapshots[index - 1:index + 1]
        fraction = (time - before.time) / (after.time - before.time)
        objects = {name: shown._replace(pose=interpolate(
            shown.pose, after.objects[name].pose, fraction))
            for name, shown in before.objects.items() if name in after.objects}
        return Snapshot(time, objects, before.points)
