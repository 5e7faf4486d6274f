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
The configuration of the robot, the brick and the arena: one frozen dataclass.

Each value's description, unit and range stand with its field. `load` reads the ROS parameter file
config/turtle.yaml without ROS; a node gets the same values through
`turtle_brick.ros.node_parameters.declare_parameters`. The same rules apply to both; a value that is
refused raises a `ParameterError`, whose one sentence names the parameter, its value and what is
admissible.

A new parameter takes a line in config/turtle.yaml and a field of `Parameters`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, Field, field, fields
from difflib import get_close_matches
from importlib.metadata import metadata, PackageNotFoundError
import logging
from numbers import Real
from pathlib import Path
import re
import sys
from typing import Any
from urllib.parse import unquote

from turtle_brick.core.dimensions import Chassis
import yaml

OF_EVERY_NODE = ('use_sim_time', 'start_type_description_service', 'qos_overrides')
"""Parameters, or prefixes of their names, that ROS itself declares on nodes."""

LOGGER = logging.getLogger(__name__)

Triple = tuple[float, float, float]


class ParameterError(ValueError):
    """A parameter is missing or inadmissible."""


class MissingParameterError(ParameterError):
    """A parameter has no value."""


@dataclass(frozen=True)
class Meaning:
    """What a parameter means and which values are admissible."""

    description: str
    """The meaning, without the unit."""
    unit: str
    """Its SI unit."""
    lower: float
    """The least admissible value, for a vector of each component."""
    upper: float
    """The greatest admissible value, for a vector of each component."""
    length: int
    """3 for a vector, 1 for a number."""

    def expectation(self) -> str:
        """Say what is admissible, to follow the words 'must be'."""
        kind = 'a number' if self.length == 1 else f'{self.length} numbers'
        return f'{kind} from {self.lower:g} to {self.upper:g} {self.unit}'


def _number(description: str, unit: str, lower: float, upper: float) -> Any:
    return field(metadata={'meaning': Meaning(description, unit, lower, upper, 1)})


def _vector(description: str, unit: str, lower: float, upper: float) -> Any:
    return field(metadata={'meaning': Meaning(description, unit, lower, upper, 3)})


@dataclass(frozen=True, slots=True)
class Parameters:
    """
    The configured values: SI units, angles in radians.

    The values are always admissible: others raise ParameterError, also in `dataclasses.replace`.
    """

    platform_height: float = _number(
        "Height of the level platform's top above the ground", 'm', 0.01, 100.0)
    platform_radius: float = _number('Radius of the platform', 'm', 0.01, 10.0)
    platform_thickness: float = _number('Thickness of the platform', 'm', 0.001, 10.0)
    wheel_radius: float = _number('Radius of the wheel', 'm', 0.01, 10.0)
    max_velocity: float = _number(
        'Greatest translational speed of the robot', 'm/s', 0.01, 10.0)
    gravity_accel: float = _number('Acceleration due to gravity, downward', 'm/s^2', 0.01, 100.0)
    brick_size: Triple = _vector(
        'Size of the brick along its own x, y and z', 'm', 0.001, 10.0)
    brick_start: Triple = _vector(
        'Center of the brick in world before it is placed anywhere else', 'm', -1000.0, 1000.0)
    wall_height: float = _number("Height of the arena's walls", 'm', 0.001, 100.0)
    tilt_angle: float = _number(
        'Tilt of the platform with which a brick is tipped off', 'rad', 0.05, 1.5)

    def __post_init__(self) -> None:
        """Check the values and convert integers to floats."""
        for entry in fields(self):
            value = _admitted(entry, getattr(self, entry.name))
            object.__setattr__(self, entry.name, value)
        half_height = self.brick_size[2] / 2
        if self.brick_start[2] < half_height:
            raise ParameterError(
                f'brick_start {list(self.brick_start)} m is below the ground for a brick of '
                f'brick_size {list(self.brick_size)} m: its z must be at least {half_height:g} m')
        try:
            self.chassis
        except ValueError as error:
            raise ParameterError(str(error)) from None

    @property
    def chassis(self) -> Chassis:
        """Return the robot's dimensions, which are derived from these."""
        return Chassis.from_dimensions(
            self.platform_height, self.platform_radius, self.platform_thickness,
            self.wheel_radius)


def meaning(entry: Field[Any]) -> Meaning:
    """
    Return the meaning of a field of Parameters.

    :param entry: One of `dataclasses.fields(Parameters)`.
    :return: Its description, unit and range.
    """
    return entry.metadata['meaning']


def _admitted(entry: Field[Any], value: Any) -> float | Triple:
    rule = meaning(entry)
    numbers = [value] if rule.length == 1 else value
    # ROS gives an array.array: any sequence is good, except a string.
    if isinstance(numbers, (str, bytes, Mapping)) or not hasattr(numbers, '__len__'):
        raise _refusal(entry, value)
    numbers = list(numbers)
    if len(numbers) != rule.length:
        raise _refusal(entry, value)
    for number in numbers:
        if isinstance(number, bool) or not isinstance(number, Real):
            raise _refusal(entry, value)
        # A comparison with NaN is false: it is refused by the second one.
        if number < rule.lower or not number <= rule.upper:
            raise _refusal(entry, value)
    if rule.length == 1:
        return float(numbers[0])
    x, y, z = map(float, numbers)
    return (x, y, z)


def _refusal(entry: Field[Any], value: Any) -> ParameterError:
    if isinstance(value, tuple):
        value = list(value)
    elif hasattr(value, 'tolist'):
        value = value.tolist()
    return ParameterError(
        f'{entry.name} is {value!r:.80}, but must be {meaning(entry).expectation()}')


def from_mapping(mapping: Mapping[Any, Any],
                 warn: Callable[[str], object] = LOGGER.warning) -> Parameters:
    """
    Make Parameters of a mapping from names to values.

    :param mapping: A value for each field of Parameters: a number (integers are as good as floats)
        or a sequence of three.
    :param warn: Called with a sentence for each further name that is no parameter.
    :return: The values.
    :raises MissingParameterError: A value is missing.
    :raises ParameterError: A name is misspelt, a value is of the wrong type or out of range, or no
        robot can have these dimensions.
    """
    names = [entry.name for entry in fields(Parameters)]
    missing = [name for name in names if name not in mapping]
    misspelt = []
    for name in sorted({str(name).partition('.')[0] for name in mapping}.difference(
            names, OF_EVERY_NODE)):
        meant = get_close_matches(name, missing or names, 1, 0.7)
        sentence = f'unknown {name}' + ''.join(f', did you mean {name}?' for name in meant)
        if missing and meant:
            missing.remove(meant[0])
            misspelt.append(sentence)
        else:
            warn(sentence)
    if misspelt:
        raise ParameterError(' '.join(misspelt))
    if missing:
        raise MissingParameterError(f'missing parameters: {", ".join(sorted(missing))}')
    return Parameters(**{name: mapping[name] for name in names})


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
    Read a ROS parameter file without ROS.

    Of the file's sections only `/**: ros__parameters:` is read, the one that holds for every node.
    LOGGER warns of names in it that are no parameters.

    :param path: The file; config/turtle.yaml if None.
    :return: The values in it.
    :raises ParameterError: The file cannot be read, is no parameter file, or holds values that
        `from_mapping` refuses. The sentence begins with the file to change and, where there is
        one, the line.
    """
    path = default_path() if path is None else Path(path)
    try:
        text = path.read_text(encoding='utf-8')
        section = yaml.safe_load(text)
    except OSError as error:
        raise ParameterError(f'{path}: {error.strerror}') from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        reason = str(error).replace('in "<unicode string>", ', 'in ')
        raise ParameterError(f'{to_change(path)}: this is not YAML: {reason}') from error
    for key in ('/**', 'ros__parameters'):
        section = section.get(key) if isinstance(section, dict) else None
    if not isinstance(section, dict):
        raise ParameterError(
            f"{to_change(path)}: there are no parameters under '/**: ros__parameters:'")
    lines = {key: f':{number}' for number, line in enumerate(text.splitlines(), 1)
             for key in re.findall(r'(\w+)["\']?\s*:', line.partition('#')[0])}

    def located(sentence: str) -> str:
        # A sentence begins with the parameter that it is about.
        line = next((lines[word] for word in re.findall(r'\w+', sentence) if word in lines), '')
        return f'{to_change(path, line)}: {sentence}'

    try:
        return from_mapping(section, lambda sentence: LOGGER.warning(located(sentence)))
    except ParameterError as error:
        raise type(error)(located(str(error))) from None


def to_change(path: Path, line: str = '') -> str:
    """
    Name the file that has to be changed if a file is wrong.

    An install copies the package's files, or links to them. Where the source is, setup.py has
    left in the metadata of the install.

    :param path: The file.
    :param line: What follows its name, such as ':7'.
    :return: If it is an installed one of this package, the one in the source, unless that has
        changed since.
    """
    source = path.resolve()
    share = default_path().parents[1]
    if share in path.parents and not path.is_symlink():
        with suppress(PackageNotFoundError):
            for url in metadata('turtle_brick').get_all('Project-URL', []):
                folder = Path(unquote(url.removeprefix('Source, file://')))
                original = folder / path.relative_to(share)
                if original.is_file():
                    source = original
    if source.read_bytes() != path.read_bytes():
        return f'{path}{line} (older than {source}: build again)'
    return f'{source}{line}'


def main() -> int:
    """Say what is wrong with config/turtle.yaml; return the exit status."""
    try:
        load()
    except ParameterError as error:
        print(f'turtle_brick: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
