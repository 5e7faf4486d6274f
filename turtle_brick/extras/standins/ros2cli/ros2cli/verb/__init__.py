# SPDX-License-Identifier: Apache-2.0
"""The base class of verbs."""

from __future__ import annotations

import argparse

from ros2cli.command import Status


class VerbExtension:
    """A verb of a command, such as `list`. Its description is the one in the command."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the arguments of the verb to a parser."""

    def main(self, *, args: argparse.Namespace) -> Status:
        """Run the verb."""
        raise NotImplementedError
