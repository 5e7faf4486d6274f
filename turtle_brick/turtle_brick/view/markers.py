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
The markers that are shown, and for how long.

Instants are in ns; `now` is a clock that only goes on.
"""

from collections.abc import Callable
from itertools import chain
from math import hypot
from typing import NamedTuple

from builtin_interfaces.msg import Time
from turtle_brick.core.geometry import Pose
from turtle_brick.core.time_steps import NANOSECONDS, nanoseconds_of
from turtle_brick.view.shapes import is_drawable, ORIGIN, Shape, Thing
from visualization_msgs.msg import Marker

SOLIDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder'}

Key = tuple[str, str, int]
"""A marker's topic, namespace and id, which identify it."""


class Mark(NamedTuple):
    """A marker: a shape in a frame."""

    frame: str
    shape: Shape
    locked: bool
    """Whether it moves with its frame; otherwise it stays where its frame was."""
    stamp: int
    """If it isn't locked: the instant of its frame that is meant (ROS time), 0 for the latest."""
    end: int | None
    """When its lifetime is over, None for never."""
    pose: Pose | None = None
    """If it isn't locked: the pose of its frame in the world, once that is known."""


class Markers:
    """The markers that are shown."""

    def __init__(self) -> None:
        """Begin with none."""
        self._shown: dict[Key, Mark] = {}

    def hear(self, topic: str, message: Marker, now: int) -> None:
        """
        Add, change or remove a marker.

        :param topic: where it came from
        :param message: what came
        :param now: when it came
        :raises ValueError: it can't be drawn; the text says why
        """
        key = (topic, message.ns, message.id)
        if message.action == Marker.DELETEALL:
            self._shown = {key: mark for key, mark in self._shown.items() if key[0] != topic}
        elif message.action == Marker.DELETE:
            self._shown.pop(key, None)
        elif message.action == Marker.ADD:
            self._shown[key] = mark_of(message, now)
        else:
            raise ValueError(f'its action is {message.action}')

    def things(self, now: int, pose_of: Callable[[str, int], Pose | None]) -> dict[str, Thing]:
        """
        Return the markers whose lifetime is not over and whose frames are known, by name.

        :param now: the present instant
        :param pose_of: returns the pose of a frame at a stamp (0 for the latest), None if unknown
        """
        self._shown = {key: mark for key, mark in self._shown.items()
                       if mark.end is None or now < mark.end}
        things = {}
        for (topic, namespace, number), mark in self._shown.items():
            pose = mark.pose or pose_of(mark.frame, 0 if mark.locked else mark.stamp)
            if pose is not None:
                things[f'{topic}/{namespace}/{number}'] = Thing((mark.shape,), pose)
                if not mark.locked:
                    self._shown[topic, namespace, number] = mark._replace(pose=pose)
        return things


def mark_of(message: Marker, now: int) -> Mark:
    """
    Read a marker that is to be added.

    :param message: the marker
    :param now: when it came
    :raises ValueError: it can't be drawn; the text says why
    """
    if not message.header.frame_id:
        raise ValueError('its frame_id is empty')
    shape = shape_of(message)
    if not is_drawable(*shape.size, *shape.color, *chain(*shape.pose), *chain(*shape.points)):
        raise ValueError('one of its numbers is not finite, or far too large')
    stamp, lifetime = _instant(message.header.stamp), _instant(message.lifetime)
    return Mark(message.header.frame_id, shape, message.frame_locked, stamp,
                now + lifetime if lifetime else None)


def _instant(stamp: Time) -> int:
    """Return a stamp or duration (ns)."""
    if stamp.sec < 0 or stamp.nanosec >= NANOSECONDS:
        raise ValueError(f'its stamp or lifetime is {stamp.sec} s and {stamp.nanosec} ns')
    return nanoseconds_of(stamp)


def shape_of(message: Marker) -> Shape:
    """
    Return the shape of a marker.

    :raises ValueError: its type is not one that is drawn
    """
    position, orientation = message.pose.position, message.pose.orientation
    quaternion = (orientation.x, orientation.y, orientation.z, orientation.w)
    length = hypot(*quaternion)
    pose = Pose((position.x, position.y, position.z), ORIGIN.orientation if length == 0.0 else
                tuple(part / length for part in quaternion))  # 0: as in rviz2
    width, height = message.scale.x, message.scale.z
    color = (message.color.r, message.color.g, message.color.b, message.color.a)
    if message.type in SOLIDS:
        return Shape(SOLIDS[message.type], (width, message.scale.y, height), color, pose)
    if message.type == Marker.TEXT_VIEW_FACING:
        return Shape('text', (height, height, height), color, pose, text=message.text)
    if message.type not in (Marker.LINE_STRIP, Marker.LINE_LIST):
        raise ValueError(f'its type is {message.type}')
    points = [(point.x, point.y, point.z) for point in message.points]
    if message.type == Marker.LINE_STRIP:
        points = [point for pair in zip(points, points[1:]) for point in pair]
    return Shape('lines', (width, width, width), color, pose,
                 points=tuple(points[:len(points) // 2 * 2]))
