# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic hz`."""

from __future__ import annotations

import argparse
from itertools import pairwise
import statistics

from ros2cli.helpers import complete_with, Unsupported
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2topic.api import complete_topic_name
from ros2topic.api.measure import measure, Samples, spread


class HzVerb(VerbExtension):
    """Prints the rate of the messages on a topic."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        topic_name = parser.add_argument(
            'topic_name',
            help="Name of the ROS topic to listen to (e.g. '/chatter')")
        complete_with(topic_name, complete_topic_name)
        parser.add_argument(
            '--window', '-w', dest='window_size', metavar='WINDOW', type=int, default=10000,
            help='window size, in # of messages, for calculating rate (default: 10000)')
        parser.add_argument(
            '--filter', dest='filter_expr', metavar='EXPR',
            help='only measure messages matching the specified Python expression')
        parser.add_argument(
            '--wall-time', action=Unsupported, nargs=0,
            help='calculates rate using wall time which can be helpful when clock is not '
            'published during simulation')
        direct.add_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> None:
        measure(args, lambda message: None, report)


def report(samples: Samples, now: float, is_new: bool) -> str:
    """Return a line with the average message rate, or '' if there are no new messages."""
    if not is_new:
        return ''
    periods = [end - start for (start, _), (end, _) in pairwise(samples)]
    return f'average rate: {1 / statistics.fmean(periods):.3f}{spread(periods)}'
