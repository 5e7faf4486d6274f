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
"""
Names of topics and services in an implementation, and physical parameters of the robot.

The default names come from the assignment. A YAML file can define other names and values:

    topics: {cmd_vel: robot/cmd_vel, tilt: platform_tilt}
    services: {place: put}
    numbers: {platform_radius: 0.4}
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

TOPICS = ('cmd_vel', 'odom', 'joint_states', 'goal_pose', 'tilt', 'pose', 'robot_description')
SERVICES = ('place', 'drop')

NUMBERS = {'platform_height': 1.0, 'platform_radius': 0.5, 'wheel_radius': 0.2,
           'max_velocity': 1.0, 'gravity_accel': 9.81}
"""Typical values of the robot's physical parameters (m, m/s, m/s^2)."""


@dataclass
class Profile:
    """The topic names, service names and physical parameters of an implementation."""

    topics: dict[str, str] = field(default_factory=lambda: {
        **{name: name for name in TOPICS}, 'cmd_vel': 'turtle1/cmd_vel', 'pose': 'turtle1/pose'})
    services: dict[str, str] = field(default_factory=lambda: {name: name for name in SERVICES})
    numbers: dict[str, float] = field(default_factory=dict)
    """Known physical parameters. The referee reads the other parameters from the nodes."""

    @classmethod
    def from_parameters(cls, parameters: Any) -> 'Profile':
        """Return a profile with default names and the physical parameters from a given object."""
        return cls(numbers={name: getattr(parameters, name) for name in NUMBERS})

    def load(self, path: Path) -> None:
        """Update the profile from a YAML file, or raise ValueError if the file is invalid."""
        known: dict[str, tuple[Iterable[str], tuple[type, ...]]] = {
            'topics': (TOPICS, (str,)), 'services': (SERVICES, (str,)),
            'numbers': (NUMBERS, (int, float))}
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
