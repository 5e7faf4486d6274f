# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 daemon stop`."""

from __future__ import annotations

import argparse

from ros2cli.verb import VerbExtension


class StopVerb(VerbExtension):
    """Reports that no daemon runs, because commands discover the graph themselves."""

    def main(self, *, args: argparse.Namespace) -> None:
        print('The daemon is not running')
