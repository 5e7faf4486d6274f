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
Robot descriptions as shapes to draw. Pure, without ROS.

Lengths are in meters. Of a URDF this reads what a viewer needs: the links with their visuals (box,
cylinder, sphere; not meshes), their materials, and which link is the root.
"""

from collections.abc import Iterable
from itertools import chain
from math import cos, sin
from typing import NamedTuple
from xml.etree import ElementTree

from turtle_brick.core.geometry import IDENTITY, multiply, Pose, Quaternion, Vector

Color = tuple[float, float, float, float]
"""Red, green, blue and opacity, each in [0, 1]."""

GRAY: Color = (0.7, 0.7, 0.7, 1.0)
"""Color of a visual without a material."""

ORIGIN = Pose((0.0, 0.0, 0.0), IDENTITY)

LARGEST = 1e6
"""The largest number with which anything can be drawn."""

LONGEST = 1_000_000
"""How many characters a robot description may have."""

MOST_LINKS = 200
MOST_VISUALS = 1000
"""How many links and visuals it may have."""


class UrdfError(ValueError):
    """A robot description cannot be read."""


class Shape(NamedTuple):
    """A colored solid, text or set of lines in some frame."""

    kind: str
    """'box', 'cylinder' (its axis is z), 'sphere', 'text' (upright) or 'lines'."""
    size: Vector
    """Extents (m) along its own x, y and z; of a text its height, of lines their width."""
    color: Color
    pose: Pose = ORIGIN
    """Pose of its center in its frame."""
    text: str = ''
    points: tuple[Vector, ...] = ()
    """The ends of the lines in the shape's own frame (m), two each."""

    def undrawable(self) -> float | None:
        """Return the first of its numbers that can't be drawn, None if all can be."""
        return undrawable(chain(
            self.size, self.color, self.pose.position, self.pose.orientation, *self.points))


class Robot(NamedTuple):
    """The visible parts of a robot."""

    name: str
    root: str
    """The link that is no joint's child."""
    links: dict[str, tuple[Shape, ...]]
    """The shapes of each link, in its frame."""
    undrawn: tuple[str, ...]
    """The visuals that are left out, in words."""


def undrawable(numbers: Iterable[float]) -> float | None:
    """Return the first number that is not finite or too large to draw, None if there is none."""
    return next((number for number in numbers if not abs(number) <= LARGEST), None)


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation about the fixed axes x, y and z, in this order (rad; REP 103)."""
    about_x = (sin(roll / 2.0), 0.0, 0.0, cos(roll / 2.0))
    about_y = (0.0, sin(pitch / 2.0), 0.0, cos(pitch / 2.0))
    about_z = (0.0, 0.0, sin(yaw / 2.0), cos(yaw / 2.0))
    return multiply(about_z, multiply(about_y, about_x))


def parse_urdf(description: str) -> Robot:
    """
    Read a robot description.

    :param description: URDF, as in the topic robot_description
    :return: Its links, with what is to be drawn of them.
    :raises UrdfError: it is not XML, not a robot, too large, or a value is not a number
    """
    if len(description) > LONGEST:
        raise UrdfError(f'robot_description has {len(description)} characters, which are more '
                        f'than {LONGEST}')
    if '<!DOCTYPE' in description:
        # It could define entities a million times as long as their names.
        raise UrdfError('robot_description has a <!DOCTYPE>, which no URDF needs')
    try:
        robot = ElementTree.fromstring(description)
    except (ElementTree.ParseError, ValueError) as error:
        raise UrdfError(f'robot_description is not XML: {error}') from None
    if robot.tag != 'robot':
        raise UrdfError(f'robot_description has <{robot.tag}> where <robot> is expected')
    materials = {material.get('name', ''): color for material in robot.findall('material')
                 if (color := _color(material)) is not None}
    for what, most in (('link', MOST_LINKS), ('link/visual', MOST_VISUALS)):
        count = len(robot.findall(what))
        if count > most:
            raise UrdfError(f'robot_description has {count} times {what}, where {most} are drawn')
    links: dict[str, tuple[Shape, ...]] = {}
    undrawn: list[str] = []
    for link in robot.findall('link'):
        name = link.get('name', '')
        shapes = []
        for visual in link.findall('visual'):
            solid = _solid(visual, name, undrawn)
            if solid is not None:
                kind, size = solid
                shapes.append(Shape(kind, size, _material(visual, materials), _origin(visual)))
        links[name] = tuple(shapes)
    children = {child.get('link') for child in robot.findall('joint/child')}
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise UrdfError('robot_description has no single root link, but '
                        f'{", ".join(roots) or "none"}')
    return Robot(robot.get('name', ''), roots[0], links, tuple(undrawn))


def _numbers(element: ElementTree.Element, attribute: str, default: str = '',
             count: int = 3) -> list[float]:
    """Return the numbers of an attribute."""
    words = element.get(attribute, default).split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or undrawable(numbers) is not None:
        raise UrdfError(f'robot_description has {attribute}="{element.get(attribute)}" in '
                        f'<{element.tag}>, where {count} numbers are expected')
    return numbers


def _origin(visual: ElementTree.Element) -> Pose:
    """Return where a visual is in its link."""
    origin = visual.find('origin')
    if origin is None:
        return ORIGIN
    x, y, z = _numbers(origin, 'xyz', '0 0 0')
    return Pose((x, y, z), from_rpy(*_numbers(origin, 'rpy', '0 0 0')))


def _solid(visual: ElementTree.Element, link: str,
           undrawn: list[str]) -> tuple[str, Vector] | None:
    """Return kind and extents of a visual; None if it can't be drawn, which is then noted."""
    solid = visual.find('geometry/*')
    if solid is None:
        raise UrdfError(f'robot_description has a visual without geometry in link {link}')
    if solid.tag == 'box':
        x, y, z = _numbers(solid, 'size')
        return 'box', (x, y, z)
    if solid.tag == 'cylinder':
        diameter = 2.0 * _numbers(solid, 'radius', count=1)[0]
        return 'cylinder', (diameter, diameter, _numbers(solid, 'length', count=1)[0])
    if solid.tag == 'sphere':
        diameter = 2.0 * _numbers(solid, 'radius', count=1)[0]
        return 'sphere', (diameter, diameter, diameter)
    undrawn.append(f'the {solid.tag} of link {link}')
    return None


def _color(material: ElementTree.Element) -> Color | None:
    """Return the color that a material defines, None if it defines none."""
    color = material.find('color')
    if color is None:
        return None
    red, green, blue, alpha = _numbers(color, 'rgba', count=4)
    return (red, green, blue, alpha)


def _material(visual: ElementTree.Element, materials: dict[str, Color]) -> Color:
    """Return the color of a visual: its own, or that of the robot's material of this name."""
    material = visual.find('material')
    if material is None:
        return GRAY
    return _color(material) or materials.get(material.get('name', ''), GRAY)
