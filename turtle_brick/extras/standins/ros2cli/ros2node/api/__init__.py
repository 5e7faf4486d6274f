# SPDX-License-Identifier: Apache-2.0
"""Functions that several commands use."""

import argparse

from ros2cli.node import direct


def complete_node_name(prefix: str, parsed_args: argparse.Namespace,
                       **kwargs: object) -> list[str]:
    """Return the names of all nodes."""
    with direct.open_graph() as graph:
        return graph.node_names()
