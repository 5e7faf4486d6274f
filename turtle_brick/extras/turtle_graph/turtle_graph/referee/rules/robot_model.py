# SPDX-License-Identifier: Apache-2.0
"""Compute the poses of the links and visual elements in the URDF of a robot."""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from xml.etree import ElementTree

from turtle_graph.client.geometry import Array, ORIGIN, Pose, turn
from turtle_graph.client.record import Record
from turtle_graph.client.urdf import Joint, read_urdf, Visual
from turtle_graph.referee.rules.rule import Failed, require, require_clear


class RobotModel:
    """The links and joints in a URDF."""

    def __init__(self, description: str, names: Iterable[tuple[str, str]] = ()) -> None:
        """Parse a URDF and give its links standard names, or raise Failed if it is invalid."""
        standard = {name: standard for standard, name in names}
        try:
            robot = read_urdf(description)
        except (ElementTree.ParseError, ValueError) as error:
            raise Failed(f'the robot_description is invalid: {error}') from None
        self.links = {standard.get(link, link): visuals for link, visuals in robot.links.items()}
        self.joints = [joint._replace(parent=standard.get(joint.parent, joint.parent),
                                      child=standard.get(joint.child, joint.child))
                       for joint in robot.joints]
        self._colors = robot.colors
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

    def solids(self, link: str) -> list[Visual]:
        """Return the visual elements of a link and of the links fixed to it, in the root frame."""
        return [solid._replace(pose=self.pose(name).compose(solid.pose))
                for name in self.body(link) for solid in self.links.get(name, ())]

    def solid(self, link: str, *kinds: str) -> Visual:
        """Return the first of solids() that has a given kind, or raise Failed if none has."""
        for solid in self.solids(link):
            if solid.kind in kinds:
                return solid
        raise Failed(f'{link} has no {" or ".join(kinds)}')

    def color(self, visual: Visual) -> tuple[float, ...]:
        """Return the `rgba` values of a visual element, or () if it has no color."""
        return visual.color or self._colors.get(visual.material or '', ())

    def wheel(self) -> Visual:
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
    descriptions = require(record.topics['robot_description'], 'there is no robot_description')
    return _parse(descriptions[-1].message.data, tuple(record.profile.frames.items()))


_parse = lru_cache(4)(RobotModel)  # Many rules use the same robot_description.
