# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic delay`."""

from __future__ import annotations

import argparse
import statistics
from typing import Any

from rclpy.time import Time
from ros2cli.helpers import complete_with
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2topic.api import complete_topic_name
from ros2topic.api.measure import measure, Samples, spread


class DelayVerb(VerbExtension):
    """Prints the delay from the timestamps of messages to their reception."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        topic_name = parser.add_argument(
            'topic_name', metavar='topic',
            help='Topic name to calculate the delay for')
        complete_with(topic_name, complete_topic_name)
        parser.add_argument(
            '--window', '-w', dest='window_size', type=int, default=10000,
            help='window size, in # of messages, for calculating rate, string to (default: 10000)')
        direct.add_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> None:
        measure(args, header_stamp, report)


def header_stamp(message: Any) -> float:
    """Return the timestamp (s) in the header of a message."""
    if not hasattr(message, 'header'):
        raise RuntimeError('msg does not have header')
    return Time.from_msg(message.header.stamp).nanoseconds * 1e-9


def report(samples: Samples, now: float, is_new: bool) -> str:
    """Return a line with the average delay from the timestamp of a message to its reception."""
    if not is_new:
        return 'no new messages'
    delays = [time - stamp for time, stamp in samples][1:]
    return f'average delay: {statistics.fmean(delays):.3f}{spread(delays)}'
