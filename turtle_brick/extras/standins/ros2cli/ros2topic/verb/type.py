# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic type`."""

from __future__ import annotations

import argparse

from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension
from ros2topic.api import complete_topic_name


class TypeVerb(VerbExtension):
    """Prints the type of a topic."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        topic_name = parser.add_argument(
            'topic_name',
            help="Name of the ROS topic to get type (e.g. '/chatter')")
        complete_with(topic_name, complete_topic_name)

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.topic_name
        with direct.open_graph(lambda graph: graph.topic_types().get(name)) as graph:
            types = graph.topic_types(args.hidden).get(name, [])
        for topic_type in types:
            print(topic_type)
        return 0 if types else 1
