# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 action info`."""

from __future__ import annotations

import argparse

from rclpy.action import (get_action_client_names_and_types_by_node,
                          get_action_server_names_and_types_by_node)
from ros2action.api import action_types, complete_action_name
from ros2cli.helpers import complete_with
from ros2cli.node import direct
from ros2cli.verb import VerbExtension


class InfoVerb(VerbExtension):
    """Prints the nodes that provide or use an action."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        action_name = parser.add_argument(
            'action_name',
            help="Name of the ROS action to get info (e.g. '/fibonacci')")
        complete_with(action_name, complete_action_name)
        parser.add_argument(
            '-t', '--show-types', action='store_true',
            help='Additionally show the action type')
        parser.add_argument(
            '-c', '--count', action='store_true',
            help='Only display the number of action clients and action servers')

    def main(self, *, args: argparse.Namespace) -> None:
        name = args.action_name
        print(f'Action: {name}')
        with direct.open_graph(lambda graph: name in action_types(graph)) as graph:
            for heading, get_types in (('clients', get_action_client_names_and_types_by_node),
                                       ('servers', get_action_server_names_and_types_by_node)):
                nodes = [(f'{namespace.rstrip("/")}/{node}', types)
                         for node, namespace in graph.get_node_names_and_namespaces()
                         for action_name, types in get_types(graph, node, namespace)
                         if action_name == name]
                print(f'Action {heading}: {len(nodes)}')
                for node, types in () if args.count else nodes:
                    print(f'    {node} [{", ".join(types)}]' if args.show_types else f'    {node}')
