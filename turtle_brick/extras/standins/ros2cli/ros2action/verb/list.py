# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 action list`."""

from __future__ import annotations

import argparse

from ros2action.api import action_types
from ros2cli.helpers import print_names
from ros2cli.node import direct
from ros2cli.verb import VerbExtension


class ListVerb(VerbExtension):
    """Prints the names of the actions."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            '-t', '--show-types', action='store_true',
            help='Additionally show the action type')
        parser.add_argument(
            '-c', '--count-actions', dest='count', action='store_true',
            help='Only display the number of actions')

    def main(self, *, args: argparse.Namespace) -> None:
        with direct.open_graph() as graph:
            actions = action_types(graph)
        print_names(actions, args.count, args.show_types)
