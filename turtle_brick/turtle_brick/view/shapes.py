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
What can be drawn: the shapes of a robot's URDF, and of markers for as long as these are shown.

Of a URDF this reads what a viewer needs: the links with their visuals (box, cylinder, sphere; not
meshes), their materials, and which link is the root. Lengths are in meters.
"""

from collections.abc import Callable
from itertools import chain
from math import cos, hypot, inf, sin
from typing import Any, NamedTuple
from xml.etree import ElementTree

from turtle_brick.core.geometry import (Color, from_pitch, from_yaw, IDENTITY, multiply, Pose,
                                        Quaternion, Vector)
from turtle_brick.core.time_steps import nanoseconds_of
from visualization_msgs.msg import Marker

GRAY: Color = (0.7, 0.7, 0.7, 1.0)
"""Color of a visual without a material."""

ORIGIN = Pose((0.0, 0.0, 0.0), IDENTITY)

LARGEST = 1e6
"""The largest number with which anything can be drawn."""

KINDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder',
         Marker.TEXT_VIEW_FACING: 'text'}
"""The kind of shape of each type of marker that is drawn."""


class Shape(NamedTuple):
    """A colored solid or text in some frame."""

    kind: str
    """'box', 'cylinder' (its axis is z), 'sphere' or 'text' (upright)."""
    size: Vector
    """Extents (m) along its own x, y and z; of a text only the last one counts."""
    color: Color
    pose: Pose = ORIGIN
    """Pose of its center in its frame."""
    text: str = ''


class Thing(NamedTuple):
    """Shapes that move together."""

    shapes: tuple[Shape, ...]
    pose: Pose
    """Pose of their frame in the world."""
    label: str = ''
    """If there is one, the axes of their frame are drawn, with this name."""


class RobotShapes(NamedTuple):
    """The visible parts of a robot."""

    root: str
    """The link that is no joint's child."""
    links: dict[str, tuple[Shape, ...]]
    """The shapes of each link, in its frame."""


class Markers:
    """The markers that are shown. `now` is an instant (ns) of a clock that only goes on."""

    def __init__(self) -> None:
        """Begin with none."""
        self._shown: dict[tuple[str, str, int], tuple[str, Shape, float]] = {}
        """Frame, shape and end of the lifetime, by what identifies a marker: topic, ns and id."""

    def hear(self, topic: str, message: Marker, now: int) -> None:
        """
        Add, change or remove a marker of a topic.

        :raises ValueError: it can't be drawn; the text says why
        """
        key = (topic, message.ns, message.id)
        self._shown.pop(key, None)
        if message.action == Marker.ADD:
            end = now + (nanoseconds_of(message.lifetime) or inf)
            self._shown[key] = (message.header.frame_id, shape_of(message), end)

    def things(self, now: int, pose_of: Callable[[str], Pose | None]) -> dict[str, Thing]:
        """
        Return the markers whose lifetime is not over and whose frames are known, by name.

        :param now: the present instant
        :param pose_of: returns the pose of a frame, None if it is unknown
        """
        self._shown = {key: mark for key, mark in self._shown.items() if now < mark[2]}
        return {f'{topic}/{namespace}/{number}': Thing((shape,), pose)
                for (topic, namespace, number), (frame, shape, _) in self._shown.items()
                if (pose := pose_of(frame)) is not None}


def is_drawable(*numbers: float) -> bool:
    """Return whether numbers are finite and not too large to draw."""
    return all(abs(number) <= LARGEST for number in numbers)


def shape_of(message: Marker) -> Shape:
    """
    Return the shape of a marker.

    :raises ValueError: it can't be drawn; the text says why
    """
    position, orientation = message.pose.position, message.pose.orientation
    quaternion = (orientation.x, orientation.y, orientation.z, orientation.w)
    length = hypot(*quaternion)
    pose = Pose((position.x, position.y, position.z), IDENTITY if length == 0.0 else
                tuple(part / length for part in quaternion))  # 0: as in rviz2
    size = (message.scale.x, message.scale.y, message.scale.z)
    color = (message.color.r, message.color.g, message.color.b, message.color.a)
    if not is_drawable(*size, *color, *chain(*pose)):
        raise ValueError('one of its numbers is not finite, or far too large')
    if message.type not in KINDS:
        raise ValueError(f'its type is {message.type}')
    return Shape(KINDS[message.type], size, color, pose, message.text)


def robot_shapes(description: str) -> RobotShapes:
    """
    Read a robot description.

    :param description: URDF, as in the topic robot_description
    :return: What is to be drawn of it.
    :raises ValueError: it is not XML, or no robot's; the text says why
    """
    try:
        robot = ElementTree.fromstring(description)
    except ElementTree.ParseError as error:
        raise ValueError(f'robot_description is not XML: {error}') from None
    colors = {material.get('name'): _numbers(color, 'rgba', 4)
              for material in robot.iter('material')
              if (color := material.find('color')) is not None}
    links = {link.get('name', ''): tuple(
        Shape(solid.tag, _size(solid), _color(visual, colors), _origin(visual))
        for visual in link.findall('visual') for solid in visual.findall('geometry/*')
        if solid.tag in ('box', 'cylinder', 'sphere')) for link in robot.findall('link')}
    children = {child.get('link') for child in robot.findall('joint/child')}
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise ValueError(f'robot_description has no single root link, but {roots}')
    return RobotShapes(roots[0], links)


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation about the fixed axes x, y and z, in this order (rad; REP 103)."""
    about_x = (sin(roll / 2.0), 0.0, 0.0, cos(roll / 2.0))
    return multiply(from_yaw(yaw), multiply(from_pitch(pitch), about_x))


def _numbers(element: ElementTree.Element, attribute: str, count: int, default: str = ''
             ) -> tuple[Any, ...]:
    """
    Return the numbers of an attribute.

    :raises ValueError: they are not so many, or cannot be drawn
    """
    text = element.get(attribute, default)
    numbers = tuple(map(float, text.split()))
    if len(numbers) != count or not is_drawable(*numbers):
        raise ValueError(f'{attribute} of <{element.tag}> is {text!r}')
    return numbers


def _size(solid: ElementTree.Element) -> Vector:
    """Return the extents of a box, a cylinder or a sphere."""
    if solid.tag == 'box':
        return _numbers(solid, 'size', 3)
    radius, = _numbers(solid, 'radius', 1)
    height, = _numbers(solid, 'length', 1) if solid.tag == 'cylinder' else (2.0 * radius,)
    return (2.0 * radius, 2.0 * radius, height)


def _origin(visual: ElementTree.Element) -> Pose:
    """Return where a visual is in its link."""
    origin = visual.find('origin')
    if origin is None:
        return ORIGIN
    return Pose(_numbers(origin, 'xyz', 3, '0 0 0'),
                from_rpy(*_numbers(origin, 'rpy', 3, '0 0 0')))


def _color(visual: ElementTree.Element, colors: dict[str | None, Color]) -> Color:
    """Return the color of a visual, which is that of the material of this name."""
    material = visual.find('material')
    return GRAY if material is None else colors.get(material.get('name'), GRAY)
