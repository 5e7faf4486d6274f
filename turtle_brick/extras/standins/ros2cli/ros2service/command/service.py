# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 service`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ros2cli.command import CommandWithVerbs


class ServiceCommand(CommandWithVerbs):
    """The command `ros2 service`."""

    verb_package = 'ros2service.verb'
    verbs = {
        'call': 'Call a service',
        'find': 'Output a list of available services of a given type',
        'info': 'Print information about a service',
        'list': 'Output a list of available services',
        'type': "Output a service's type"}

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.add_argument(
            '--include-hidden-services', dest='hidden', action='store_true',
            help='Consider hidden services as well')
        super().add_arguments(parser, cli_name, typed)
