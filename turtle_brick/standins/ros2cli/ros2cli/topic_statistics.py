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
"""The `topic hz`, `topic delay` and `topic bw` verbs, which print statistics about a topic."""

from collections import deque
from functools import partial
from itertools import pairwise
import statistics

from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from ros2cli.graph import open_graph
from ros2cli.messages import message_filter, topic_class


def measure(sample, report, args, **options):
    """Print statistics about a topic's latest messages once per second."""
    passes = message_filter(getattr(args, 'filter_expr', None))
    samples, last = deque(maxlen=args.window_size + 1), None
    with open_graph(lambda graph: topic_class(graph, args.topic_name)) as graph:
        def now():
            return graph.get_clock().now().nanoseconds * 1e-9

        def on_message(message):
            if passes(message):
                samples.append((now(), sample(message)))

        def on_timer():
            nonlocal last
            if len(samples) > 1:
                text = report(samples, args.window_size, now(), samples[-1] is not last)
                print(text, end='\n' if text else '')
                last = samples[-1]

        if not topic_class(graph, args.topic_name):
            print(f'WARNING: topic [{args.topic_name}] does not appear to be published yet')
        graph.spin_until(lambda: topic_class(graph, args.topic_name))
        graph.create_subscription(topic_class(graph, args.topic_name), args.topic_name,
                                  on_message, qos_profile_sensor_data, **options)
        if options:
            print(f'Subscribed to [{args.topic_name}]')
        graph.create_timer(1.0, on_timer)
        graph.spin_until(lambda: False)


def spread(durations):
    """Return a line with the minimum, maximum and standard deviation of durations (s)."""
    return (f'\n\tmin: {min(durations):.3f}s max: {max(durations):.3f}s '
            f'std dev: {statistics.pstdev(durations):.5f}s window: {len(durations)}')


def rate_report(samples, window, now, is_new):
    """Return the average message rate, or an empty string if there are no new messages."""
    if not is_new:
        return ''
    periods = [end - start for (start, _), (end, _) in pairwise(samples)]
    return f'average rate: {1 / statistics.fmean(periods):.3f}{spread(periods)}'


def delay_report(samples, window, now, is_new):
    """Return the average delay between the timestamp and the reception of a message."""
    if not is_new:
        return 'no new messages'
    delays = [time - stamp for time, stamp in samples][1:]
    return f'average delay: {statistics.fmean(delays):.3f}{spread(delays)}'


def bandwidth_report(samples, window, now, is_new):
    """Return the data rate and sizes of the latest messages."""
    times, sizes = zip(*list(samples)[-window:])
    bandwidth = sum(sizes) / (now - times[0])
    if bandwidth < 1e3:
        unit, text = 1, '{:.0f} B'
    elif bandwidth < 1e6:
        unit, text = 1e3, '{:.2f} KB'
    else:
        unit, text = 1e6, '{:.2f} MB'
    bandwidth, mean, least, most = (text.format(each / unit) for each in (
        bandwidth, statistics.fmean(sizes), min(sizes), max(sizes)))
    return (f'{bandwidth}/s from {len(sizes)} messages\n'
            f'\tMessage size mean: {mean} min: {least} max: {most}')


def header_stamp(message):
    """Return the time (s) in the header of a message."""
    if not hasattr(message, 'header'):
        raise RuntimeError('msg does not have header')
    return Time.from_msg(message.header.stamp).nanoseconds * 1e-9


topic_hz = partial(measure, lambda _: None, rate_report)
topic_delay = partial(measure, header_stamp, delay_report)
topic_bw = partial(measure, len, bandwidth_report, raw=True)
