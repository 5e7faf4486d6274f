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
"""The verb `ros2 interface list`."""

from __future__ import annotations

import argparse

import ament_index_python as index
from ros2cli.verb import VerbExtension
from ros2interface.api import add_kind_arguments, get_interfaces, requested_kinds


class ListVerb(VerbExtension):
    """Prints the names of all interfaces."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_kind_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> None:
        for heading, kind in requested_kinds(args).items():
            print(f'{heading}:')
            for package in sorted(index.get_resources('rosidl_interfaces')):
                for name in get_interfaces(package, kind):
                    print(f'    {name}')
