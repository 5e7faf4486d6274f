# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 param describe`."""

from __future__ import annotations

import argparse

from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2param.api import (
    add_node_arguments, complete_parameter_name, parameter_services, TYPE_NAMES)


class DescribeVerb(VerbExtension):
    """Prints the types, descriptions and limits of parameters."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_node_arguments(parser)
        parameter_names = parser.add_argument(
            'parameter_names', nargs='+', help='Names of the parameters')
        complete_with(parameter_names, complete_parameter_name)

    def main(self, *, args: argparse.Namespace) -> None:
        with parameter_services(args) as call:
            descriptors = call('describe_parameters', names=args.parameter_names).descriptors
        for descriptor in descriptors:
            print(f'Parameter name: {descriptor.name}')
            print(f'  Type: {TYPE_NAMES[descriptor.type]}')
            if descriptor.description:
                print(f'  Description: {descriptor.description}')
            print('  Constraints:')
            if descriptor.read_only:
                print('    Read only: true')
            for limits in [*descriptor.floating_point_range, *descriptor.integer_range][:1]:
                print(f'    Min value: {limits.from_value}')
                print(f'    Max value: {limits.to_value}')
                if limits.step:
                    print(f'    Step: {limits.step}')
            if descriptor.additional_constraints:
                print(f'    Additional constraints: {descriptor.additional_constraints}')
