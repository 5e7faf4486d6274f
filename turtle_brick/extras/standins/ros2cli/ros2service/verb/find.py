# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 service find`."""

from __future__ import annotations

import argparse

from ros2cli.helpers import complete_with, print_names
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2interface.api import complete_interface


class FindVerb(VerbExtension):
    """Prints the names of the services of a type."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        interface_type = parser.add_argument(
            'type', metavar='service_type',
            help='Name of the ROS service type to filter for (e.g. '
            "'rcl_interfaces/srv/ListParameters')")
        complete_with(interface_type, complete_interface)
        parser.add_argument(
            '-c', '--count-services', dest='count', action='store_true',
            help='Only display the number of services discovered')
        parser.add_argument(
            '--include-hidden-services', dest='hidden', action='store_true',
            help='Consider hidden services as well')

    def main(self, *, args: argparse.Namespace) -> None:
        with direct.open_graph() as graph:
            services = {name: types for name, types in graph.service_types(args.hidden).items()
                        if args.type in types}
        print_names(services, args.count)
