# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 pkg executables`."""

from __future__ import annotations

import argparse
import os

import ament_index_python as index
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2pkg.api import complete_package_name, get_executable_paths


class ExecutablesVerb(VerbExtension):
    """Prints the names of the executables in packages."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        package_name = parser.add_argument('package_name', nargs='?', help='The package name')
        complete_with(package_name, complete_package_name)
        parser.add_argument(
            '--full-path', action='store_true',
            help='Show full path of each executable')

    def main(self, *, args: argparse.Namespace) -> None:
        packages = ([args.package_name] if args.package_name is not None
                    else sorted(index.get_packages_with_prefixes()))
        for package in packages:
            for path in get_executable_paths(package):
                print(path if args.full_path else f'{package} {os.path.basename(path)}')
