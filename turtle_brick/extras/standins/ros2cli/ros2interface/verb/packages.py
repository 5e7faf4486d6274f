# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 interface packages`."""

from __future__ import annotations

import argparse

import ament_index_python as index
from ros2cli.verb import VerbExtension
from ros2interface.api import get_interfaces, requested_kinds


class PackagesVerb(VerbExtension):
    """Prints the names of the packages with interfaces."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            '-m', '--only-msgs', action='store_true',
            help='Only list packages that generate messages')
        parser.add_argument(
            '-s', '--only-srvs', action='store_true',
            help='Only list packages that generate services')
        parser.add_argument(
            '-a', '--only-actions', action='store_true',
            help='Only list packages that generate actions')

    def main(self, *, args: argparse.Namespace) -> None:
        for package in sorted(index.get_resources('rosidl_interfaces')):
            if any(get_interfaces(package, kind) for kind in requested_kinds(args).values()):
                print(package)
