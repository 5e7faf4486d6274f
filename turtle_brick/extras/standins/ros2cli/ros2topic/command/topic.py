# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 topic`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ros2cli.command import CommandWithVerbs


class TopicCommand(CommandWithVerbs):
    """The command `ros2 topic`."""

    verb_package = 'ros2topic.verb'
    verbs = {
        'bw': 'Display bandwidth used by topic',
        'delay': 'Display delay of topic from timestamp in header',
        'echo': 'Output messages from a topic',
        'find': 'Output a list of available topics of a given type',
        'hz': 'Print the average publishing rate to screen',
        'info': 'Print information about a topic',
        'list': 'Output a list of available topics',
        'pub': 'Publish a message to a topic',
        'type': "Print a topic's type"}

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.add_argument(
            '--include-hidden-topics', dest='hidden', action='store_true',
            help='Consider hidden topics as well')
        super().add_arguments(parser, cli_name, typed)
