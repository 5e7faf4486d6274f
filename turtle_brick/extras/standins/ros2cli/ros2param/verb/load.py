# SPDX-License-Identifier: Apache-2.0
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
