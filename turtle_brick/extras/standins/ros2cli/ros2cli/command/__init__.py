# SPDX-License-Identifier: Apache-2.0
"""The base class of commands such as `ros2 topic`, and their parsers."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Union

Status = Union[int, str, None]
"""Exit status of a command. A text is an error message, and the status is 1."""


class CommandExtension:
    """A command, which is described in ros2cli.cli."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        """
        Add the arguments of the command to a parser.

        :param cli_name: name of the command, such as `ros2 topic`
        :param typed: following words on the command line
        """

    def main(self, *, args: argparse.Namespace) -> Status:
        """Run the command."""
        raise NotImplementedError


class CommandWithVerbs(CommandExtension):
    """The base class of commands that consist of verbs."""

    verb_package = ''
    """Python package that contains the module of each verb."""

    verbs: Mapping[str, str] = {}
    """Description of each verb."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.set_defaults(main=lambda *, args: parser.print_help())
        subparsers = add_subparsers(parser, cli_name, self.verbs)
        for verb, description in self.verbs.items():
            # Only the verb on the command line is imported because many modules are slow.
            if verb not in typed[:1]:
                subparsers.add_parser(verb)
                continue
            child = subparsers.add_parser(
                verb, description=description,
                formatter_class=argparse.RawDescriptionHelpFormatter)
            extension = get_class(f'{self.verb_package}.{verb}', verb, 'Verb')()
            extension.add_arguments(child)
            child.set_defaults(main=extension.main)


def get_class(module: str, name: str, suffix: str) -> type:
    """Return a class such as SendGoalVerb from a module such as send_goal."""
    class_name = ''.join(part.capitalize() for part in name.split('_')) + suffix
    return getattr(import_module(module), class_name)


def add_subparsers(
        parser: argparse.ArgumentParser, cli_name: str, descriptions: Mapping[str, str]
) -> argparse._SubParsersAction[argparse.ArgumentParser]:
    """Add a list of commands or verbs with their descriptions to a parser."""
    width = max(len(name) for name in descriptions)
    lines = [f'{name:{width}}  {text}\n' for name, text in descriptions.items()]
    return parser.add_subparsers(
        title='Commands', description=''.join(lines),
        metavar=f'Call `{cli_name} <command> -h` for more detailed usage.')
