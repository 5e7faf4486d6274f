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
"""The robot as its URDF describes it: where each link is for given joint positions. No ROS."""

from collections.abc import Mapping
from functools import lru_cache
from math import hypot
from typing import NamedTuple
from xml.etree import ElementTree

import numpy
from turtle_referee.graph_client.geometry import Array, Pose, pose, turn, UPRIGHT
from turtle_referee.graph_client.record import Record
from turtle_referee.rules.rule import Broken, require

SIZES = {'box': ('size',), 'cylinder': ('radius', 'length'), 'sphere': ('radius',)}


class Solid(NamedTuple):
    """A visual of a link."""

    kind: str  # 'box', 'cylinder' (its axis is z), 'sphere', or what it is else
    size: tuple[float, ...]  # extents (m) of a box, radius and length of a cylinder
    color: str  # as the URDF has it
    pose: Pose


class Joint(NamedTuple):
    """A joint of a URDF."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Array  # a unit vector in the joint's own frame

    @property
    def movable(self) -> bool:
        """Whether it has a position."""
        return self.kind in ('revolute', 'continuous')


class RobotModel:
    """Links and joints."""

    def __init__(self, description: str) -> None:
        """Read a URDF; Broken, with why, if it makes no sense."""
        try:
            robot = ElementTree.fromstring(description)
            self.links = {link.get('name', ''): [_solid(visual, robot)
                                                 for visual in link.findall('visual')]
                          for link in robot.findall('link')}
            self.joints = [_joint(element) for element in robot.findall('joint')]
        except (ElementTree.ParseError, ValueError) as error:
            raise Broken(f'the robot_description can not be read: {error}') from None
        self._above = {joint.child: joint for joint in self.joints}

    def way(self, link: str) -> list[Joint]:
        """Return the joints from the root to a link."""
        found: list[Joint] = []
        while link in self._above and len(found) <= len(self.joints):
            found.insert(0, self._above[link])
            link = found[0].parent
        return found

    def pose(self, link: str, positions: Mapping[str, float] = {}) -> Pose:
        """Return the pose of a link in the root; the positions (rad) not given are 0."""
        found = pose((0.0, 0.0, 0.0))
        for joint in self.way(link):
            angle = positions.get(joint.name, 0.0)
            found = found.compose(joint.origin).compose(
                Pose(numpy.zeros(3), turn(joint.axis, angle)))
        return found

    def axis(self, joint: Joint, positions: Mapping[str, float] = {}) -> Array:
        """Return the axis of a joint in the root, for given positions (rad)."""
        return self.pose(joint.child, positions).axes @ joint.axis

    def solid(self, link: str, kind: str) -> Solid:
        """Return the first visual of a link of a kind ('box', 'cylinder'); Broken without one."""
        return require(next((solid for solid in self.links.get(link, ()) if solid.kind == kind),
                           None), f'{link} has no {kind}')

    def middle(self, link: str, solid: Solid) -> Array:
        """Return where in the root the middle of a solid of a link is (m)."""
        return self.pose(link).transform(solid.pose.position)

    def joint(self, link: str) -> Joint:
        """Return the joint that turns a link: the last movable one above it; Broken without."""
        return require(next((joint for joint in reversed(self.way(link)) if joint.movable), None),
                      f'no joint turns {link}')

    def platform_span(self) -> tuple[float, float]:
        """Return bottom and top of the level platform (m above where the wheel touches down)."""
        wheel, platform = self.solid('wheel', 'cylinder'), self.solid('platform', 'cylinder')
        height = (self.middle('platform', platform)[2] - self.middle('wheel', wheel)[2]
                  + wheel.size[0])
        return height - platform.size[1] / 2.0, height + platform.size[1] / 2.0


def model(record: Record) -> RobotModel:
    """Return the robot's description that was heard last; Broken if there is none to be read."""
    heard = require(record.topics['robot_description'] or None, 'there is no robot_description')
    return _read(heard[-1].message.data)


_read = lru_cache(4)(RobotModel)  # many rules ask for it


def _numbers(element: ElementTree.Element | None, attribute: str, default: str = '') -> Array:
    """Return the numbers of an attribute, the default ones where it is not given."""
    return numpy.array((default if element is None else element.get(attribute, default)).split(),
                       float)


def _origin(element: ElementTree.Element) -> Pose:
    """Return where a joint or a visual is in its parent; the angles are about fixed axes."""
    origin = element.find('origin')
    roll, pitch, yaw = _numbers(origin, 'rpy', '0 0 0')
    return Pose(_numbers(origin, 'xyz', '0 0 0'), turn(UPRIGHT[2], yaw) @ turn(
        UPRIGHT[1], pitch) @ turn(UPRIGHT[0], roll))


def _solid(visual: ElementTree.Element, robot: ElementTree.Element) -> Solid:
    """Read a visual, whose material may have its color or that of the robot's of this name."""
    element, material = visual.find('geometry/*'), visual.find('material')
    kind = '' if element is None else element.tag
    size = tuple(number for name in SIZES.get(kind, ()) for number in _numbers(element, name))
    name = None if material is None else material.get('name')
    colors = [*visual.iterfind('material/color'), *(
        color for one in robot.findall('material') if one.get('name') == name for color in one)]
    return Solid(kind, size, colors[0].get('rgba', '') if colors else '', _origin(visual))


def _joint(element: ElementTree.Element) -> Joint:
    """Read a joint."""
    parent, child = (element.find(role) for role in ('parent', 'child'))
    if parent is None or child is None:
        raise ValueError(f'the joint {element.get("name")} does not connect two links')
    axis = _numbers(element.find('axis'), 'xyz', '1 0 0')
    return Joint(element.get('name', ''), element.get('type', ''), parent.get('link', ''),
                 child.get('link', ''), _origin(element), axis / (hypot(*axis) or 1.0))
