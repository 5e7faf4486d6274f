# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 service list`."""

from __future__ import annotations

import argparse

from ros2cli.helpers import print_names
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension


class ListVerb(VerbExtension):
    """Prints the names of the services."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        parser.add_argument(
            '-t', '--show-types', action='store_true',
            help='Additionally show the service type')
        parser.add_argument(
            '-c', '--count-services', dest='count', action='store_true',
            help='Only display the number of services discovered')
        parser.add_argument(
            '--include-hidden-services', dest='hidden', action='store_true',
            help='Consider hidden services as well')

    def main(self, *, args: argparse.Namespace) -> None:
        with direct.open_graph() as graph:
            services = graph.service_types(args.hidden)
        print_names(services, args.count, args.show_types)
