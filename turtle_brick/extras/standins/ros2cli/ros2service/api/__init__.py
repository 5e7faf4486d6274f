# SPDX-License-Identifier: Apache-2.0
"""Functions that several verbs of `ros2 service` use."""

import argparse

from ros2cli.node import direct


def complete_service_name(prefix: str, parsed_args: argparse.Namespace,
                          **kwargs: object) -> list[str]:
    """Return the names of all services."""
    with direct.open_graph() as graph:
        return list(graph.service_types(hidden=False))


def complete_service_type(prefix: str, parsed_args: argparse.Namespace,
                          **kwargs: object) -> list[str]:
    """Return the types of the service on the command line."""
    name = parsed_args.service_name
    with direct.open_graph(lambda graph: graph.service_types().get(name)) as graph:
        return graph.service_types().get(name, [])
