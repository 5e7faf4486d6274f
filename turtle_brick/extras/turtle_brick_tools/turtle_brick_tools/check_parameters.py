# SPDX-License-Identifier: Apache-2.0

"""
Check a parameter file, by default config/turtle.yaml, before any node reads it.

    python3 -m turtle_brick_tools.check_parameters [FILE]

In addition to the ranges of all parameters, this program checks that no name appears twice, and
the notation of numbers, which rclpy and PyYAML do not read alike.
"""

from math import isfinite
from pathlib import Path
import sys
from typing import Any

from turtle_brick.core.parameters import (default_path, ParameterError, Parameters,
                                          read_values)
import yaml


def check_names(node: yaml.Node) -> None:
    """Raise ParameterError if a key appears twice in a mapping of a composed YAML document."""
    names = []
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        if key.value in names:
            raise ParameterError(f'{key.value} appears again in line {key.start_mark.line + 1}. '
                                 'Remove one of the two lines.')
        names.append(key.value)
        check_names(value)


def check_notation(name: str, value: Any) -> None:
    """Raise ParameterError if a value is a number in quotes or a list of mixed types."""
    if isinstance(value, str):
        try:
            number = float(value)
        except ValueError:
            return
        if isfinite(number):
            raise ParameterError(
                f'{name} is {value}, which YAML reads as text. Write {number!r} without quotes.')
    if isinstance(value, list) and set(map(type, value)) == {int, float}:
        raise ParameterError(f'{name} is {value!s:.80}, but ROS does not allow lists that mix '
                             'integers and floats. Write all numbers with a decimal point.')


def main() -> int:
    """Check the parameter file named on the command line, and return the exit status."""
    path = Path(sys.argv[1]) if sys.argv[1:] else default_path()
    try:
        values = read_values(path)
        check_names(yaml.compose(path.read_text(encoding='utf-8'), yaml.SafeLoader))
        for name, value in values.items():
            check_notation(name, value)
        Parameters.from_mapping(values)
    except ParameterError as error:
        print(f'turtle_brick: {path}: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
