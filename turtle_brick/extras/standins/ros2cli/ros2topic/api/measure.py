# SPDX-License-Identifier: Apache-2.0
"""The measurement of a topic, on which `ros2 topic` reports once per second."""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Callable, Sequence
import statistics
from typing import Any

from rclpy.qos import qos_profile_sensor_data
from ros2cli.node import direct
from ros2topic.api import get_topic_class, make_filter

Samples = Sequence[tuple[float, Any]]
"""Reception time (s) and measured value of each message."""

REPORT_PERIOD = 1.0
"""Time (s) between two reports."""


def measure(args: argparse.Namespace, sample: Callable[[Any], Any],
            report: Callable[[Samples, float, bool], str], raw: bool = False) -> None:
    """
    Print a report on the latest messages once per second.

    :param sample: function that returns the measured value of a message
    :param report: function that returns a report on samples at a time (s); the last argument is
        whether there is a new message since the last report
    :param raw: whether messages are received as bytes
    """
    passes = make_filter(getattr(args, 'filter_expr', None))
    samples: deque[tuple[float, Any]] = deque(maxlen=args.window_size + 1)
    reported: tuple[float, Any] | None = None
    with direct.open_graph(lambda graph: graph.count_publishers(args.topic_name)) as graph:
        def now() -> float:
            return graph.get_clock().now().nanoseconds * 1e-9

        def on_message(message: Any) -> None:
            if passes(message):
                samples.append((now(), sample(message)))

        def on_timer() -> None:
            nonlocal reported
            if len(samples) > 1:
                text = report(list(samples), now(), samples[-1] is not reported)
                if text:
                    print(text)
                reported = samples[-1]

        if not get_topic_class(graph, args.topic_name):
            print(f'WARNING: topic [{args.topic_name}] does not appear to be published yet')
        graph.spin_until(lambda: get_topic_class(graph, args.topic_name))
        graph.create_subscription(get_topic_class(graph, args.topic_name), args.topic_name,
                                  on_message, qos_profile_sensor_data, raw=raw)
        if raw:
            print(f'Subscribed to [{args.topic_name}]')
        graph.create_timer(REPORT_PERIOD, on_timer)
        graph.spin_until(lambda: False)


def spread(durations: Sequence[float]) -> str:
    """Return a line with the minimum, maximum and standard deviation of durations (s)."""
    return (f'\n\tmin: {min(durations):.3f}s max: {max(durations):.3f}s '
            f'std dev: {statistics.pstdev(durations):.5f}s window: {len(durations)}')
