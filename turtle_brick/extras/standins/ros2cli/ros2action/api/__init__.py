# SPDX-License-Identifier: Apache-2.0
"""Functions that several verbs of `ros2 action` use."""

from __future__ import annotations

import argparse

from rclpy.action import get_action_names_and_types
from ros2cli.node import direct


def action_types(graph: direct.GraphNode) -> dict[str, list[str]]:
    """Return the types of all actions, keyed by name."""
    return dict(get_action_names_and_types(graph))


def complete_action_name(prefix: str, parsed_args: argparse.Namespace,
                         **kwargs: object) -> list[str]:
    """Return the names of all actions."""
    with direct.open_graph() as graph:
        return list(action_types(graph))


def complete_action_type(prefix: str, parsed_args: argparse.Namespace,
                         **kwargs: object) -> list[str]:
    """Return the types of the action on the command line."""
    name = parsed_args.action_name
    with direct.open_graph(lambda graph: action_types(graph).get(name)) as graph:
        return action_types(graph).get(name, [])
