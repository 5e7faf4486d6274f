# SPDX-License-Identifier: Apache-2.0
"""Read the links, joints, visual elements and colors in a URDF."""

from math import hypot, isfinite
from typing import NamedTuple
from xml.etree import ElementTree

from turtle_graph.client.geometry import from_rpy, Pose, Vector

SIZES = {'box': {'size': 3}, 'cylinder': {'radius': 1, 'length': 1}, 'sphere': {'radius': 1}}
"""Attributes that define the size of each kind of geometry, with their number of values."""


class Visual(NamedTuple):
    """A visual element of a link."""

    kind: str  # 'box', 'cylinder' (along z), 'sphere', another geometry tag, or '' without one.
    size: tuple[float, ...]  # Values (m) of the attributes in SIZES.
    pose: Pose  # In the frame of the link.
    material: str | None  # Name of the material, '' without a material, or None without a name.
    color: tuple[float, ...]  # Values of `rgba` if the element itself has a color.


class Joint(NamedTuple):
    """A joint between two links."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Vector  # Unit vector of the joint axis in the joint frame.

    @property
    def movable(self) -> bool:
        """Return whether the joint can rotate."""
        return self.kind in ('revolute', 'continuous')


class Robot(NamedTuple):
    """The content of a URDF."""

    links: dict[str, list[Visual]]  # Visual elements of each link.
    joints: list[Joint]
    colors: dict[str, tuple[float, ...]]  # Values of `rgba` for each name of a material.


def read_urdf(description: str) -> Robot:
    """
    Read a URDF.

    :param description: text of the URDF
    :return: the robot, with lengths in m
    :raises ElementTree.ParseError: if the text is not valid XML
    :raises ValueError: if a number is invalid, or if a joint does not connect two links
    """
    robot = ElementTree.fromstring(description)
    links = {link.get('name', ''): [_read_visual(visual) for visual in link.findall('visual')]
             for link in robot.findall('link')}
    colors: dict[str, tuple[float, ...]] = {}
    for material in (*robot.findall('material'), *robot.findall('link/visual/material')):
        # If several materials have the same name, urdfdom uses the first one.
        name, color = material.get('name'), _read_color(material)
        if name and color:
            colors.setdefault(name, color)
    return Robot(links, [_read_joint(joint) for joint in robot.findall('joint')], colors)


def _read_visual(element: ElementTree.Element) -> Visual:
    geometry, material = element.find('geometry/*'), element.find('material')
    kind = ''
    size: tuple[float, ...] = ()
    if geometry is not None:
        kind = geometry.tag
        size = tuple(number for attribute, count in SIZES.get(kind, {}).items()
                     for number in _read_numbers(geometry, attribute, count))
    if material is None:
        return Visual(kind, size, _read_origin(element), '', ())
    return Visual(kind, size, _read_origin(element), material.get('name'), _read_color(material))


def _read_color(material: ElementTree.Element) -> tuple[float, ...]:
    color = material.find('color')
    return () if color is None else tuple(map(float, color.get('rgba', '').split()))


def _read_joint(element: ElementTree.Element) -> Joint:
    name = element.get('name', '')
    parent, child = element.find('parent'), element.find('child')
    if parent is None or child is None:
        raise ValueError(f'the joint {name} does not connect two links')
    x, y, z = _read_vector(element.find('axis'), 'xyz', (1.0, 0.0, 0.0))
    length = hypot(x, y, z) or 1.0
    return Joint(name, element.get('type', ''), parent.get('link', ''), child.get('link', ''),
                 _read_origin(element), (x / length, y / length, z / length))


def _read_origin(element: ElementTree.Element) -> Pose:
    """Return the origin of a joint or visual element in the frame of the link that has it."""
    origin = element.find('origin')
    return Pose(_read_vector(origin, 'xyz'), from_rpy(*_read_vector(origin, 'rpy')))


def _read_vector(element: ElementTree.Element | None, attribute: str,
                 default: Vector = (0.0, 0.0, 0.0)) -> Vector:
    if element is None or attribute not in element.attrib:
        return default
    x, y, z = _read_numbers(element, attribute, 3)
    return x, y, z


def _read_numbers(element: ElementTree.Element, attribute: str, count: int) -> tuple[float, ...]:
    """Return the numbers in an XML attribute, or raise ValueError if the text is invalid."""
    text = element.get(attribute, '')
    try:
        numbers = tuple(map(float, text.split()))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(isfinite, numbers)):
        raise ValueError(f'{attribute} of <{element.tag}> is {text!r}')
    return numbers
