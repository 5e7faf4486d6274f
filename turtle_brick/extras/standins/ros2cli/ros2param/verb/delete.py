# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 param delete`."""

from __future__ import annotations

import argparse

from rcl_interfaces.msg import Parameter
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2param.api import add_node_arguments, complete_parameter_name, set_parameters


class DeleteVerb(VerbExtension):
    """Deletes a parameter."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_node_arguments(parser)
        parameter_name = parser.add_argument('parameter_name', help='Name of the parameter')
        complete_with(parameter_name, complete_parameter_name)

    def main(self, *, args: argparse.Namespace) -> None:
        set_parameters(args, [Parameter(name=args.parameter_name)],
                       'Deleted parameter successfully', 'Deleting parameter failed')
