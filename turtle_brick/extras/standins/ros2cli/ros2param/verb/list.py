# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 param list`."""

from __future__ import annotations

import argparse
import re

from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension
from ros2node.api import complete_node_name
from ros2param.api import call_parameter_service, matching_nodes, TYPE_NAMES


class ListVerb(VerbExtension):
    """Prints the names of parameters."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        node_name = parser.add_argument('node_name', nargs='?', help='Name of the ROS node')
        complete_with(node_name, complete_node_name)
        parser.add_argument(
            '--filter', default='',
            help='Only parameters matching the regex expression will be showed. Supports `re` '
            'regex syntax.')
        parser.add_argument(
            '--include-hidden-nodes', action='store_true',
            help='Consider hidden nodes as well')
        parser.add_argument(
            '--param-prefixes', nargs='+', default=[],
            help='Only list parameters with the provided prefixes')
        parser.add_argument(
            '--param-type', action='store_true',
            help='Print parameter types with parameter names')

    def main(self, *, args: argparse.Namespace) -> Status:
        def find(graph: direct.GraphNode) -> list[str]:
            return matching_nodes(graph, args.node_name, args.include_hidden_nodes)

        with direct.open_graph(find) as graph:
            nodes = find(graph)
            if args.node_name and not nodes:
                return 'Node not found'
            for node in nodes:
                try:
                    self._print_parameters(graph, node, args)
                except RuntimeError as error:
                    print(error)
        return None

    def _print_parameters(self, graph: direct.GraphNode, node: str,
                          args: argparse.Namespace) -> None:
        names = call_parameter_service(
            graph, node, 'list_parameters', prefixes=args.param_prefixes).result.names
        names = sorted(filter(re.compile(args.filter).match, names))
        if names and not args.node_name:
            print(f'{node}:')
        if not args.param_type:
            for name in names:
                print(f'  {name}')
            return
        descriptors = call_parameter_service(
            graph, node, 'describe_parameters', names=names).descriptors
        for name, descriptor in zip(names, descriptors):
            print(f'  {name} (type: {TYPE_NAMES[descriptor.type]})')
