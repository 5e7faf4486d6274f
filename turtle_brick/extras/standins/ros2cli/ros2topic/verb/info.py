# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic info`."""

from __future__ import annotations

import argparse

from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension
from ros2topic.api import complete_topic_name


class InfoVerb(VerbExtension):
    """Prints the type of a topic and its publishers and subscriptions."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        topic_name = parser.add_argument(
            'topic_name',
            help="Name of the ROS topic to get info (e.g. '/chatter')")
        complete_with(topic_name, complete_topic_name)
        parser.add_argument(
            '--verbose', '-v', action='store_true',
            help='Prints detailed information like the node name, node namespace, topic type, '
            'topic type hash, GUID, and QoS Profile of the publishers and subscribers to '
            'this topic')

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.topic_name
        gap = '\n\n' if args.verbose else '\n'

        def find(graph: direct.GraphNode) -> tuple[int, int] | None:
            if name not in graph.topic_types():
                return None
            return graph.count_publishers(name), graph.count_subscribers(name)

        with direct.open_graph(find) as graph:
            types = graph.topic_types().get(name)
            if types is None:
                return f"Unknown topic '{name}'"
            print('Type:', types[0] if len(types) == 1 else types, end=gap)
            print(f'Publisher count: {graph.count_publishers(name)}', end=gap)
            if args.verbose:
                for info in graph.get_publishers_info_by_topic(name):
                    print(info, end=gap)
            print(f'Subscription count: {graph.count_subscribers(name)}', end=gap)
            if args.verbose:
                for info in graph.get_subscriptions_info_by_topic(name):
                    print(info, end=gap)
        return None
