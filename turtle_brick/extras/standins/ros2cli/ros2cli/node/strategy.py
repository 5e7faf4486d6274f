# SPDX-License-Identifier: Apache-2.0
"""The arguments of verbs that the real `ros2` runs with or without its daemon."""

import argparse

from ros2cli.node import direct


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of verbs that join the graph, and the option --no-daemon."""
    direct.add_arguments(parser)
    parser.add_argument('--no-daemon', action='store_true',
                        help='Do not spawn nor use an already running daemon')
