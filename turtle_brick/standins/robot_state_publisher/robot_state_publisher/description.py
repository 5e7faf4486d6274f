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
"""The joints of a robot, as its URDF describes them; without ROS."""

from math import cos, sin, sqrt
from typing import NamedTuple
from xml.etree import ElementTree

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_ROTATING = ('continuous', 'revolute')
_SLIDING = ('prismatic',)
# A planar joint stays where it is, as in robot_state_publisher.
_RESTING = ('fixed', 'planar')
# A floating joint is not published at all.
_FREE = ('floating',)


class DescriptionError(ValueError):
    """A robot_description that describes no robot; the text says why."""


class Mimic(NamedTuple):
    """How a joint follows another one: position = multiplier * the other's + offset."""

    joint: str
    multiplier: float
    offset: float


class Joint(NamedTuple):
    """A joint between two links: its origin (m) and unit axis are in the parent and its own."""

    name: str
    kind: str
    parent: str
    child: str
    translation: Vector
    rotation: Quaternion
    axis: Vector
    mimic: Mimic | None

    @property
    def moves(self) -> bool:
        """Tell whether the child moves."""
        return self.kind in _ROTATING or self.kind in _SLIDING

    @property
    def is_fixed(self) -> bool:
        """Tell whether the child rests; a floating joint neither rests nor moves."""
        return self.kind in _RESTING

    def pose(self, position: float) -> tuple[Vector, Quaternion]:
        """Return the child's origin (m) and orientation in the parent at a position (rad or m)."""
        if self.kind in _ROTATING:
            x, y, z = self.axis
            s = sin(0.5 * position)
            turn = (s * x, s * y, s * z, cos(0.5 * position))
            return self.translation, signed(multiply(self.rotation, turn))
        if self.kind in _SLIDING:
            x, y, z = self.translation
            dx, dy, dz = rotate(self.rotation, self.axis)
            return ((x + position * dx, y + position * dy, z + position * dz),
                    signed(self.rotation))
        return self.translation, signed(self.rotation)


def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the Hamilton product p q, the rotation q followed by p."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (pw * qx + px * qw + py * qz - pz * qy,
            pw * qy + py * qw + pz * qx - px * qz,
            pw * qz + pz * qw + px * qy - py * qx,
            pw * qw - px * qx - py * qy - pz * qz)


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Turn a vector by a unit quaternion."""
    x, y, z, w = rotation
    return multiply(multiply(rotation, (*vector, 0.0)), (-x, -y, -z, w))[:3]


def signed(rotation: Quaternion) -> Quaternion:
    """
    Choose the sign of a unit quaternion as robot_state_publisher does, by way of a matrix.

    :return: The same rotation, with a positive w if that exceeds 1/2, or else with a positive
        largest component of x, y and z.
    """
    x, y, z, w = rotation
    sign = w if 4.0 * w * w - 1.0 > 1e-12 else max(z, y, x, key=abs)
    return rotation if sign >= 0.0 else (-x, -y, -z, -w)


def _from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by URDF's angles (rad), first about x, last about the fixed z."""
    about_x = (sin(0.5 * roll), 0.0, 0.0, cos(0.5 * roll))
    about_y = (0.0, sin(0.5 * pitch), 0.0, cos(0.5 * pitch))
    about_z = (0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw))
    return multiply(about_z, multiply(about_y, about_x))


def _number(text: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise DescriptionError(f'{where} has {text!r} where a number should be') from None


def _vector(element: ElementTree.Element | None, attribute: str, default: Vector, where: str
            ) -> Vector:
    text = None if element is None else element.get(attribute)
    if text is None:
        return default
    values = tuple(_number(word, f'{attribute} of {where}') for word in text.split())
    if len(values) != 3:
        raise DescriptionError(f'{attribute} of {where} is {text!r}, not three numbers')
    return values


def _link_of(joint: ElementTree.Element, role: str, links: list[str], where: str) -> str:
    element = joint.find(role)
    name = None if element is None else element.get('link')
    if name is None:
        raise DescriptionError(f'{where} has no {role} link')
    if name not in links:
        raise DescriptionError(f'the {role} link [{name}] of {where} does not exist')
    return name


def _mimic(element: ElementTree.Element | None, where: str) -> Mimic | None:
    if element is None:
        return None
    if not element.get('joint'):
        raise DescriptionError(f'the mimic of {where} names no joint')
    return Mimic(element.get('joint'),
                 _number(element.get('multiplier', '1'), f'the mimic of {where}'),
                 _number(element.get('offset', '0'), f'the mimic of {where}'))


def _joint(element: ElementTree.Element, links: list[str]) -> Joint:
    name = element.get('name')
    if not name:
        raise DescriptionError('a joint has no name')
    where = f'joint [{name}]'
    kind = element.get('type')
    if kind not in (*_ROTATING, *_SLIDING, *_RESTING, *_FREE):
        raise DescriptionError(f'{where} has the unknown type [{kind}]')
    if kind in ('prismatic', 'revolute') and element.find('limit') is None:
        raise DescriptionError(f'{where} is {kind}, but has no limit')
    axis = _vector(element.find('axis'), 'xyz', (1.0, 0.0, 0.0), where)
    length = sqrt(sum(value * value for value in axis))
    if not length > 0.0 and kind in (*_ROTATING, *_SLIDING):
        raise DescriptionError(f'the axis of {where} has no length')
    origin = element.find('origin')
    return Joint(
        name, kind,
        _link_of(element, 'parent', links, where), _link_of(element, 'child', links, where),
        _vector(origin, 'xyz', (0.0, 0.0, 0.0), where),
        _from_roll_pitch_yaw(*_vector(origin, 'rpy', (0.0, 0.0, 0.0), where)),
        tuple(value / (length or 1.0) for value in axis), _mimic(element.find('mimic'), where))


def parse(urdf: str) -> dict[str, Joint]:
    """
    Return the joints of a robot's description by name, in the order of their names.

    :raises DescriptionError: It is not XML or describes no tree of links.
    """
    try:
        # Bytes, because a text may not declare its encoding.
        robot = ElementTree.fromstring(urdf.encode())
    except ElementTree.ParseError as error:
        raise DescriptionError(f'robot_description is not XML: {error}') from None
    if robot.tag != 'robot':
        raise DescriptionError(f'robot_description begins with <{robot.tag}>, not with <robot>')
    links = [link.get('name', '') for link in robot.findall('link')]
    if not links:
        raise DescriptionError('robot_description has no link')
    for name in links:
        if links.count(name) > 1:
            raise DescriptionError(f'link [{name}] is there more than once')
    joints: dict[str, Joint] = {}
    above: dict[str, str] = {}
    for element in robot.findall('joint'):
        joint = _joint(element, links)
        if joint.name in joints:
            raise DescriptionError(f'joint [{joint.name}] is there more than once')
        if joint.child in above:
            raise DescriptionError(f'link [{joint.child}] is the child of more than one joint')
        joints[joint.name] = joint
        above[joint.child] = joint.parent
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        raise DescriptionError(f'links [{roots[0]}] and [{roots[1]}] are both roots')
    for name in links:
        way = [name]
        while way[-1] in above:
            way.append(above[way[-1]])
            if len(way) > len(links):
                raise DescriptionError(f'link [{name}] is part of a loop')
    return dict(sorted(joints.items()))
