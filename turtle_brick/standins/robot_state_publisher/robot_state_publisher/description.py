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
"""Read the joints of a robot from a URDF, without importing ROS."""

from math import cos, sin, sqrt
from typing import NamedTuple
from xml.etree import ElementTree

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

ROTATING = ('continuous', 'revolute')
MOVING = (*ROTATING, 'prismatic')
FIXED = ('fixed', 'planar')
"""Joint types. A planar joint does not move, as in the real robot_state_publisher."""


class Joint(NamedTuple):
    """A joint with its origin (m) in the parent frame and its unit axis in the joint frame."""

    name: str
    kind: str
    parent: str
    child: str
    translation: Vector
    rotation: Quaternion
    axis: Vector
    mimic: tuple[str, float, float]  # Joint to mimic (empty if none), multiplier and offset.

    def pose(self, position: float) -> tuple[Vector, Quaternion]:
        """Return the child link's origin (m) and rotation for a joint position (rad or m)."""
        if self.kind in ROTATING:
            x, y, z = self.axis
            s = sin(0.5 * position)
            turn = (s * x, s * y, s * z, cos(0.5 * position))
            return self.translation, signed(multiply(self.rotation, turn))
        if self.kind == 'prismatic':
            x, y, z = self.translation
            dx, dy, dz = rotate(self.rotation, self.axis)
            return ((x + position * dx, y + position * dy, z + position * dz),
                    signed(self.rotation))
        return self.translation, signed(self.rotation)


def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the Hamilton product p q, which applies the rotation q before the rotation p."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (pw * qx + px * qw + py * qz - pz * qy,
            pw * qy + py * qw + pz * qx - px * qz,
            pw * qz + pz * qw + px * qy - py * qx,
            pw * qw - px * qx - py * qy - pz * qz)


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Rotate a vector by a unit quaternion."""
    x, y, z, w = rotation
    return multiply(multiply(rotation, (*vector, 0.0)), (-x, -y, -z, w))[:3]


def signed(rotation: Quaternion) -> Quaternion:
    """
    Return a unit quaternion with the same sign as in the real robot_state_publisher.

    w is positive if |w| > 1/2. Otherwise, the component with the largest magnitude is positive.
    """
    x, y, z, w = rotation
    sign = w if 4.0 * w * w - 1.0 > 1e-12 else max(z, y, x, key=abs)
    return rotation if sign >= 0.0 else (-x, -y, -z, -w)


def _from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by URDF angles (rad) about the fixed axes x, y and z, in this order."""
    about_x = (sin(0.5 * roll), 0.0, 0.0, cos(0.5 * roll))
    about_y = (0.0, sin(0.5 * pitch), 0.0, cos(0.5 * pitch))
    about_z = (0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw))
    return multiply(about_z, multiply(about_y, about_x))


def _joint(element: ElementTree.Element, links: list[str]) -> Joint:
    """Read a joint, or raise a ValueError that describes an invalid attribute."""
    def attribute(tag: str, name: str, default: str | None = None) -> str | None:
        found = element.find(tag)
        return default if found is None else found.get(name, default)

    def numbers(tag: str, name: str, default: str) -> Vector:
        x, y, z = map(float, attribute(tag, name, default).split())
        return x, y, z

    kind, ends = element.get('type'), [attribute(role, 'link') for role in ('parent', 'child')]
    for end in ends:
        if end not in links:
            raise ValueError(f'link [{end}] does not exist')
    if kind not in (*MOVING, *FIXED, 'floating'):
        raise ValueError(f'type [{kind}] is unknown')
    axis = numbers('axis', 'xyz', '1 0 0')
    length = sqrt(sum(value * value for value in axis))
    if not length:
        raise ValueError('the axis is a zero vector')
    return Joint(
        element.get('name', ''), kind, *ends, numbers('origin', 'xyz', '0 0 0'),
        _from_roll_pitch_yaw(*numbers('origin', 'rpy', '0 0 0')),
        tuple(value / length for value in axis),
        (attribute('mimic', 'joint', ''), float(attribute('mimic', 'multiplier', '1')),
         float(attribute('mimic', 'offset', '0'))))


def parse(urdf: str) -> dict[str, Joint]:
    """Return the joints in a URDF, sorted by name, or raise ValueError for an invalid URDF."""
    try:
        # Encode the URDF because ElementTree rejects a str with an encoding declaration.
        robot = ElementTree.fromstring(urdf.encode())
    except ElementTree.ParseError as error:
        raise ValueError(f'robot_description is not valid XML: {error}') from None
    if robot.tag != 'robot':
        raise ValueError(f'robot_description begins with <{robot.tag}>, not with <robot>')
    links = [link.get('name', '') for link in robot.findall('link')]
    joints: dict[str, Joint] = {}
    for element in robot.findall('joint'):
        name = element.get('name')
        try:
            joint = _joint(element, links)
        except ValueError as error:
            raise ValueError(f'joint [{name}]: {error}') from None
        joints[joint.name] = joint
    children = [joint.child for joint in joints.values()]
    for names in (links, children, [joint.get('name') for joint in robot.findall('joint')]):
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f'[{name}] is defined more than once or has several parents')
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise ValueError(f'the links do not form a tree: the roots are {roots}')
    return dict(sorted(joints.items()))
