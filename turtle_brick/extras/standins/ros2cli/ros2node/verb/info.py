# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 node info`."""

from __future__ import annotations

import argparse
from functools import partial

from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension
from ros2node.api import complete_node_name


class InfoVerb(VerbExtension):
    """Prints the topics, services and actions of a node."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        node_name = parser.add_argument('node_name', help='Node name to request information')
        complete_with(node_name, complete_node_name)
        parser.add_argument(
            '--include-hidden', action='store_true',
            help='Display hidden topics, services, and actions as well')

    def main(self, *, args: argparse.Namespace) -> Status:
        # The import of rclpy.action is slow.
        from rclpy.action import (get_action_client_names_and_types_by_node,
                                  get_action_server_names_and_types_by_node)

        name = args.node_name

        def exists(graph: direct.GraphNode) -> bool:
            return name in graph.node_names(args.include_hidden)

        with direct.open_graph(exists) as graph:
            if not exists(graph):
                return f"Unable to find node '{name}'"
            print(name)
            for heading, get_names_and_types in (
                    ('Subscribers', graph.get_subscriber_names_and_types_by_node),
                    ('Publishers', graph.get_publisher_names_and_types_by_node),
                    ('Service Servers', graph.get_service_names_and_types_by_node),
                    ('Service Clients', graph.get_client_names_and_types_by_node),
                    ('Action Servers', partial(get_action_server_names_and_types_by_node, graph)),
                    ('Action Clients', partial(get_action_client_names_and_types_by_node, graph))):
                print(f'  {heading}:')
                namespace, _, own_name = name.rpartition('/')
                entities = direct.visible(get_names_and_types(own_name, namespace or '/'),
                                          args.include_hidden)
                print(*(f'    {entity}: {", ".join(types)}'
                        for entity, types in entities.items()), sep='\n')
        return None
