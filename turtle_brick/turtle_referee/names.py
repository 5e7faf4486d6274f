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
What an implementation calls things, and the numbers it was built with. No ROS.

The defaults are the assignment's own names. A profile in YAML, or `--set`, says what differs:

    topics: {cmd_vel: robot/cmd_vel, tilt: platform_tilt}
    services: {place: put}
    frames: {platform: tray}
    numbers: {platform_radius: 0.4}
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import yaml

TOPICS = ('cmd_vel', 'odom', 'joint_states', 'goal_pose', 'tilt', 'pose', 'robot_description')
SERVICES = ('place', 'drop')
FRAMES = ('world', 'odom', 'base_link', 'platform', 'brick')

NUMBERS = {'platform_height': 1.0, 'platform_radius': 0.5, 'wheel_radius': 0.2,
           'max_velocity': 1.0, 'gravity_accel': 9.81}
"""The robot's numbers (m, s), each with a usual one, to reckon with where none is known."""


class ProfileError(ValueError):
    """A profile, an option or a parameter file can't be used; the text says why."""


@dataclass
class Profile:
    """Names and numbers of an implementation."""

    topics: dict[str, str] = field(default_factory=lambda: {
        **{name: name for name in TOPICS}, 'cmd_vel': 'turtle1/cmd_vel', 'pose': 'turtle1/pose'})
    services: dict[str, str] = field(default_factory=lambda: {name: name for name in SERVICES})
    frames: dict[str, str] = field(default_factory=lambda: {name: name for name in FRAMES})
    numbers: dict[str, float] = field(default_factory=dict)
    """Those that are known; what is not given is asked of the nodes."""
    guessed: set[str] = field(default_factory=set)
    """Numbers that only the URDF tells."""

    @classmethod
    def from_parameters(cls, parameters: Any) -> 'Profile':
        """Return the names of the assignment, with the numbers that parameters have."""
        return cls(numbers={name: getattr(parameters, name) for name in NUMBERS})

    def update(self, sections: Mapping[str, Mapping[str, Any]], source: str) -> None:
        """
        Take over what differs.

        :param sections: the sections of a profile
        :param source: what to call it in an error
        :raises ProfileError: an entry means nothing or has no such value
        """
        known: dict[str, Iterable[str]] = {
            'topics': TOPICS, 'services': SERVICES, 'frames': FRAMES, 'numbers': NUMBERS}
        for section, entries in _mapping(sections, source).items():
            if section not in known:
                raise ProfileError(f'{source}: unknown section {section!r}, there are: '
                                   f'{", ".join(known)}')
            for name, value in _mapping(entries, f'{source}: {section}').items():
                if name not in known[section]:
                    raise ProfileError(f'{source}: unknown {section}.{name}, there are: '
                                       f'{", ".join(known[section])}')
                if section == 'numbers':
                    wanted = 'number above 0'
                    good = type(value) in (int, float) and 0 < value < inf
                else:
                    wanted, good = 'name', isinstance(value, str) and value != ''
                if not good:
                    raise ProfileError(f'{source}: {section}.{name} is {value!r:.60}, but must be '
                                       f'a {wanted}')
                getattr(self, section)[name] = float(value) if section == 'numbers' else value

    def load(self, path: Path) -> None:
        """Take over a profile from a YAML file; ProfileError if it is none."""
        self.update(_read(path), str(path))

    def load_parameters(self, path: Path) -> None:
        """Take over the numbers from a ROS parameter file, of whichever node; or ProfileError."""
        for node in _mapping(_read(path), str(path)).values():
            given = _mapping(_mapping(node, str(path)).get('ros__parameters', {}), str(path))
            self.update({'numbers': {name: value for name, value in given.items()
                                     if name in NUMBERS}}, str(path))

    def set_entry(self, option: str) -> None:
        """Take over one entry, as in 'topics.tilt:=tray_angle'; ProfileError if it can't be."""
        key, assigned, value = option.partition(':=')
        section, dot, name = key.partition('.')
        if not (assigned and dot):
            raise ProfileError(f'--set {option!r:.60} is not of the form SECTION.NAME:=VALUE')
        source = f'--set {key}'
        self.update({section: {name: _parse(value, source) if section == 'numbers' else value}},
                    source)


def _mapping(value: Any, source: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ProfileError(f'{source}: {value!r:.60} is no mapping of names to values')
    return value


def _read(path: Path) -> Any:
    try:
        return _parse(path.read_text(encoding='utf-8'), str(path)) or {}
    except (OSError, UnicodeDecodeError) as error:
        raise ProfileError(f'{path}: {error}') from None


def _parse(text: str, source: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ProfileError(f'{source}: {" ".join(str(error).split())}') from None
