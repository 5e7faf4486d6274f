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
from math import cos, hypot, sin
from typing import NamedTuple
from xml.etree import ElementTree

from turtle_brick.core.geometry import IDENTITY, Pose, rotate, Vector
from turtle_brick.view.urdf_scene import from_rpy, parse_urdf, Shape, UrdfError
from turtle_referee.record import Record

MOVABLE = ('revolute', 'continuous', 'prismatic')


class Joint(NamedTuple):
    """A joint of a URDF."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Vector
    """Unit vector in the joint's own frame."""

    @property
    def movable(self) -> bool:
        """Whether it has a position."""
        return self.kind in MOVABLE


class RobotModel:
    """Links and joints."""

    def __init__(self, description: str) -> None:
        """
        Read a URDF.

        :param description: the URDF
        :raises UrdfError: it can't be understood; the text says why
        """
        self.robot = parse_urdf(description)
        self.joints = [_joint(element)
                       for element in ElementTree.fromstring(description).findall('joint')]
        self._above = {joint.child: joint for joint in self.joints}

    @classmethod
    def of(cls, record: Record) -> 'RobotModel | None':
        """Return the model that was heard last, None where there is none that can be read."""
        heard = record.topics['robot_description']
        try:
            return cls(heard[-1].message.data) if heard else None
        except UrdfError:
            return None

    def way(self, link: str) -> list[Joint]:
        """Return the joints from the root to a link."""
        found: list[Joint] = []
        while link in self._above and len(found) <= len(self.joints):
            found.insert(0, self._above[link])
            link = found[0].parent
        return found

    def pose(self, link: str, positions: Mapping[str, float] | None = None) -> Pose:
        """
        Return the pose of a link in the root.

        :param link: its name
        :param positions: of the joints (rad or m); 0 for those that are not given
        """
        pose = Pose((0.0, 0.0, 0.0), IDENTITY)
        for joint in self.way(link):
            position = (positions or {}).get(joint.name, 0.0)
            pose = pose.compose(joint.origin)
            if joint.kind == 'prismatic':
                x, y, z = (position * part for part in joint.axis)
                pose = pose.compose(Pose((x, y, z), IDENTITY))
            elif joint.movable:
                pose = pose.compose(Pose((0.0, 0.0, 0.0), _about(joint.axis, position)))
        return pose

    def axis(self, joint: Joint, positions: Mapping[str, float] | None = None) -> Vector:
        """Return the axis of a joint in the root, for given positions (rad)."""
        return rotate(self.pose(joint.child, positions).orientation, joint.axis)

    def solid(self, link: str, kind: str) -> Shape | None:
        """Return the first visual of a link of a kind ('box', 'cylinder'), None without one."""
        return next((shape for shape in self.robot.links.get(link, ()) if shape.kind == kind),
                    None)

    # --------------------------------------------------------------- the joints, by what they do

    def platform_joint(self, platform: str) -> Joint | None:
        """Return the joint that tilts the platform: the last movable one above it."""
        return next((joint for joint in reversed(self.way(platform)) if joint.movable), None)

    def stem_joint(self, platform: str) -> Joint | None:
        """Return the joint that turns about the vertical and carries another movable one."""
        others = self.way(platform)
        for joint in self.joints:
            if joint.movable and joint not in others and abs(self.axis(joint)[2]) > 0.999:
                if any(one.movable and joint in self.way(one.child) and one is not joint
                       for one in self.joints):
                    return joint
        return None

    def wheel_joint(self, platform: str) -> Joint | None:
        """Return the movable joint below the stem's, whose axis is horizontal."""
        stem = self.stem_joint(platform)
        return next((joint for joint in self.joints if stem is not None and joint.movable
                     and joint is not stem and stem in self.way(joint.child)
                     and abs(self.axis(joint)[2]) < 0.05), None)

    def ground(self, platform: str) -> float | None:
        """Return how high (m) the ground is in the root: where the wheel touches it."""
        wheel = self.wheel_joint(platform)
        shape = self.solid(wheel.child, 'cylinder') if wheel else None
        if wheel is None or shape is None:
            return None
        center = self.pose(wheel.child).transform(shape.pose.position)
        return center[2] - shape.size[0] / 2.0

    def platform_top(self, platform: str) -> tuple[float, float] | None:
        """Return bottom and top (m above the ground) of the level platform's cylinder."""
        shape, ground = self.solid(platform, 'cylinder'), self.ground(platform)
        if shape is None or ground is None:
            return None
        middle = self.pose(platform).transform(shape.pose.position)[2] - ground
        return middle - shape.size[2] / 2.0, middle + shape.size[2] / 2.0

    def numbers(self, platform: str) -> dict[str, float]:
        """Return the numbers of the profile that follow from the model."""
        found = {}
        shape, height = self.solid(platform, 'cylinder'), self.platform_top(platform)
        wheel = self.wheel_joint(platform)
        rim = self.solid(wheel.child, 'cylinder') if wheel else None
        if shape is not None:
            found['platform_radius'] = shape.size[0] / 2.0
        if height is not None:
            found['platform_height'] = height[1]
        if rim is not None:
            found['wheel_radius'] = rim.size[0] / 2.0
        return found


def _about(axis: Vector, angle: float) -> tuple[float, float, float, float]:
    """Return the rotation by an angle (rad) about a unit vector."""
    s = sin(angle / 2.0)
    return (s * axis[0], s * axis[1], s * axis[2], cos(angle / 2.0))


def _joint(element: ElementTree.Element) -> Joint:
    """Read a joint; UrdfError if it can't be understood."""
    name = element.get('name', '')

    def link(role: str) -> str:
        found = element.find(role)
        if found is None:
            raise UrdfError(f'the joint {name} has no {role}')
        return found.get('link', '')

    def vector(tag: str, attribute: str, default: str) -> Vector:
        found = element.find(tag)
        words = (default if found is None else found.get(attribute, default)).split()
        try:
            x, y, z = map(float, words)
        except ValueError:
            raise UrdfError(f'the joint {name} has {attribute}="{" ".join(words)}"') from None
        return x, y, z

    axis = vector('axis', 'xyz', '1 0 0')
    length = hypot(*axis) or 1.0
    return Joint(name, element.get('type', ''), link('parent'), link('child'),
                 Pose(vector('origin', 'xyz', '0 0 0'),
                      from_rpy(*vector('origin', 'rpy', '0 0 0'))),
                 (axis[0] / length, axis[1] / length, axis[2] / length))
