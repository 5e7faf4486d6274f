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
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from math import hypot
from typing import NamedTuple
from xml.etree import ElementTree

import numpy
from turtle_referee.geometry import Array, Pose, pose, turn, UPRIGHT
from turtle_referee.record import Record
from turtle_referee.rules import Broken, needed

MOVABLE = ('revolute', 'continuous', 'prismatic')

VERTICAL, HORIZONTAL = 0.999, 0.05
"""The part of an axis along z from which it is vertical, and up to which it is horizontal."""

SIZES = {'box': ('size',), 'cylinder': ('radius', 'length'), 'sphere': ('radius',)}
"""The attributes that tell how large a solid is."""

Color = tuple[float, ...]

GRAY: Color = (0.7, 0.7, 0.7, 1.0)
"""The color of a visual that has none."""


class Solid(NamedTuple):
    """A visual of a link."""

    kind: str
    """'box', 'cylinder' (its axis is z), 'sphere', or what it is else."""
    size: tuple[float, ...]
    """Extents (m) of a box, radius and length of a cylinder."""
    color: Color
    pose: Pose


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint of a URDF."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Array
    """Unit vector in the joint's own frame."""

    @property
    def movable(self) -> bool:
        """Whether it has a position."""
        return self.kind in MOVABLE


class RobotModel:
    """Links and joints."""

    def __init__(self, description: str, platform: str) -> None:
        """
        Read a URDF.

        :param description: the URDF
        :param platform: what its platform is called
        :raises Broken: it can't be understood; the text says why
        """
        self.platform = platform
        try:
            robot = ElementTree.fromstring(description)
            colors = {material.get('name'): _color(material, {})
                      for material in robot.findall('material')}
            self.links = {link.get('name', ''): [_solid(visual, colors)
                                                 for visual in link.findall('visual')]
                          for link in robot.findall('link')}
            self.joints = [_joint(element) for element in robot.findall('joint')]
        except (ElementTree.ParseError, ValueError) as error:
            raise Broken(f'the robot_description can not be read: {error}') from None
        self._above = {joint.child: joint for joint in self.joints}

    @property
    def roots(self) -> list[str]:
        """Return the links that are no joint's child: one, in a robot that can be."""
        return [link for link in self.links if link not in self._above]

    def way(self, link: str) -> list[Joint]:
        """Return the joints from the root to a link."""
        found: list[Joint] = []
        while link in self._above and len(found) <= len(self.joints):
            found.insert(0, self._above[link])
            link = found[0].parent
        return found

    def pose(self, link: str, positions: Mapping[str, float] = {}) -> Pose:
        """
        Return the pose of a link in the root.

        :param link: its name
        :param positions: of the joints (rad or m); 0 for those that are not given
        """
        found = pose((0.0, 0.0, 0.0))
        for joint in self.way(link):
            position = positions.get(joint.name, 0.0)
            found = found.compose(joint.origin)
            if joint.kind == 'prismatic':
                found = found.compose(Pose(position * joint.axis, UPRIGHT))
            elif joint.movable:
                found = found.compose(Pose(numpy.zeros(3), turn(joint.axis, position)))
        return found

    def axis(self, joint: Joint, positions: Mapping[str, float] = {}) -> Array:
        """Return the axis of a joint in the root, for given positions (rad)."""
        return self.pose(joint.child, positions).axes @ joint.axis

    def solid(self, link: str, kind: str) -> Solid:
        """Return the first visual of a link of a kind ('box', 'cylinder'); Broken without one."""
        return needed(next((solid for solid in self.links.get(link, ()) if solid.kind == kind),
                           None), f'{link} has no {kind}')

    # --------------------------------------------------------------- the joints, by what they do

    @property
    def platform_joint(self) -> Joint:
        """Return the joint that tilts the platform: the last movable one above it; or Broken."""
        return needed(next((joint for joint in reversed(self.way(self.platform))
                            if joint.movable), None), 'no joint turns the platform')

    @property
    def stem_joint(self) -> Joint:
        """Return the joint that turns about the vertical and carries a movable one; or Broken."""
        others = self.way(self.platform)
        return needed(next((
            joint for joint in self.joints
            if joint.movable and joint not in others and abs(self.axis(joint)[2]) > VERTICAL
            and any(one.movable and self.hangs_below(one, joint) for one in self.joints)), None),
            'no link that turns about the vertical carries a wheel')

    @property
    def wheel_joint(self) -> Joint:
        """Return the movable joint below the stem's, whose axis is horizontal; or Broken."""
        stem = self.stem_joint
        return needed(next((
            joint for joint in self.joints if joint.movable and self.hangs_below(joint, stem)
            and abs(self.axis(joint)[2]) < HORIZONTAL), None),
            'nothing on the stem turns about a horizontal axis')

    def hangs_below(self, joint: Joint, other: Joint) -> bool:
        """Tell whether another joint is on the way to a joint."""
        return other.name in [one.name for one in self.way(joint.parent)]

    def platform_span(self) -> tuple[float, float]:
        """Return bottom and top of the level platform (m above where the wheel touches down)."""
        platform, wheel = self.solid(self.platform, 'cylinder'), self.wheel_joint.child
        rim = self.solid(wheel, 'cylinder')
        ground = self.pose(wheel).transform(rim.pose.position)[2] - rim.size[0]
        middle = self.pose(self.platform).transform(platform.pose.position)[2] - ground
        return middle - platform.size[1] / 2.0, middle + platform.size[1] / 2.0

    def numbers(self) -> dict[str, float]:
        """Return the numbers of the profile that follow from the model."""
        found = {}
        for name, tell in (
                ('platform_radius', lambda: self.solid(self.platform, 'cylinder').size[0]),
                ('platform_height', lambda: self.platform_span()[1]),
                ('wheel_radius', lambda: self.solid(self.wheel_joint.child, 'cylinder').size[0])):
            with suppress(Broken):
                found[name] = tell()
        return found


def model(record: Record) -> RobotModel:
    """Return the robot's description that was heard last; Broken if there is none to be read."""
    heard = needed(record.topics['robot_description'] or None, 'there is no robot_description')
    return _read(heard[-1].message.data, record.profile.frames['platform'])


@lru_cache(4)
def _read(description: str, platform: str) -> RobotModel:
    """Return the model of a URDF, read once: many rules ask for it."""
    return RobotModel(description, platform)


def _numbers(element: ElementTree.Element | None, attribute: str, default: str = '') -> Array:
    """Return the numbers of an attribute, the default ones where it is not given."""
    return numpy.array((default if element is None else element.get(attribute, default)).split(),
                       float)


def _origin(element: ElementTree.Element) -> Pose:
    """Return where a joint or a visual is in its parent; the angles are about fixed axes."""
    origin = element.find('origin')
    x, y, z = _numbers(origin, 'xyz', '0 0 0')
    roll, pitch, yaw = _numbers(origin, 'rpy', '0 0 0')
    return Pose(numpy.array((x, y, z)), turn(UPRIGHT[2], yaw) @ turn(UPRIGHT[1], pitch) @ turn(
        UPRIGHT[0], roll))


def _color(material: ElementTree.Element | None, named: Mapping[str | None, Color]) -> Color:
    """Return the color of a material: its own, or that of the robot's material of this name."""
    if material is None:
        return GRAY
    color = material.find('color')
    return named.get(material.get('name'), GRAY) if color is None else tuple(
        _numbers(color, 'rgba'))


def _solid(visual: ElementTree.Element, colors: Mapping[str | None, Color]) -> Solid:
    """Read a visual."""
    element = visual.find('geometry/*')
    kind = '' if element is None else element.tag
    size = [number for name in SIZES.get(kind, ()) for number in _numbers(element, name)]
    if len(size) != {'box': 3, 'cylinder': 2}.get(kind, len(size)):
        raise ValueError(f'a {kind} has {len(size)} numbers for its size')
    return Solid(kind, tuple(size), _color(visual.find('material'), colors), _origin(visual))


def _joint(element: ElementTree.Element) -> Joint:
    """Read a joint."""
    name = element.get('name', '')
    parent, child = (element.find(role) for role in ('parent', 'child'))
    if parent is None or child is None:
        raise ValueError(f'the joint {name} does not connect two links')
    axis = _numbers(element.find('axis'), 'xyz', '1 0 0')
    return Joint(name, element.get('type', ''), parent.get('link', ''), child.get('link', ''),
                 _origin(element), axis / (hypot(*axis) or 1.0))
