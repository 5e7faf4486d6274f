# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 pkg prefix`."""

from __future__ import annotations

import argparse

import ament_index_python as index
from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2pkg.api import complete_package_name


class PrefixVerb(VerbExtension):
    """Prints the directory in which a package is installed."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        package_name = parser.add_argument('package_name', help='The package name')
        complete_with(package_name, complete_package_name)
        parser.add_argument(
            '--share', action='store_true',
            help='Show share directory for the package')

    def main(self, *, args: argparse.Namespace) -> Status:
        find = index.get_package_share_directory if args.share else index.get_package_prefix
        try:
            print(find(args.package_name))
        except (index.PackageNotFoundError, ValueError):
            return 'Package not found'
        return None
