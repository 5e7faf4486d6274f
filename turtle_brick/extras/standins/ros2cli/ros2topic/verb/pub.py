# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic pub`."""

from __future__ import annotations

import argparse
from typing import Any

from rclpy.duration import Duration
from ros2cli.command import Status
from ros2cli.helpers import complete_with, positive_float, Unsupported
from ros2cli.messages import get_interface, make_message, read_values, Stamps
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2topic.api import (
    add_qos_arguments, complete_message_type, complete_topic_name, make_qos_profile)


class PubVerb(VerbExtension):
    """Publishes messages."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        topic_name = parser.add_argument(
            'topic_name',
            help="Name of the ROS topic to publish to (e.g. '/chatter')")
        complete_with(topic_name, complete_topic_name)
        message_type = parser.add_argument(
            'message_type',
            help="Type of the ROS message (e.g. 'std_msgs/String')")
        complete_with(message_type, complete_message_type)
        group = parser.add_mutually_exclusive_group()
        group.add_argument(
            'values', nargs='?', default='{}',
            help="Values to fill the message with in YAML format (e.g. 'data: Hello World'), "
            'otherwise the message will be published with default values')
        group.add_argument('--stdin', action='store_true', help='Read values from standard input')
        parser.add_argument(
            '-r', '--rate', metavar='N', type=positive_float, default=1.0,
            help='Publishing rate in Hz (default: 1)')
        parser.add_argument(
            '-p', '--print', metavar='N', type=int, default=1,
            help='Only print every N-th published message (default: 1)')
        group = parser.add_mutually_exclusive_group()
        group.add_argument(
            '-1', '--once', action='store_true',
            help='Publish one message and exit')
        group.add_argument(
            '-t', '--times', type=int, default=0,
            help='Publish this number of times and then exit')
        parser.add_argument(
            '-w', '--wait-matching-subscriptions', type=int,
            help='Wait until finding the specified number of matching subscriptions. Defaults to '
            '1 when using "-1"/"--once"/"--times", otherwise defaults to 0.')
        parser.add_argument(
            '--max-wait-time-secs', action=Unsupported,
            help='This sets the maximum wait time in seconds if '
            '--wait-until-matching-subscriptions is set. By default, this flag is not set '
            'meaning the subscriber will wait endlessly.')
        parser.add_argument(
            '--keep-alive', metavar='N', type=positive_float, default=0.1,
            help='Keep publishing node alive for N seconds after the last msg (default: 0.1)')
        parser.add_argument('-n', '--node-name', help='Name of the created publishing node')
        add_qos_arguments(parser, 'publish', 'default')
        direct.add_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> Status:
        message_class = get_interface(
            args.message_type, 'msg', 'The passed message type is invalid')
        values = read_values(args)
        if not isinstance(values, dict):
            return 'The passed value needs to be a dictionary in YAML format'
        times = 1 if args.once else args.times
        required = args.wait_matching_subscriptions
        if required is None:
            required = 1 if times > 0 else 0
        with direct.open_graph(name=args.node_name) as graph:
            publisher = graph.create_publisher(
                message_class, args.topic_name, make_qos_profile(args))
            graph.spin_until(lambda: publisher.get_subscription_count() >= graph.count_subscribers(
                args.topic_name), 1.0)
            while publisher.get_subscription_count() < required:
                print(f'Waiting for at least {required} matching subscription(s)...')
                graph.spin_until(lambda: publisher.get_subscription_count() >= required, 1.0)
            self._publish(graph, publisher, message_class, values, times, args)
            publisher.wait_for_all_acked(Duration(seconds=1))  # Subscribers may be slow.
            graph.spin_until(lambda: False, args.keep_alive)
        return None

    def _publish(self, graph: direct.GraphNode, publisher: Any, message_class: Any,
                 values: dict[str, Any], times: int, args: argparse.Namespace) -> None:
        """Publish a message a number of times (0 means without end)."""
        stamps: Stamps = []
        message = make_message(message_class, values, stamps)
        count = 0
        print('publisher: beginning loop')

        def publish() -> None:
            nonlocal count
            for owner, name in stamps:
                setattr(owner, name, graph.get_clock().now().to_msg())
            count += 1
            if args.print and count % args.print == 0:
                print(f'publishing #{count}: {message!r}\n')
            publisher.publish(message)

        publish()
        timer = graph.create_timer(1 / args.rate, publish)
        graph.spin_until(lambda: count == times)
        timer.cancel()
