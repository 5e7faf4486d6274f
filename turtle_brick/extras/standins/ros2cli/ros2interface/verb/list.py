# SPDX-License-Identifier: Apache-2.0
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
