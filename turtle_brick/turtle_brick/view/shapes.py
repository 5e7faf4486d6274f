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
What can be drawn: shapes, and those of a robot's URDF. Pure, without ROS.

Of a URDF this reads what a viewer needs: the links with their visuals (box, cylinder, sphere; not
meshes), their materials, and which link is the root. Lengths are in meters.
"""

from math import cos, sin
from typing import NamedTuple
from xml.etree import ElementTree

from turtle_brick.core.geometry import (Color, from_pitch, from_yaw, IDENTITY, multiply, Pose,
                                        Quaternion, Vector)

GRAY: Color = (0.7, 0.7, 0.7, 1.0)
"""Color of a visual without a material."""

ORIGIN = Pose((0.0, 0.0, 0.0), IDENTITY)

LARGEST = 1e6
"""The largest number with which anything can be drawn."""


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


def is_drawable(*numbers: float) -> bool:
    """Return whether numbers are finite and not too large to draw."""
    return all(abs(number) <= LARGEST for number in numbers)


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
    colors = {material.get('name'): _color(color) for material in robot.iter('material')
              if (color := material.find('color')) is not None}
    links = {link.get('name', ''): tuple(
        Shape(solid.tag, _size(solid), _paint(visual, colors), _origin(visual))
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


def _numbers(element: ElementTree.Element, attribute: str, default: str = '') -> list[float]:
    """Return the numbers of an attribute."""
    return [float(word) for word in element.get(attribute, default).split()]


def _size(solid: ElementTree.Element) -> Vector:
    """Return the extents of a box, a cylinder or a sphere."""
    if solid.tag == 'box':
        x, y, z = _numbers(solid, 'size')
        return (x, y, z)
    diameter = 2.0 * float(solid.get('radius', ''))
    height = float(solid.get('length', '')) if solid.tag == 'cylinder' else diameter
    return (diameter, diameter, height)


def _origin(visual: ElementTree.Element) -> Pose:
    """Return where a visual is in its link."""
    origin = visual.find('origin')
    if origin is None:
        return ORIGIN
    x, y, z = _numbers(origin, 'xyz', '0 0 0')
    roll, pitch, yaw = _numbers(origin, 'rpy', '0 0 0')
    return Pose((x, y, z), from_rpy(roll, pitch, yaw))


def _color(color: ElementTree.Element) -> Color:
    """Return a color."""
    red, green, blue, alpha = _numbers(color, 'rgba')
    return (red, green, blue, alpha)


def _paint(visual: ElementTree.Element, colors: dict[str | None, Color]) -> Color:
    """Return the color of a visual: its own, or that of the material of this name."""
    material = visual.find('material')
    if material is None:
        return GRAY
    own = material.find('color')
    return colors.get(material.get('name'), GRAY) if own is None else _color(own)
