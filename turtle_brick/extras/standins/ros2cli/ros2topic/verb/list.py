# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic list`."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from ros2cli.helpers import print_names
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension


class ListVerb(VerbExtension):
    """Prints the names of the topics."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        parser.add_argument(
            '-t', '--show-types', action='store_true',
            help='Additionally show the topic type')
        parser.add_argument(
            '-c', '--count-topics', dest='count', action='store_true',
            help='Only display the number of topics discovered')
        parser.add_argument(
            '--include-hidden-topics', dest='hidden', action='store_true',
            help='Consider hidden topics as well')
        parser.add_argument(
            '-v', '--verbose', action='store_true',
            help='List full details about each topic')

    def main(self, *, args: argparse.Namespace) -> None:
        with direct.open_graph() as graph:
            topics = graph.topic_types(args.hidden)
            if args.verbose and not args.count:
                self._print_details(topics, 'Published', 'publisher', graph.count_publishers)
                self._print_details(topics, 'Subscribed', 'subscriber', graph.count_subscribers)
                return
        print_names(topics, args.count, args.show_types)

    def _print_details(self, topics: dict[str, list[str]], heading: str, end: str,
                       count_ends: Callable[[str], int]) -> None:
        print(f'{heading} topics:')
        for name, types in topics.items():
            count = count_ends(name)
            if count:
                print(f' * {name} [{", ".join(types)}] {count} {end}{"s" if count > 1 else ""}')
        print()
