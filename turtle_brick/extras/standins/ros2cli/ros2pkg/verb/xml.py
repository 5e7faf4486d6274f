# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 pkg xml`."""

# flake8: noqa: A005 -- the real package has this name too

from __future__ import annotations

import argparse
from pathlib import Path
from xml.etree import ElementTree

import ament_index_python as index
from ros2cli.command import Status
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2pkg.api import complete_package_name


class XmlVerb(VerbExtension):
    """Prints the file package.xml of a package."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        package_name = parser.add_argument('package_name', help='The package name')
        complete_with(package_name, complete_package_name)
        parser.add_argument('-t', '--tag', help="The XML tag to output (e.g. 'version')")

    def main(self, *, args: argparse.Namespace) -> Status:
        try:
            path = Path(index.get_package_share_directory(args.package_name), 'package.xml')
        except (index.PackageNotFoundError, ValueError):
            return 'Package not found'
        tree = ElementTree.parse(path)
        if args.tag is None:
            ElementTree.dump(tree)
            return None
        elements = tree.getroot().findall(args.tag)
        for element in elements:
            print(element.text)
        return None if elements else 'XML tag not found'
