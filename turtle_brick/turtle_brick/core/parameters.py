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
Parameters in config/turtle.yaml with their valid ranges.

`load` reads the file without ROS, and `turtle_brick.ros.node_main.declare_parameters`
declares the parameters of a node. Both functions check every value against PARAMETER_RULES, and
return `Parameters` or raise ParameterError. The robot description, urdf/turtle.urdf.xacro, rejects
combinations of individually valid dimensions that no robot can have.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

from turtle_brick.core.geometry import Vector


class ParameterError(ValueError):
    """A parameter is missing or invalid."""


class MissingParameterError(ParameterError):
    """A parameter is missing."""


@dataclass(frozen=True)
class Parameters:
    """All parameters in config/turtle.yaml, in SI units and radians (see PARAMETER_RULES)."""

    platform_height: float
    platform_radius: float
    platform_thickness: float
    wheel_radius: float
    max_velocity: float
    command_latency: float
    tilt_angle: float
    gravity_accel: float
    brick_size: Vector
    brick_start: Vector
    wall_height: float

    @classmethod
    def from_mapping(cls, mapping: Mapping[Any, Any]) -> 'Parameters':
        """
        Create parameters from a mapping, and ignore additional keys.

        :raises ParameterError: if a parameter is missing, misspelled or invalid
        """
        names = [field.name for field in fields(cls)]
        missing = [name for name in names if name not in mapping]
        unknown = [str(name) for name in mapping if name not in names]
        for name in missing:
            similar = get_close_matches(name, unknown, 1, 0.7)
            if similar:
                raise ParameterError(f'unknown parameter {similar[0]} (did you mean {name}?)')
        if missing:
            raise MissingParameterError(f'missing parameters: {", ".join(sorted(missing))}')
        parameters = cls(**{
            name: PARAMETER_RULES[name].convert(name, mapping[name]) for name in names})
        half_height = parameters.brick_size[2] / 2
        if parameters.brick_start[2] < half_height:
            raise ParameterError(
                f'brick_start {list(parameters.brick_start)} m is below the ground for a brick of '
                f'brick_size {list(parameters.brick_size)} m, so z must be at least '
                f'{half_height:g} m')
        return parameters


class ParameterRule(NamedTuple):
    """Description and valid range of a parameter."""

    description: str
    unit: str
    """Unit of the value, or an empty string for a ratio."""
    lower: float
    """Minimum valid value of a number, or of each component of a vector."""
    upper: float
    length: int = 1
    """Number of components, which is 1 for a number and 3 for a vector."""

    def allowed_values(self) -> str:
        """Return the allowed values as text, such as 'a number from 0.01 to 10 m'."""
        kind = 'a number' if self.length == 1 else f'{self.length} numbers'
        return f'{kind} from {self.lower:g} to {self.upper:g} {self.unit}'.rstrip()

    def convert(self, name: str, value: Any) -> Any:
        """
        Return the value of a parameter as a float or a tuple of floats.

        :raises ParameterError: if the value has the wrong type or is out of range
        """
        numbers = [value] if self.length == 1 else value
        # NaN fails this range check because every comparison with NaN is false.
        if (not isinstance(numbers, (list, tuple)) or len(numbers) != self.length
                or not all(type(number) in (int, float) and self.lower <= number <= self.upper
                           for number in numbers)):
            raise ParameterError(f'{name} is {value!r:.80}, but must be {self.allowed_values()}')
        return float(value) if self.length == 1 else tuple(map(float, value))


PARAMETER_RULES = {
    'platform_height': ParameterRule(
        "Height of the level platform's top above the ground", 'm', 0.01, 100),
    'platform_radius': ParameterRule('Radius of the platform', 'm', 0.01, 10),
    'platform_thickness': ParameterRule('Thickness of the platform', 'm', 0.001, 10),
    'wheel_radius': ParameterRule('Radius of the wheel', 'm', 0.01, 10),
    'max_velocity': ParameterRule('Maximum translational speed of the robot', 'm/s', 0.01, 1000),
    'command_latency': ParameterRule(
        'Maximum time from a decision of the catcher until the arena sees the robot move', 's',
        0, 10),
    'tilt_angle': ParameterRule('Platform angle for tipping off a brick', 'rad', 0.05, 1.5),
    'gravity_accel': ParameterRule('Downward acceleration due to gravity', 'm/s^2', 0.01, 100),
    'brick_size': ParameterRule('Size of the brick along its x, y and z axes', 'm', 0.001, 10, 3),
    'brick_start': ParameterRule(
        "Initial location of the brick's center in the world frame", 'm', -1000, 1000, 3),
    'wall_height': ParameterRule("Height of the arena's walls", 'm', 0.001, 100),
}


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

    :raises ParameterError: if the file is unreadable or invalid (the message names the file)
    """
    path = default_path() if path is None else path
    try:
        return Parameters.from_mapping(read_values(path))
    except ParameterError as error:
        raise type(error)(f'{path}: {error}') from None


def read_values(path: str | Path) -> dict[Any, Any]:
    """Read the unchecked values in a parameter file, or raise ParameterError."""
    import yaml  # Nodes do not need PyYAML.
    try:
        section = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        raise ParameterError(error.strerror) from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        reason = str(error).replace('in "<unicode string>", ', 'in ')
        raise ParameterError(f'invalid YAML: {reason}') from error
    for key in ('/**', 'ros__parameters'):
        section = section.get(key) if isinstance(section, dict) else None
    if not isinstance(section, dict):
        raise ParameterError("there are no parameters under '/**: ros__parameters:'")
    return section
