# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 action type`."""

from __future__ import annotations

import argparse

from ros2action.api import action_types, complete_action_name
from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct
from ros2cli.verb import VerbExtension


class TypeVerb(VerbExtension):
    """Prints the type of an action."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        action_name = parser.add_argument(
            'action_name',
            help="Name of the ROS action to get info (e.g. '/fibonacci')")
        complete_with(action_name, complete_action_name)

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.action_name
        with direct.open_graph(lambda graph: action_types(graph).get(name)) as graph:
            types = action_types(graph).get(name, [])
        for action_type in types:
            print(action_type)
        return 0 if types else 1
