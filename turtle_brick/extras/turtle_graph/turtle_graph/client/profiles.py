# SPDX-License-Identifier: Apache-2.0
"""
Define the topic, service and frame names and the physical parameters of a robot.

The default names come from the assignment. A YAML file can define other names and values:

    topics: {cmd_vel: robot/cmd_vel, tilt: platform_tilt}
    services: {place: put}
    frames: {brick: brick_frame, platform: tray}
    numbers: {platform_radius: 0.4}
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

TOPICS: dict[str, tuple[str, ...]] = {
    'cmd_vel': ('geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped'),
    'odom': ('nav_msgs/msg/Odometry',), 'joint_states': ('sensor_msgs/msg/JointState',),
    'goal_pose': tuple(f'geometry_msgs/msg/{name}' for name in (
        'PoseStamped', 'Pose', 'PointStamped', 'Point', 'Pose2D')),
    'tilt': (), 'pose': ('turtlesim/msg/Pose',), 'robot_description': ('std_msgs/msg/String',)}
"""Standard names and possible types of all topics. The tilt topic can have any type."""
TURTLE_COMMANDS = 'turtle1/cmd_vel'
"""Topic of turtlesim, unless a launch file remaps it to the robot's topic cmd_vel."""
COMMANDS = ('goal_pose', 'tilt')
"""Command topics, to which the robot subscribes."""
SERVICES = ('place', 'drop')
FRAMES = ('world', 'odom', 'base_link', 'brick', 'platform', 'stem', 'wheel')
NUMBERS = {'platform_height': 1.0, 'platform_radius': 0.5, 'wheel_radius': 0.2,
           'max_velocity': 1.0, 'gravity_accel': 9.81}
"""Typical values of the robot's physical parameters (m, m/s, m/s^2)."""


@dataclass
class Profile:
    """The names of topics, services and frames in a graph, and the parameters of the robot."""

    topics: dict[str, str] = field(default_factory=lambda: {
        **{name: name for name in TOPICS}, 'cmd_vel': TURTLE_COMMANDS, 'pose': 'turtle1/pose'})
    services: dict[str, str] = field(default_factory=lambda: {name: name for name in SERVICES})
    frames: dict[str, str] = field(default_factory=lambda: {name: name for name in FRAMES})
    numbers: dict[str, float] = field(default_factory=dict)
    """Known physical parameters. The referee reads missing parameters from the nodes."""

    @classmethod
    def from_parameters(cls, parameters: Any) -> 'Profile':
        """Return a profile with default names and the physical parameters in `parameters`."""
        return cls(numbers={name: getattr(parameters, name) for name in NUMBERS})

    def load(self, path: Path) -> None:
        """Update the profile from a YAML file, or raise ValueError if the file is invalid."""
        known: dict[str, tuple[Iterable[str], tuple[type, ...]]] = {
            'topics': (TOPICS, (str,)), 'services': (SERVICES, (str,)),
            'frames': (FRAMES, (str,)), 'numbers': (NUMBERS, (int, float))}
        try:
            sections = yaml.safe_load(path.read_text(encoding='utf-8')) or {}
            entries = [(section, name, value) for section, content in sections.items()
                       for name, value in content.items()]
        except (OSError, UnicodeDecodeError, yaml.YAMLError, AttributeError) as error:
            raise ValueError(f'{path}: {" ".join(str(error).split())}') from None
        for section, name, value in entries:
            names, types = known.get(section, (known, ()))
            if name not in names or type(value) not in types or not value:
                raise ValueError(f'{path}: {section}.{name}: {value!r:.60} is not valid; the '
                                 f'valid names are {", ".join(names)}')
            getattr(self, section)[name] = value


def similar_names(name: str, available: Mapping[str, Iterable[str]]) -> list[str]:
    """Return the available names that best match a standard name and have a suitable type."""
    word = name.removesuffix('_pose').removesuffix('_states')
    candidates = {}
    for full_name, types in available.items():
        last = full_name.rpartition('/')[2].lower()
        if word in last and (not TOPICS.get(name) or set(TOPICS[name]).intersection(types)):
            candidates[full_name] = last.removesuffix('_link').removesuffix('_frame')
    exact = [full_name for full_name, last in candidates.items()
             if last == name.removesuffix('_link')]
    return exact or list(candidates)
