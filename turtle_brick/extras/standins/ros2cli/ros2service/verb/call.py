# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 service call`."""

from __future__ import annotations

import argparse

from ros2cli.command import Status
from ros2cli.helpers import complete_with, positive_float
from ros2cli.messages import get_interface, make_message, read_values
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2service.api import complete_service_name, complete_service_type


class CallVerb(VerbExtension):
    """Calls a service and prints the response."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        service_name = parser.add_argument(
            'service_name',
            help="Name of the ROS service to call to (e.g. '/add_two_ints')")
        complete_with(service_name, complete_service_name)
        service_type = parser.add_argument(
            'service_type',
            help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')")
        complete_with(service_type, complete_service_type)
        group = parser.add_mutually_exclusive_group()
        group.add_argument(
            'values', nargs='?', default='{}',
            help="Values to fill the service request with in YAML format (e.g. '{a: 1, b: 2}'), "
            'otherwise the service request will be published with default values')
        group.add_argument('--stdin', action='store_true', help='Read values from standard input')
        parser.add_argument(
            '-r', '--rate', metavar='N', type=positive_float,
            help='Repeat the call at a specific rate in Hz')

    def main(self, *, args: argparse.Namespace) -> Status:
        service_class = get_interface(
            args.service_type, 'srv', 'The passed service type is invalid')
        if not hasattr(service_class, 'Request'):
            return 'The passed type is not a service'
        request = make_message(service_class.Request, read_values(args))
        with direct.open_graph(lambda graph: True) as graph:
            client = graph.create_client(service_class, args.service_name)
            if not graph.spin_until(client.service_is_ready, 1.0):
                print('waiting for service to become available...')
            graph.spin_until(client.service_is_ready)
            while True:
                print(f'requester: making request: {request!r}\n')
                print(f'response:\n{graph.result(client.call_async(request))!r}\n')
                if args.rate is None:
                    return None
                graph.spin_until(lambda: False, 1.0 / args.rate)
