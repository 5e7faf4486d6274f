# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 pkg list`."""

from __future__ import annotations

import argparse

import ament_index_python as index
from ros2cli.verb import VerbExtension


class ListVerb(VerbExtension):
    """Prints the names of all packages."""

    def main(self, *, args: argparse.Namespace) -> None:
        print(*sorted(index.get_packages_with_prefixes()), sep='\n')
