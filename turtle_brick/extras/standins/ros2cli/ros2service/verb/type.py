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
"""The verb `ros2 service type`."""

from __future__ import annotations

import argparse

from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.node import direct
from ros2cli.verb import VerbExtension
from ros2service.api import complete_service_name


class TypeVerb(VerbExtension):
    """Prints the type of a service."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        service_name = parser.add_argument(
            'service_name',
            help="Name of the ROS service to get type (e.g. '/talker/list_parameters')")
        complete_with(service_name, complete_service_name)

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.service_name
        with direct.open_graph(lambda graph: graph.service_types().get(name)) as graph:
            types = graph.service_types(args.hidden).get(name, [])
        for service_type in types:
            print(service_type)
        return 0 if types else 1
