# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 interface proto`."""

from __future__ import annotations

import argparse

from ros2cli.helpers import complete_with
from ros2cli.messages import get_interface, to_yaml
from ros2cli.verb import VerbExtension
from ros2interface.api import complete_interface
import yaml


class ProtoVerb(VerbExtension):
    """Prints the default values of a message, a service request or an action goal."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        interface_type = parser.add_argument(
            'type',
            help="Show an interface definition (e.g. 'example_interfaces/msg/String')")
        complete_with(interface_type, complete_interface)
        parser.add_argument(
            '--no-quotes', action='store_true',
            help='if true output has no outer quotes.')

    def main(self, *, args: argparse.Namespace) -> None:
        interface_class = get_interface(args.type, '', f"The interface '{args.type}' is invalid")
        message_class = getattr(
            interface_class, 'Request', getattr(interface_class, 'Goal', interface_class))
        text = yaml.dump(to_yaml(message_class()))
        print(text if args.no_quotes else f'"{text}"')
