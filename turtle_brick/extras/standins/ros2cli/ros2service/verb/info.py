# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 service info`."""

from __future__ import annotations

import argparse

from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension
from ros2service.api import complete_service_name


class InfoVerb(VerbExtension):
    """Prints the type of a service and the number of its clients and servers."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        service_name = parser.add_argument(
            'service_name',
            help="Name of the ROS service to get info (e.g. '/add_two_ints')")
        complete_with(service_name, complete_service_name)

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.service_name

        def find(graph: direct.GraphNode) -> tuple[int, int] | None:
            if name not in graph.service_types():
                return None
            return graph.count_clients(name), graph.count_services(name)

        with direct.open_graph(find) as graph:
            types = graph.service_types().get(name)
            if types is None:
                return f"Unknown service '{name}'"
            print('Type:', types[0] if len(types) == 1 else types)
            print('Clients count:', graph.count_clients(name))
            print('Services count:', graph.count_services(name))
        return None
