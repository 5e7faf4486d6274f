# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
