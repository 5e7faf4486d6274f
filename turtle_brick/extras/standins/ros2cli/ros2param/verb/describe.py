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
