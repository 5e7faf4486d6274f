# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic find`."""

from __future__ import annotations

import argparse

from ros2cli.helpers import complete_with, print_names
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension
from ros2interface.api import complete_interface


class FindVerb(VerbExtension):
    """Prints the names of the topics of a type."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        interface_type = parser.add_argument(
            'type', metavar='topic_type',
            help="Name of the ROS topic type to filter for (e.g. 'std_msg/msg/String')")
        complete_with(interface_type, complete_interface)
        parser.add_argument(
            '-c', '--count-topics', dest='count', action='store_true',
            help='Only display the number of topics discovered')
        parser.add_argument(
            '--include-hidden-topics', dest='hidden', action='store_true',
            help='Consider hidden topics as well')

    def main(self, *, args: argparse.Namespace) -> None:
        with direct.open_graph() as graph:
            topics = {name: types for name, types in graph.topic_types(args.hidden).items()
                      if args.type in types}
        print_names(topics, args.count)
