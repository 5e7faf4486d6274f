# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 action send_goal`."""

from __future__ import annotations

import argparse
from typing import Any

from rclpy.action import ActionClient
from ros2action.api import complete_action_name, complete_action_type
from ros2cli.helpers import complete_with, Unsupported
from ros2cli.messages import get_interface, make_message, read_values, to_yaml
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
import yaml

GOAL_STATES = ('UNKNOWN', 'ACCEPTED', 'EXECUTING', 'CANCELING', 'SUCCEEDED', 'CANCELED', 'ABORTED')
"""Names of goal states, indexed by the constants in action_msgs/msg/GoalStatus."""


class SendGoalVerb(VerbExtension):
    """Sends a goal to an action server and prints the result."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        action_name = parser.add_argument(
            'action_name', help="Name of the ROS action (e.g. '/fibonacci')")
        complete_with(action_name, complete_action_name)
        action_type = parser.add_argument(
            'action_type',
            help="Type of the ROS action (e.g. 'example_interfaces/action/Fibonacci')")
        complete_with(action_type, complete_action_type)
        group = parser.add_mutually_exclusive_group()
        group.add_argument(
            'values', metavar='goal', nargs='?', default='{}',
            help="Goal request values in YAML format (e.g. '{order: 10}')")
        group.add_argument('--stdin', action='store_true', help='Read goal from standard input')
        parser.add_argument(
            '-f', '--feedback', action='store_true',
            help='Echo feedback messages for the goal')
        parser.add_argument(
            '-t', '--timeout', action=Unsupported,
            help='Wait for N seconds until server becomes available and goal is completed '
            '(default waits indefinitely)')

    def main(self, *, args: argparse.Namespace) -> None:
        action_class = get_interface(
            args.action_type, 'action', 'The passed action type is invalid')
        goal = make_message(action_class.Goal, read_values(args))
        with direct.open_graph(lambda graph: True) as graph:
            client = ActionClient(graph, action_class, args.action_name)
            print('Waiting for an action server to become available...')
            graph.spin_until(client.server_is_ready)
            print(f'Sending goal:\n     {yaml.dump(to_yaml(goal))}')
            handle = graph.result(client.send_goal_async(
                goal, self._print_feedback if args.feedback else None))
            if not handle.accepted:
                print('Goal was rejected.')
                return
            print(f'Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n')
            try:
                response = graph.result(handle.get_result_async())
            except KeyboardInterrupt:
                print('Canceling goal...')
                graph.result(handle.cancel_goal_async())
                print('Goal canceled.')
                raise
            print(f'Result:\n    {yaml.dump(to_yaml(response.result))}')
            print('Goal finished with status:', GOAL_STATES[response.status])

    def _print_feedback(self, message: Any) -> None:
        print(f'Feedback:\n    {yaml.dump(to_yaml(message.feedback))}')
