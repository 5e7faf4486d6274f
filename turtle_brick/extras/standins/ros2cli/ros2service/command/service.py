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
