# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 param get`."""

from __future__ import annotations

import argparse

from rclpy.parameter import parameter_value_to_python
from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2param.api import (
    add_node_arguments, complete_parameter_name, parameter_services, TYPE_NAMES)


class GetVerb(VerbExtension):
    """Prints the value of a parameter."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_node_arguments(parser)
        parameter_name = parser.add_argument('parameter_name', help='Name of the parameter')
        complete_with(parameter_name, complete_parameter_name)
        parser.add_argument('--hide-type', action='store_true', help='Hide the type information')

    def main(self, *, args: argparse.Namespace) -> Status:
        with parameter_services(args) as call:
            values = call('get_parameters', names=[args.parameter_name]).values
        if not values:
            return 'Parameter not set'
        value = parameter_value_to_python(values[0])
        type_name, _, array = TYPE_NAMES[values[0].type].capitalize().partition(' ')
        if args.hide_type:
            print(value)
        elif value is None:
            print('Parameter not set.')
        else:
            print(f'{type_name} {"values are" if array else "value is"}: {value}')
        return None
