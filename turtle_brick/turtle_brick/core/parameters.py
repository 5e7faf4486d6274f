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
The configured numbers: what each may be (PARAMETER_RULES), and who uses which.

`load` reads the ROS parameter file config/turtle.yaml without ROS; a node declares what it uses
with `turtle_brick.ros.node_parameters.declare_parameters`. Either way a value that is missing or
inadmissible raises a ParameterError, whose one sentence names it and what is admissible.

A new number takes a line in config/turtle.yaml, a row of PARAMETER_RULES, and a field in the parameters of
who uses it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
import sys
from typing import Any, NamedTuple, TypeVar

from turtle_brick.core.dimensions import check_dimensions
import yaml

Triple = tuple[float, float, float]

AnyParameterSet = TypeVar('AnyParameterSet', bound='ParameterSet')
"""The parameters of somebody."""


class ParameterError(ValueError):
    """A parameter is missing or inadmissible."""


class MissingParameterError(ParameterError):
    """A parameter has no value."""


class ParameterRule(NamedTuple):
    """What a parameter means and which values are admissible."""

    description: str
    unit: str
    lower: float
    """The least admissible value, for a vector of each component."""
    upper: float
    """The greatest admissible value, for a vector of each component."""
    length: int = 1
    """3 for a vector, 1 for a number."""

    def expectation(self) -> str:
        """Say what is admissible, to follow the words 'must be'."""
        kind = 'a number' if self.length == 1 else f'{self.length} numbers'
        return f'{kind} from {self.lower:g} to {self.upper:g} {self.unit}'

    def admits(self, value: Any) -> bool:
        """Tell whether a value is admissible: integers are as good as floats, bools are not."""
        numbers = [value] if self.length == 1 else value
        if not isinstance(numbers, (list, tuple)) or len(numbers) != self.length:
            return False
        # A comparison with NaN is false.
        return all(isinstance(number, (int, float)) and not isinstance(number, bool)
                   and self.lower <= number <= self.upper for number in numbers)


PARAMETER_RULES = {
    'platform_height': ParameterRule("Height of the level platform's top above the ground", 'm', 0.01, 100),
    'platform_radius': ParameterRule('Radius of the platform', 'm', 0.01, 10),
    'platform_thickness': ParameterRule('Thickness of the platform', 'm', 0.001, 10),
    'wheel_radius': ParameterRule('Radius of the wheel', 'm', 0.01, 10),
    'max_velocity': ParameterRule('Greatest translational speed of the robot', 'm/s', 0.01, 10),
    'tilt_angle': ParameterRule('Tilt of the platform with which a brick is tipped off', 'rad', 0.05, 1.5),
    'gravity_accel': ParameterRule('Acceleration due to gravity, downward', 'm/s^2', 0.01, 100),
    'brick_size': ParameterRule('Size of the brick along its own x, y and z', 'm', 0.001, 10, 3),
    'brick_start': ParameterRule(
        'Center of the brick in world before it is placed anywhere else', 'm', -1000, 1000, 3),
    'wall_height': ParameterRule("Height of the arena's walls", 'm', 0.001, 100),
}


@dataclass(frozen=True)
class ParameterSet:
    """Values that are always admissible: others raise ParameterError, also in `replace`."""

    def __post_init__(self) -> None:
        """Check the values and make floats of them."""
        for name in [entry.name for entry in fields(self)]:
            rule, value = PARAMETER_RULES[name], getattr(self, name)
            if not rule.admits(value):
                raise ParameterError(f'{name} is {value!r:.80}, but must be {rule.expectation()}')
            value = float(value) if rule.length == 1 else tuple(map(float, value))
            object.__setattr__(self, name, value)

    @classmethod
    def from_mapping(cls: type[AnyParameterSet], mapping: Mapping[Any, Any]) -> AnyParameterSet:
        """
        Take the values from a mapping that may hold more.

        :raises MissingParameterError: a value is missing
        :raises ParameterError: a name is misspelled, or a value is inadmissible
        """
        names = [entry.name for entry in fields(cls)]
        missing = [name for name in names if name not in mapping]
        unknown = [str(name) for name in mapping if name not in PARAMETER_RULES]
        for name in missing:
            slips = get_close_matches(name, unknown, 1, 0.7)
            if slips:
                raise ParameterError(f'unknown {slips[0]}, did you mean {name}?')
        if missing:
            raise MissingParameterError(f'missing parameters: {", ".join(sorted(missing))}')
        return cls(**{name: mapping[name] for name in names})


@dataclass(frozen=True)
class RobotParameters(ParameterSet):
    """What turtle_robot uses; SI units, radians."""

    max_velocity: float
    wheel_radius: float


@dataclass(frozen=True)
class ArenaParameters(ParameterSet):
    """What the arena and its physics use; SI units, radians."""

    gravity_accel: float
    platform_radius: float
    platform_thickness: float
    brick_size: Triple
    brick_start: Triple
    wall_height: float

    def __post_init__(self) -> None:
        """Check the values, and that the brick starts above the ground."""
        super().__post_init__()
        half_height = self.brick_size[2] / 2
        if self.brick_start[2] < half_height:
            raise ParameterError(
                f'brick_start {list(self.brick_start)} m is below the ground for a brick of '
                f'brick_size {list(self.brick_size)} m: its z must be at least {half_height:g} m')


@dataclass(frozen=True)
class CatcherParameters(ParameterSet):
    """What the catcher uses; SI units, radians."""

    max_velocity: float
    platform_height: float
    platform_radius: float
    gravity_accel: float
    brick_size: Triple
    tilt_angle: float


@dataclass(frozen=True)
class Parameters(RobotParameters, ArenaParameters, CatcherParameters):
    """All of config/turtle.yaml: also a robot that can be; SI units, radians."""

    def __post_init__(self) -> None:
        """Check the values, and that the platform can turn over."""
        super().__post_init__()
        try:
            check_dimensions(self.platform_height, self.platform_radius, self.platform_thickness,
                             self.wheel_radius)
        except ValueError as error:
            raise ParameterError(str(error)) from None


def default_path() -> Path:
    """
    Find config/turtle.yaml.

    :return: The installed file in the package's share directory, or, where the package is not
        installed, the one in the source tree.
    """
    try:
        from ament_index_python.packages import get_package_share_path
        share = get_package_share_path('turtle_brick')
    except (ImportError, LookupError, OSError):
        # No ament here, this package unknown to it, or no AMENT_PREFIX_PATH at all.
        share = Path(__file__).resolve().parents[2]
    return share / 'config' / 'turtle.yaml'


def load(path: str | Path | None = None) -> Parameters:
    """
    Read a ROS parameter file without ROS; see `read`.

    :param path: the file; config/turtle.yaml if None
    """
    return read(default_path() if path is None else path, Parameters)


def read(path: str | Path, used: type[AnyParameterSet]) -> AnyParameterSet:
    """
    Read from a ROS parameter file what somebody uses.

    Only its section `/**: ros__parameters:` is read, the one that holds for every node.

    :raises ParameterError: The file cannot be read, is no parameter file, or a value in it is
        missing or inadmissible; the sentence begins with the file.
    """
    try:
        section = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        raise ParameterError(f'{path}: {error.strerror}') from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        reason = str(error).replace('in "<unicode string>", ', 'in ')
        raise ParameterError(f'{path}: this is not YAML: {reason}') from error
    for key in ('/**', 'ros__parameters'):
        section = section.get(key) if isinstance(section, dict) else None
    if not isinstance(section, dict):
        raise ParameterError(f"{path}: there are no parameters under '/**: ros__parameters:'")
    try:
        return used.from_mapping(section)
    except ParameterError as error:
        raise type(error)(f'{path}: {error}') from None


def main() -> int:
    """Say what is wrong with a parameter file, config/turtle.yaml by default; return a status."""
    try:
        load(*sys.argv[1:])
    except ParameterError as error:
        print(f'turtle_brick: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
