# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 topic echo`."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from ros2cli.command import Status
from ros2cli.helpers import complete_with, positive_float, Unsupported
from ros2cli.messages import get_interface, to_csv, to_yaml
from ros2cli.node import direct, strategy
from ros2cli.verb import VerbExtension
from ros2topic.api import (
    add_qos_arguments, complete_message_type, complete_topic_name, get_topic_class, make_filter,
    make_qos_profile)
import yaml


class EchoVerb(VerbExtension):
    """Prints the messages of a topic."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        strategy.add_arguments(parser)
        topic_name = parser.add_argument(
            'topic_name',
            help="Name of the ROS topic to listen to (e.g. '/chatter')")
        complete_with(topic_name, complete_topic_name)
        message_type = parser.add_argument(
            'message_type', nargs='?',
            help="Type of the ROS message (e.g. 'std_msgs/msg/String')")
        complete_with(message_type, complete_message_type)
        add_qos_arguments(parser, 'subscribe', 'sensor_data')
        parser.add_argument(
            '--csv', action='store_true',
            help='Output all recursive fields separated by commas (e.g. for plotting). If '
            '--include-message-info is also passed, the following fields are prepended: '
            'source_timestamp, received_timestamp, publication_sequence_number, '
            'reception_sequence_number.')
        parser.add_argument(
            '--field',
            help="Echo a selected field of a message. Use '.' to select sub-fields. For example, "
            "to echo the position field of a nav_msgs/msg/Odometry message: 'ros2 topic echo "
            "/odom --field pose.pose.position'")
        parser.add_argument(
            '--full-length', '-f', action='store_true',
            help='Output all elements for arrays, bytes, and string with a length > '
            "'--truncate-length', by default they are truncated after '--truncate-length' "
            "elements with '...''")
        parser.add_argument(
            '--truncate-length', '-l', type=int, default=128,
            help='The length to truncate arrays, bytes, and string to (default: 128)')
        parser.add_argument(
            '--no-arr', action='store_true',
            help="Don't print array fields of messages")
        parser.add_argument(
            '--no-str', action=Unsupported, nargs=0,
            help="Don't print string fields of messages")
        parser.add_argument(
            '--flow-style', action='store_true',
            help='Print collections in the block style (not available with csv format)')
        parser.add_argument(
            '--no-lost-messages', action='store_true',
            help="Don't report when a message is lost")
        parser.add_argument(
            '--raw', action=Unsupported, nargs=0,
            help='Echo the raw binary representation')
        parser.add_argument(
            '--filter', dest='filter_expr',
            help='Python expression to filter messages that are printed. Expression can use '
            'Python builtins as well as m (the message).')
        parser.add_argument(
            '--once', action='store_true',
            help='Print the first message received and then exit.')
        parser.add_argument(
            '--timeout', metavar='N', type=positive_float,
            help='Set a timeout in seconds for waiting')
        parser.add_argument(
            '--include-message-info', '-i', action=Unsupported, nargs=0,
            help='Shows the associated message info.')

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.topic_name
        passes = make_filter(args.filter_expr)
        has_printed = False

        def on_message(message: Any) -> None:
            nonlocal has_printed
            message = self._select_field(message, args.field)
            if passes(message) and not (has_printed and args.once):
                has_printed = True
                self._print(message, args)

        with direct.open_graph(lambda graph: graph.count_publishers(name)) as graph:
            if args.message_type is None:
                message_class = get_topic_class(graph, name)
            else:
                message_class = get_interface(
                    args.message_type, 'msg', 'The passed message type is invalid')
            if message_class is None:
                print(f'WARNING: topic [{name}] does not appear to be published yet')
                return 'Could not determine the type for the passed topic'
            publishers = graph.get_publishers_info_by_topic(name)
            graph.create_subscription(
                message_class, name, on_message, make_qos_profile(args, publishers))
            graph.spin_until(lambda: has_printed and args.once, args.timeout or float('inf'))
        return None

    def _select_field(self, message: Any, field: str | None) -> Any:
        """Return a field of a message such as `pose.position`, or the message."""
        for name in field.split('.') if field else ():
            try:
                message = getattr(message, name)
            except AttributeError as error:
                raise RuntimeError(f"Invalid field '{field}': {error}") from None
        return message

    def _print(self, message: Any, args: argparse.Namespace) -> None:
        """Print a message or a field."""
        if not hasattr(message, 'SLOT_TYPES'):
            print(message, end='\n---\n')
            return
        length = sys.maxsize if args.full_length else args.truncate_length
        fields = to_yaml(message, length, args.no_arr)
        if args.csv:
            print(to_csv(fields))
        else:
            print(yaml.dump(fields, allow_unicode=True, width=sys.maxsize,
                            default_flow_style=args.flow_style), end='---\n')
