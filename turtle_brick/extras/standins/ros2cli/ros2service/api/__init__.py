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
"""Functions that several verbs of `ros2 service` use."""

import argparse

from ros2cli.node import direct


def complete_service_name(prefix: str, parsed_args: argparse.Namespace,
                          **kwargs: object) -> list[str]:
    """Return the names of all services."""
    with direct.open_graph() as graph:
        return list(graph.service_types(hidden=False))


def complete_service_type(prefix: str, parsed_args: argparse.Namespace,
                          **kwargs: object) -> list[str]:
    """Return the types of the service on the command line."""
    name = parsed_args.service_name
    with direct.open_graph(lambda graph: graph.service_types().get(name)) as graph:
        return graph.service_types().get(name, [])
