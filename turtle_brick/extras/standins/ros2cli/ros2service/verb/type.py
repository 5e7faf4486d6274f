# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 service type`."""

from __future__ import annotations

import argparse

from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2service.api import complete_service_name


class TypeVerb(VerbExtension):
    """Prints the type of a service."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        service_name = parser.add_argument(
            'service_name',
            help="Name of the ROS service to get type (e.g. '/talker/list_parameters')")
        complete_with(service_name, complete_service_name)

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.service_name
        with direct.open_graph(lambda graph: graph.service_types().get(name)) as graph:
            types = graph.service_types(args.hidden).get(name, [])
        for service_type in types:
            print(service_type)
        return 0 if types else 1
