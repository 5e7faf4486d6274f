# SPDX-License-Identifier: Apache-2.0
"""Read the URDF of a robot and compute the poses of its links."""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from math import hypot
from typing import NamedTuple
from xml.etree import ElementTree

import numpy
from turtle_graph.client.geometry import Array, from_rpy, ORIGIN, Pose, turn
from turtle_graph.client.record import Record
from turtle_graph.referee.rules.rule import Failed, require, require_clear

SIZES = {'box': ('size',), 'cylinder': ('radius', 'length'), 'sphere': ('radius',)}
"""URDF attributes that define the size of each kind of geometry."""


class Solid(NamedTuple):
    """A visual element of a link."""

    kind: str  # 'box', 'cylinder' (along z), 'sphere', or another geometry tag.
    size: tuple[float, ...]  # Values (m) of the attributes in SIZES.
    color: tuple[float, ...]  # Values of the `rgba` attribute.
    pose: Pose  # In the frame of the link, or in the root frame if solids() returned it.


class Joint(NamedTuple):
    """A joint in a URDF."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Array  # Unit vector of the joint axis in the joint frame.

    @property
    def movable(self) -> bool:
        """Return whether the joint can rotate."""
        return self.kind in ('revolute', 'continuous')


class RobotModel:
    """The links and joints in a URDF."""

    def __init__(self, description: str, names: Iterable[tuple[str, str]] = ()) -> None:
        """Parse a URDF and give its links standard names, or raise Failed if it is invalid."""
        standard_names = {name: standard for standard, name in names}
        try:
            robot = ElementTree.fromstring(description)
            for tag, key in (('link', 'name'), ('parent', 'link'), ('child', 'link')):
                for element in robot.iter(tag):
                    name = element.get(key, '')
                    element.set(key, standard_names.get(name, name))
            self.links = {
                link.get('name', ''): [_solid(visual, robot) for visual in link.findall('visual')]
                for link in robot.findall('link')}
            self.joints = [_joint(element) for element in robot.findall('joint')]
        except (ElementTree.ParseError, ValueError) as error:
            raise Failed(f'the robot_description is invalid: {error}') from None
        self._joint_above = {joint.child: joint for joint in self.joints}

    def joints_to(self, link: str) -> list[Joint]:
        """Return the joints on the path from the root link to a given link."""
        chain: list[Joint] = []
        while link in self._joint_above and len(chain) <= len(self.joints):
            chain.insert(0, self._joint_above[link])
            link = chain[0].parent
        return chain

    def pose(self, link: str, positions: Mapping[str, float] = {}) -> Pose:
        """Return a link's pose in the root frame for given joint positions (rad, default 0)."""
        result = ORIGIN
        for joint in self.joints_to(link):
            rotation = turn(joint.axis, positions.get(joint.name, 0.0))
            result = result.compose(joint.origin).compose(Pose(ORIGIN.position, rotation))
        return result

    def axis(self, joint: Joint, positions: Mapping[str, float] = {}) -> Array:
        """Return a joint's axis in the root frame for given joint positions (rad, default 0)."""
        return self.pose(joint.child, positions).axes @ joint.axis

    def body(self, link: str) -> list[str]:
        """Return the names of a link and of all links that fixed joints attach below it."""
        names = [link]
        for name in names:  # The loop also visits the names that it appends.
            names += [joint.child for joint in self.joints if joint.parent == name
                      and joint.kind == 'fixed' and joint.child not in names]
        return names

    def solids(self, link: str) -> list[Solid]:
        """Return the visual elements of a link and of the links fixed to it, in the root frame."""
        return [solid._replace(pose=self.pose(name).compose(solid.pose))
                for name in self.body(link) for solid in self.links.get(name, ())]

    def solid(self, link: str, *kinds: str) -> Solid:
        """Return the first of solids() that has a given kind, or raise Failed if none has."""
        for solid in self.solids(link):
            if solid.kind in kinds:
                return solid
        raise Failed(f'{link} has no {" or ".join(kinds)}')

    def wheel(self) -> Solid:
        """Return the wheel, whose first size is its radius, or raise Failed if there is none."""
        return self.solid('wheel', 'cylinder', 'sphere')

    def platform_heights(self) -> tuple[float, float]:
        """Return the heights (m) of the platform's base and top above the bottom of the wheel."""
        wheel, platform = self.wheel(), self.solid('platform', 'cylinder')
        middle = float(platform.pose.position[2] - wheel.pose.position[2]) + wheel.size[0]
        return middle - platform.size[1] / 2.0, middle + platform.size[1] / 2.0

    def joint(self, link: str) -> Joint:
        """Return the closest movable joint above a link, or raise Failed if there is none."""
        for joint in reversed(self.joints_to(link)):
            if joint.movable:
                return joint
        raise Failed(f'no joint turns {link}')


def model(record: Record) -> RobotModel:
    """Return the robot model in the latest robot_description, or raise Failed if invalid."""
    require_clear(record, 'robot_description', 'base_link', 'platform', 'stem', 'wheel')
    descriptions = require(record.topics['robot_description'] or None,
                           'there is no robot_description')
    return _parse(descriptions[-1].message.data, tuple(record.profile.frames.items()))


_parse = lru_cache(4)(RobotModel)  # Many rules use the same robot_description.


def _numbers(element: ElementTree.Element | None, attribute: str, default: str = '') -> Array:
    text = default if element is None else element.get(attribute, default)
    return numpy.array(text.split(), float)


def _origin(element: ElementTree.Element) -> Pose:
    """Return the origin of a joint or visual element. The rpy angles refer to fixed axes."""
    origin = element.find('origin')
    x, y, z = _numbers(origin, 'xyz', '0 0 0')
    return Pose((x, y, z), from_rpy(*_numbers(origin, 'rpy', '0 0 0')))


def _solid(visual: ElementTree.Element, robot: ElementTree.Element) -> Solid:
    element, material = visual.find('geometry/*'), visual.find('material')
    kind = '' if element is None else element.tag
    size = tuple(number for name in SIZES.get(kind, ()) for number in _numbers(element, name))
    name = None if material is None else material.get('name')
    colors = [*visual.iterfind('material/color'), *(
        color for one in robot.findall('material') if one.get('name') == name for color in one)]
    color = tuple(map(float, colors[0].get('rgba', '').split())) if colors else ()
    return Solid(kind, size, color, _origin(visual))


def _joint(element: ElementTree.Element) -> Joint:
    parent, child = (element.find(role) for role in ('parent', 'child'))
    if parent is None or child is None:
        raise ValueError(f'the joint {element.get("name")} does not connect two links')
    axis = _numbers(element.find('axis'), 'xyz', '1 0 0')
    return Joint(element.get('name', ''), element.get('type', ''), parent.get('link', ''),
                 child.get('link', ''), _origin(element), axis / (hypot(*axis) or 1.0))
