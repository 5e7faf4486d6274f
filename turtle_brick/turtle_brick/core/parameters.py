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
Valid ranges of the parameters in config/turtle.yaml, and the parameter set of each node.

`load` reads the file without ROS. A node declares its parameters with
`turtle_brick.ros.node_parameters.declare_parameters`. `load` and `declare_parameters` raise a
ParameterError if a value is missing or invalid.

To add a parameter, add it to config/turtle.yaml, to PARAMETER_RULES, and to the parameter set of
each node that uses it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches
from math import hypot
from pathlib import Path
import sys
from typing import Any, NamedTuple, TypeVar

Triple = tuple[float, float, float]

AnyParameterSet = TypeVar('AnyParameterSet', bound='ParameterSet')


class ParameterError(ValueError):
    """A parameter is missing or invalid."""


class MissingParameterError(ParameterError):
    """A parameter is missing."""


class ParameterRule(NamedTuple):
    """Description and valid range of a parameter."""

    description: str
    unit: str
    """Unit, or an empty string for a ratio."""
    lower: float
    """Minimum valid value of a number, or of each component of a vector."""
    upper: float
    length: int = 1
    """Number of components, which is 1 for a number and 3 for a vector."""

    def allowed_values(self) -> str:
        """Return the allowed values as text, such as 'a number from 0.01 to 10 m'."""
        kind = 'a number' if self.length == 1 else f'{self.length} numbers'
        return f'{kind} from {self.lower:g} to {self.upper:g} {self.unit}'.rstrip()

    def allows(self, value: Any) -> bool:
        """Return whether a value is valid. Integers are valid, but booleans are not."""
        numbers = [value] if self.length == 1 else value
        if not isinstance(numbers, (list, tuple)) or len(numbers) != self.length:
            return False
        # NaN is invalid because every comparison with NaN is false.
        return all(isinstance(number, (int, float)) and not isinstance(number, bool)
                   and self.lower <= number <= self.upper for number in numbers)


PARAMETER_RULES = {
    'platform_height': ParameterRule(
        "Height of the level platform's top above the ground", 'm', 0.01, 100),
    'platform_radius': ParameterRule('Radius of the platform', 'm', 0.01, 10),
    'platform_thickness': ParameterRule('Thickness of the platform', 'm', 0.001, 10),
    'wheel_radius': ParameterRule('Radius of the wheel', 'm', 0.01, 10),
    'max_velocity': ParameterRule('Maximum translational speed of the robot', 'm/s', 0.01, 10),
    'tilt_angle': ParameterRule('Platform angle for tipping off a brick', 'rad', 0.05, 1.5),
    'gravity_accel': ParameterRule('Downward acceleration due to gravity', 'm/s^2', 0.01, 100),
    'brick_size': ParameterRule('Size of the brick along its x, y and z axes', 'm', 0.001, 10, 3),
    'brick_start': ParameterRule(
        "Initial location of the brick's center in the world frame", 'm', -1000, 1000, 3),
    'wall_height': ParameterRule("Height of the arena's walls", 'm', 0.001, 100),
}


@dataclass(frozen=True)
class ParameterSet:
    """Base class for parameter sets. An invalid value raises a ParameterError."""

    def __post_init__(self) -> None:
        """Check all values and convert them to floats."""
        for name in [field.name for field in fields(self)]:
            rule, value = PARAMETER_RULES[name], getattr(self, name)
            if not rule.allows(value):
                raise ParameterError(
                    f'{name} is {value!r:.80}, but must be {rule.allowed_values()}')
            value = float(value) if rule.length == 1 else tuple(map(float, value))
            object.__setattr__(self, name, value)

    @classmethod
    def from_mapping(cls: type[AnyParameterSet], mapping: Mapping[Any, Any]) -> AnyParameterSet:
        """
        Create a parameter set from a mapping that may also contain other parameters.

        :raises ParameterError: if a value is missing or invalid, or a name is misspelled
        """
        names = [field.name for field in fields(cls)]
        missing = [name for name in names if name not in mapping]
        unknown = [str(name) for name in mapping if name not in PARAMETER_RULES]
        for name in missing:
            similar = get_close_matches(name, unknown, 1, 0.7)
            if similar:
                raise ParameterError(f'unknown parameter {similar[0]} (did you mean {name}?)')
        if missing:
            raise MissingParameterError(f'missing parameters: {", ".join(sorted(missing))}')
        return cls(**{name: mapping[name] for name in names})


@dataclass(frozen=True)
class RobotParameters(ParameterSet):
    """Parameters of the `turtle_robot` node in SI units."""

    max_velocity: float
    wheel_radius: float


@dataclass(frozen=True)
class ArenaParameters(ParameterSet):
    """Parameters of the arena and its physics in SI units."""

    gravity_accel: float
    platform_radius: float
    platform_thickness: float
    brick_size: Triple
    brick_start: Triple
    wall_height: float

    def __post_init__(self) -> None:
        """Check that all values are valid and that the brick starts above the ground."""
        super().__post_init__()
        half_height = self.brick_size[2] / 2
        if self.brick_start[2] < half_height:
            raise ParameterError(
                f'brick_start {list(self.brick_start)} m is below the ground for a brick of '
                f'brick_size {list(self.brick_size)} m, so z must be at least {half_height:g} m')


@dataclass(frozen=True)
class CatcherParameters(ParameterSet):
    """Parameters of the catcher in SI units."""

    max_velocity: float
    platform_height: float
    platform_radius: float
    gravity_accel: float
    brick_size: Triple
    tilt_angle: float


@dataclass(frozen=True)
class Parameters(RobotParameters, ArenaParameters, CatcherParameters):
    """All parameters in config/turtle.yaml, in SI units."""

    def __post_init__(self) -> None:
        """Check that all values are valid and that the robot can be built."""
        super().__post_init__()
        least, greatest = self.wheel_radius / 3, self.wheel_radius * 20
        if not least <= self.platform_radius <= greatest:
            raise ParameterError(
                f'platform_radius is {self.platform_radius:g} m, but with wheel_radius '
                f'{self.wheel_radius:g} m it must be from {least:g} to {greatest:g} m')
        least = least_height(self.platform_radius, self.platform_thickness, self.wheel_radius)
        if self.platform_height < least:
            raise ParameterError(
                f'platform_height is {self.platform_height:g} m, but with platform_radius '
                f'{self.platform_radius:g} m, platform_thickness {self.platform_thickness:g} m '
                f'and wheel_radius {self.wheel_radius:g} m it must be at least {least:g} m so '
                'that the platform can turn over')


def least_height(platform_radius: float, platform_thickness: float, wheel_radius: float) -> float:
    """
    Return the minimum platform_height (m) at which the platform can turn over.

    The platform turns about a hinge in the center of its base, so it stays inside a sphere around
    the hinge. The wheel, a neck and the cube of base_link must fit below this sphere. The neck and
    the cube together are at least 5 cm high so that the cube is visible.
    """
    sphere_radius = hypot(platform_radius, platform_thickness)
    neck_and_cube = max(0.05, wheel_radius, platform_radius / 5)
    return 2 * wheel_radius + sphere_radius + platform_thickness + neck_and_cube


def default_path() -> Path:
    """Return the path of the installed config/turtle.yaml, or of the source file as a fallback."""
    try:
        from ament_index_python.packages import get_package_share_path
        share = get_package_share_path('turtle_brick')
    except (ImportError, LookupError, OSError):
        # ament or the package is not installed, or AMENT_PREFIX_PATH is not set.
        share = Path(__file__).resolve().parents[2]
    return share / 'config' / 'turtle.yaml'


def load(path: str | Path | None = None) -> Parameters:
    """
    Read all parameters from a ROS parameter file, by default config/turtle.yaml.

    :raises ParameterError: if the file is unreadable or invalid (the message begins with its path)
    """
    import yaml  # The page in web/ runs without PyYAML.
    path = default_path() if path is None else path
    try:
        section = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        raise ParameterError(f'{path}: {error.strerror}') from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        reason = str(error).replace('in "<unicode string>", ', 'in ')
        raise ParameterError(f'{path}: invalid YAML: {reason}') from error
    for key in ('/**', 'ros__parameters'):
        section = section.get(key) if isinstance(section, dict) else None
    if not isinstance(section, dict):
        raise ParameterError(f"{path}: there are no parameters under '/**: ros__parameters:'")
    try:
        return Parameters.from_mapping(section)
    except ParameterError as error:
        raise type(error)(f'{path}: {error}') from None


def main() -> int:
    """Check a parameter file, by default config/turtle.yaml, and return the exit status."""
    try:
        load(*sys.argv[1:])
    except ParameterError as error:
        print(f'turtle_brick: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
