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
"""The verb `ros2 param dump`."""

from __future__ import annotations

import argparse
from typing import Any

from rclpy.parameter import parameter_value_to_python
from ros2cli.verb import VerbExtension
from ros2param.api import add_node_arguments, parameter_services
import yaml


class DumpVerb(VerbExtension):
    """Prints all parameters of a node in the format of a parameter file."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_node_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> None:
        tree: dict[str, Any] = {}
        with parameter_services(args) as call:
            names = sorted(call('list_parameters').result.names)
            for name, value in zip(names, call('get_parameters', names=names).values):
                *groups, own_name = name.split('.')
                inner = tree
                for group in groups:
                    inner = inner.setdefault(group, {})
                inner[own_name] = parameter_value_to_python(value)
        print(yaml.dump({f'/{args.node_name.lstrip("/")}': {'ros__parameters': tree}}))
