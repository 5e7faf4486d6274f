# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 node list`."""

from __future__ import annotations

import argparse
import sys

from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension


class ListVerb(VerbExtension):
    """Prints the names of the nodes."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        parser.add_argument(
            '-a', '--all', action='store_true',
            help='Display all nodes even hidden ones')
        parser.add_argument(
            '-c', '--count-nodes', action='store_true',
            help='Only display the number of nodes discovered')

    def main(self, *, args: argparse.Namespace) -> None:
        with direct.open_graph() as graph:
            names = graph.node_names(args.all)
        if args.count_nodes:
            print(len(names))
            return
        if len(set(names)) < len(names):
            print('WARNING: Be aware that there are nodes in the graph that share an exact name, '
                  'which can have unintended side effects.', file=sys.stderr)
        for name in names:
            print(name)
