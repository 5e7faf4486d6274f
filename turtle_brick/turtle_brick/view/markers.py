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
The markers that are shown, and for how long: each is a shape that goes with its frame.

Instants are in ns; `now` is a clock that only goes on.
"""

from collections.abc import Callable
from itertools import chain
from math import hypot, inf
from typing import NamedTuple

from turtle_brick.core.geometry import Pose
from turtle_brick.core.time_steps import nanoseconds_of
from turtle_brick.view.shapes import is_drawable, ORIGIN, Shape, Thing
from visualization_msgs.msg import Marker

SOLIDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder'}

Key = tuple[str, str, int]
"""A marker's topic, namespace and id, which identify it."""


class Mark(NamedTuple):
    """A marker: a shape in a frame."""

    frame: str
    shape: Shape
    end: float
    """When its lifetime is over."""


class Markers:
    """The markers that are shown."""

    def __init__(self) -> None:
        """Begin with none."""
        self._shown: dict[Key, Mark] = {}

    def hear(self, topic: str, message: Marker, now: int) -> None:
        """
        Add, change or remove a marker of a topic.

        :raises ValueError: it can't be drawn; the text says why
        """
        key = (topic, message.ns, message.id)
        if message.action == Marker.DELETEALL:
            self._shown = {key: mark for key, mark in self._shown.items() if key[0] != topic}
        elif message.action == Marker.DELETE:
            self._shown.pop(key, None)
        elif message.action == Marker.ADD:
            if not message.header.frame_id:
                raise ValueError('its frame_id is empty')
            end = now + (nanoseconds_of(message.lifetime) or inf)
            self._shown[key] = Mark(message.header.frame_id, shape_of(message), end)
        else:
            raise ValueError(f'its action is {message.action}')

    def things(self, now: int, pose_of: Callable[[str], Pose | None]) -> dict[str, Thing]:
        """
        Return the markers whose lifetime is not over and whose frames are known, by name.

        :param now: the present instant
        :param pose_of: returns the pose of a frame, None if it is unknown
        """
        self._shown = {key: mark for key, mark in self._shown.items() if now < mark.end}
        return {f'{topic}/{namespace}/{number}': Thing((mark.shape,), pose)
                for (topic, namespace, number), mark in self._shown.items()
                if (pose := pose_of(mark.frame)) is not None}


def shape_of(message: Marker) -> Shape:
    """
    Return the shape of a marker.

    :raises ValueError: it can't be drawn; the text says why
    """
    position, orientation = message.pose.position, message.pose.orientation
    quaternion = (orientation.x, orientation.y, orientation.z, orientation.w)
    length = hypot(*quaternion)
    pose = Pose((position.x, position.y, position.z), ORIGIN.orientation if length == 0.0 else
                tuple(part / length for part in quaternion))  # 0: as in rviz2
    size = (message.scale.x, message.scale.y, message.scale.z)
    color = (message.color.r, message.color.g, message.color.b, message.color.a)
    if not is_drawable(*size, *color, *chain(*pose)):
        raise ValueError('one of its numbers is not finite, or far too large')
    if message.type == Marker.TEXT_VIEW_FACING:
        return Shape('text', size, color, pose, message.text)
    if message.type in SOLIDS:
        return Shape(SOLIDS[message.type], size, color, pose)
    raise ValueError(f'its type is {message.type}')
