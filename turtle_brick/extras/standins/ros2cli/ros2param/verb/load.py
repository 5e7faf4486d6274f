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
"""The verb `ros2 param load`."""

from __future__ import annotations

import argparse

from rclpy.parameter import parameter_dict_from_yaml_file
from ros2cli.verb import VerbExtension
from ros2param.api import add_node_arguments, set_parameters


class LoadVerb(VerbExtension):
    """Sets the parameters in a file."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_node_arguments(parser)
        parser.add_argument('parameter_file', help='Parameter file')
        parser.add_argument(
            '--no-use-wildcard', action='store_true',
            help="Do not load parameters in the '/**' namespace into the node")

    def main(self, *, args: argparse.Namespace) -> None:
        parameters = parameter_dict_from_yaml_file(args.parameter_file, not args.no_use_wildcard)
        set_parameters(args, list(parameters.values()), 'Set parameter {} successful',
                       'Set parameter {} failed')
