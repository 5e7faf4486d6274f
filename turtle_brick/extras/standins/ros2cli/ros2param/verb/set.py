# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 param set`."""

from __future__ import annotations

import argparse

from rcl_interfaces.msg import Parameter
from rclpy.parameter import get_parameter_value
from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2param.api import add_node_arguments, complete_parameter_name, set_parameters


class SetVerb(VerbExtension):
    """Sets a parameter."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_node_arguments(parser)
        parameter_name = parser.add_argument('parameter_name', help='Name of the parameter')
        complete_with(parameter_name, complete_parameter_name)
        parser.add_argument('value', help='Value of the parameter')

    def main(self, *, args: argparse.Namespace) -> Status:
        value = get_parameter_value(string_value=args.value)
        if not isinstance(value.string_value, str):  # in YAML, it is a mapping or a date
            return (f'{args.value} is not a bool, a number, text or a list of these in YAML. '
                    f'For text, add quotes: "\'{args.value}\'"')
        set_parameters(args, [Parameter(name=args.parameter_name, value=value)],
                       'Set parameter successful', 'Setting parameter failed')
        return None
