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


class Joint(NamedTuple):
    """A joint between two links: its origin (m) and unit axis are in the parent and its own."""

    name: str
    kind: str
    parent: str
    child: str
    translation: Vector
    rotation: Quaternion
    axis: Vector
    mimic: tuple[str, float, float]
    """The joint that it follows, if any: position = the number * that one's + the other number."""

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


def _joint(element: ElementTree.Element, links: list[str]) -> Joint:
    """Read a joint; a ValueError says what is wrong with it."""
    def attribute(tag: str, name: str, default: str | None = None) -> str | None:
        found = element.find(tag)
        return default if found is None else found.get(name, default)

    def numbers(tag: str, name: str, default: str) -> Vector:
        x, y, z = map(float, attribute(tag, name, default).split())
        return x, y, z

    kind, ends = element.get('type'), [attribute(role, 'link') for role in ('parent', 'child')]
    for end in ends:
        if end not in links:
            raise ValueError(f'there is no link [{end}]')
    if kind not in (*_ROTATING, *_SLIDING, *_RESTING, *_FREE):
        raise ValueError(f'it has the unknown type [{kind}]')
    axis = numbers('axis', 'xyz', '1 0 0')
    length = sqrt(sum(value * value for value in axis))
    if not length:
        raise ValueError('its axis has no length')
    return Joint(
        element.get('name', ''), kind, *ends, numbers('origin', 'xyz', '0 0 0'),
        _from_roll_pitch_yaw(*numbers('origin', 'rpy', '0 0 0')),
        tuple(value / length for value in axis),
        (attribute('mimic', 'joint', ''), float(attribute('mimic', 'multiplier', '1')),
         float(attribute('mimic', 'offset', '0'))))


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
    joints: dict[str, Joint] = {}
    for element in robot.findall('joint'):
        name = element.get('name')
        try:
            joint = _joint(element, links)
        except ValueError as error:
            raise DescriptionError(f'joint [{name}]: {error}') from None
        joints[joint.name] = joint
    children = [joint.child for joint in joints.values()]
    for names in (links, children, [joint.get('name') for joint in robot.findall('joint')]):
        for name in names:
            if names.count(name) > 1:
                raise DescriptionError(f'[{name}] is there, or is a child, more than once')
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise DescriptionError(f'the links are no tree: the roots are {roots}')
    return dict(sorted(joints.items()))
