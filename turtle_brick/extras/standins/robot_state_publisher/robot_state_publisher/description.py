# SPDX-License-Identifier: Apache-2.0
"""
Read the joints of a robot from a URDF, following the rules of urdfdom 4.0.2.

An invalid joint, a duplicate name or a second root link is an error. Invalid shapes,
inertias and materials cause only a warning, because no transform depends on them.
"""

from collections.abc import Callable, Iterable
from math import cos, hypot, isinf, nan, sin
from pathlib import Path
import re
from typing import NamedTuple
from xml.etree.ElementTree import Element, fromstring, ParseError

from tf2_ros.buffer_core import compose, IDENTITY, Transform
import yaml

Warn = Callable[[str], None]

ROTATING = ('continuous', 'revolute')
MOVING = (*ROTATING, 'prismatic')
FIXED = ('fixed', 'planar')
"""Joint types. A planar joint is treated as fixed, as in the real robot_state_publisher."""

ATTRIBUTES: dict[str, dict[str, str]] = yaml.safe_load(
    Path(__file__).with_name('attributes.yaml').read_text(encoding='utf-8'))
"""Attribute types, such as `required text`, keyed by element tag and attribute name."""

JOINT_PARTS = ('origin', 'axis', 'limit', 'safety_controller', 'calibration', 'mimic', 'dynamics')
NUMBER = re.compile(r'\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?', re.ASCII)


class Joint(NamedTuple):
    """A URDF joint with its origin (m) in the parent frame and a unit axis in the joint frame."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Transform
    axis: tuple[float, float, float]
    mimicked: str  # Name of the joint to mimic, or ''.
    multiplier: float
    offset: float  # Position (rad or m) of this joint when the mimicked joint is at 0.

    def pose(self, position: float) -> Transform:
        """Return the pose of the child link in the parent frame at a joint position (rad or m)."""
        motion = IDENTITY
        if self.kind in ROTATING:
            motion = turn(self.axis, position)
        elif self.kind == 'prismatic':
            x, y, z = (position * component for component in self.axis)
            motion = (x, y, z, 0.0, 0.0, 0.0, 1.0)
        return compose(self.origin, motion)


def turn(axis: Iterable[float], angle: float) -> Transform:
    """Return a rotation by an angle (rad) about a unit axis through the origin."""
    x, y, z = (sin(0.5 * angle) * component for component in axis)
    return (0.0, 0.0, 0.0, x, y, z, cos(0.5 * angle))


def numbers(element: Element, name: str, count: int, default: str = '') -> tuple[float, ...]:
    """Return the numbers in an attribute, or raise a ValueError if the attribute is invalid."""
    text = element.get(name, default)
    parts = [part for part in text.split(' ') if part] if count > 1 else [text]
    for part in parts:
        if not NUMBER.fullmatch(part) or isinf(float(part)):
            raise ValueError(f'<{element.tag}> {name}: {part!r} is not a number')
    if len(parts) != count:
        raise ValueError(f'<{element.tag}> {name}: {text!r} has {len(parts)} instead of {count} '
                         'numbers')
    return tuple(map(float, parts))


def check(element: Element) -> None:
    """Raise a ValueError if an attribute of an element is missing or invalid."""
    for name, kind in ATTRIBUTES[element.tag].items():
        if name not in element.attrib:
            if 'required' in kind:
                raise ValueError(f'<{element.tag}> has no {name}')
        elif 'text' not in kind:
            numbers(element, name, 3 if 'vector' in kind else 1)


def read_joint(element: Element) -> Joint:
    """Return the joint defined by an element, or raise a ValueError if the element is invalid."""
    check(element)
    kind = element.get('type')
    if kind not in (*MOVING, *FIXED, 'floating'):
        raise ValueError(f'the type {kind!r} is unknown')
    # If several child elements have the same tag, only the first is used.
    parts = {part.tag: part for part in reversed(element)}
    if kind in ('fixed', 'floating'):
        parts.pop('axis', None)
    for tag in JOINT_PARTS:
        if tag in parts:
            check(parts[tag])
    if kind in ('revolute', 'prismatic') and 'limit' not in parts:
        raise ValueError(f'the type {kind!r} requires a <limit>')
    if 'dynamics' in parts and not {'damping', 'friction'}.intersection(parts['dynamics'].keys()):
        raise ValueError('<dynamics> has neither damping nor friction')
    origin, parent, child, mimic = (
        parts.get(tag, Element(tag)) for tag in ('origin', 'parent', 'child', 'mimic'))
    axis = numbers(parts['axis'], 'xyz', 3, '0 0 0') if 'axis' in parts else (1.0, 0.0, 0.0)
    x, y, z = numbers(origin, 'xyz', 3, '0 0 0')
    if kind in MOVING and not any(axis):  # For a zero axis, the real node divides by zero.
        axis = (nan, nan, nan)
        x = y = z = nan
    axis_x, axis_y, axis_z = (component / (hypot(*axis) or 1.0) for component in axis)
    roll, pitch, yaw = numbers(origin, 'rpy', 3, '0 0 0')
    pose: Transform = (x, y, z, 0.0, 0.0, 0.0, 1.0)
    for rotation in (turn((0, 0, 1), yaw), turn((0, 1, 0), pitch), turn((1, 0, 0), roll)):
        pose = compose(pose, rotation)
    return Joint(
        element.get('name', ''), kind, parent.get('link', ''), child.get('link', ''), pose,
        (axis_x, axis_y, axis_z), mimic.get('joint', ''),
        *numbers(mimic, 'multiplier', 1, '1'), *numbers(mimic, 'offset', 1, '0'))


def check_link(link: Element) -> None:
    """Raise a ValueError for the first invalid part of a link."""
    for element in link.iter():
        if element.tag in ATTRIBUTES:
            check(element)
        if element.tag in ('visual', 'collision') and element.find('geometry/*') is None:
            raise ValueError(f'<{element.tag}> has no <geometry>')


def is_defined(material: Element) -> bool:
    """Return whether a material has a texture, or a color whose components are between 0 and 1."""
    color = material.find('color[@rgba]')
    if color is not None and all(NUMBER.fullmatch(part) and 0.0 <= float(part) <= 1.0
                                 for part in color.get('rgba', '').split(' ') if part):
        return True
    return material.find('texture[@filename]') is not None


def by_name(elements: Iterable[Element]) -> dict[str, Element]:
    """Return a dictionary of elements keyed by name, or raise ValueError for a duplicate."""
    named: dict[str, Element] = {}
    for element in elements:
        name = element.get('name', '')
        if name in named:
            raise ValueError(f'{element.tag} [{name}] is defined more than once')
        named[name] = element
    return named


def find_tree(links: Iterable[str], joints: Iterable[Joint]) -> tuple[str, list[Joint]]:
    """Return the root link and joints of the link tree, or raise ValueError if it is invalid."""
    for joint in joints:
        for end in (joint.parent, joint.child):
            if end not in links or not end:
                raise ValueError(f'joint [{joint.name}]: link [{end}] does not exist')
    # If several joints have the same child link, only the last joint is in the tree.
    parents = {joint.child: joint for joint in joints}
    roots = [name for name in sorted(links) if name not in parents]
    if len(roots) != 1:
        raise ValueError(f'the links do not form a tree: the roots are {roots}')
    tree = []

    def visit(path: tuple[str, ...], is_connected: bool) -> None:
        for joint in joints:
            if joint.parent == path[-1]:
                if joint.child in path:
                    raise ValueError(f'the links {[*path, joint.child]} form a loop')
                is_part = is_connected and parents[joint.child] is joint
                tree.extend([joint] if is_part else [])
                visit((*path, joint.child), is_part)

    visit((roots[0],), True)
    return roots[0], tree


def read_robot(urdf: str) -> Element:
    """Return the <robot> element of a URDF, or raise a ValueError if there is none."""
    try:
        robot = fromstring(urdf.strip().removeprefix('\ufeff'))
    except ParseError as error:
        raise ValueError(f'robot_description is not valid XML: {error}') from None
    if robot.tag != 'robot' or 'name' not in robot.attrib:
        raise ValueError(f'robot_description contains <{robot.tag}> with the attributes '
                         f'{list(robot.attrib)}, but must contain a <robot> with a name')
    if robot.get('version', '1.0') != '1.0':
        raise ValueError(f'The version of <robot> is {robot.get("version")}, but must be 1.0')
    return robot


def parse(urdf: str, warn: Warn) -> dict[str, Joint]:
    """
    Return the joints in a URDF, sorted by name.

    :param warn: function called with a message for each ignored part of the URDF
    :raises ValueError: if the real robot_state_publisher rejects the URDF
    """
    robot = read_robot(urdf)
    materials, links, elements = (
        by_name(robot.findall(tag)) for tag in ('material', 'link', 'joint'))
    used = [*materials.values(), *robot.iterfind('link/visual/material')]
    defined = {material.get('name') for material in used if is_defined(material)}
    for name in dict.fromkeys(material.get('name') for material in used):
        if name is None or name not in defined:
            warn(f'material [{name}] has no name, or no valid color or texture')
    for name, link in links.items():
        try:
            check_link(link)
        except ValueError as error:
            warn(f'link [{name}]: {error}. The rest of the link is ignored.')
    joints = {}
    for name, element in sorted(elements.items()):
        try:
            joints[name] = read_joint(element)
        except ValueError as error:
            raise ValueError(f'joint [{name}]: {error}') from None
    root, tree = find_tree(links, joints.values())
    if links[root].find('inertial') is not None:
        warn(f'the inertia of the root link [{root}] is ignored. Attach it to another link.')
    for joint in tree:
        if joint.kind in ('planar', 'floating'):
            warn(f'joint [{joint.name}] does not move: the type {joint.kind!r} is unsupported')
    # Joints outside the tree are marked as floating so that their transforms are not published.
    return {name: joint if joint in tree else joint._replace(kind='floating')
            for name, joint in joints.items()}
