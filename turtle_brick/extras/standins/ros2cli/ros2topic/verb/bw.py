# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic bw`."""

from __future__ import annotations

import argparse
import statistics

from ros2cli.helpers import complete_with
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2topic.api import complete_topic_name
from ros2topic.api.measure import measure, Samples


class BwVerb(VerbExtension):
    """Prints the data rate of a topic and the sizes of its messages."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        topic_name = parser.add_argument(
            'topic_name', metavar='topic',
            help='Topic name to monitor for bandwidth utilization')
        complete_with(topic_name, complete_topic_name)
        parser.add_argument(
            '--window', '-w', dest='window_size', metavar='WINDOW', type=int, default=100,
            help='maximum window size, in # of messages, for calculating rate (default: 100)')
        direct.add_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> None:
        measure(args, len, lambda samples, now, is_new: report(samples[-args.window_size:], now),
                raw=True)


def report(samples: Samples, now: float) -> str:
    """Return a report on the data rate and the sizes of the latest messages."""
    times, sizes = zip(*samples)
    bandwidth = sum(sizes) / (now - times[0])
    if bandwidth < 1e3:
        unit, text = 1.0, '{:.0f} B'
    elif bandwidth < 1e6:
        unit, text = 1e3, '{:.2f} KB'
    else:
        unit, text = 1e6, '{:.2f} MB'
    rate, mean, least, most = (text.format(value / unit) for value in (
        bandwidth, statistics.fmean(sizes), min(sizes), max(sizes)))
    return (f'{rate}/s from {len(sizes)} messages\n'
            f'\tMessage size mean: {mean} min: {least} max: {most}')
