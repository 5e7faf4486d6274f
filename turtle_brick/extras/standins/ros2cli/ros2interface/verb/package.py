# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 interface package`."""

from __future__ import annotations

import argparse

import ament_index_python as index
from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2interface.api import add_kind_arguments, get_interfaces, requested_kinds
from ros2pkg.api import complete_package_name


class PackageVerb(VerbExtension):
    """Prints the names of the interfaces in a package."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_kind_arguments(parser)
        package_name = parser.add_argument(
            'package_name',
            help="Name of the ROS package (e.g. 'example_interfaces')")
        complete_with(package_name, complete_package_name)

    def main(self, *, args: argparse.Namespace) -> Status:
        if not index.has_resource('packages', args.package_name):
            return f"Unknown package '{args.package_name}'"
        for kind in requested_kinds(args).values():
            for name in get_interfaces(args.package_name, kind):
                print(name)
        return None
