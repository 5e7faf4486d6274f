# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 interface show`."""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

import ament_index_python as index
from ros2cli.helpers import complete_with
from ros2cli.verb import VerbExtension
from ros2interface.api import complete_interface
from rosidl_adapter.parser import parse_message_string


class ShowVerb(VerbExtension):
    """Prints the definition of an interface."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        group = parser.add_mutually_exclusive_group()
        group.add_argument(
            '--all-comments', action='store_true',
            help='Show all comments, including for nested interface definitions')
        group.add_argument(
            '--no-comments', action='store_true',
            help='Show no comments or whitespace')
        interface_type = parser.add_argument(
            'type',
            help="Show an interface definition (e.g. 'example_interfaces/msg/String'). Passing "
            "'-' reads the argument from stdin (e.g. 'ros2 topic type /chatter | ros2 "
            "interface show -').")
        complete_with(interface_type, complete_interface)

    def main(self, *, args: argparse.Namespace) -> None:
        name = sys.stdin.readline().strip() if args.type == '-' else args.type
        show(name, not args.no_comments, args.all_comments)


def show(name: str, comments: bool, nested_comments: bool, indent: str = '') -> None:
    """
    Print the definition of an interface and of the types that it contains.

    :param comments: whether comments are printed
    :param nested_comments: whether comments in the other types are printed
    """
    parts = name.split('/')
    if len(parts) != 3:
        raise RuntimeError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    prefix = index.has_resource('packages', parts[0] or ' ')
    if not prefix:
        raise RuntimeError(f"Unknown package '{parts[0]}'")
    path = Path(prefix, 'share', f'{name}.{parts[1]}')
    if not path.is_file():
        raise RuntimeError(f"Could not find the interface '{path.with_suffix('.idl')}'")
    for line in path.read_text(encoding='utf-8').splitlines():
        line = text = line.rstrip()
        spec = parse_message_string(parts[0], parts[2], '' if line == '---' else line)
        for entry in (*spec.fields, *spec.constants):
            if not comments and entry.annotations['comment']:
                text = line[:line.find(entry.annotations['comment'][0]) - 1].strip()
        if comments or line and not spec.annotations['comment']:
            print(f'{indent}{text}' if text else '')
        if spec.fields and spec.fields[0].type.pkg_name:
            nested = spec.fields[0].type
            show(f'{nested.pkg_name}/msg/{nested.type}', nested_comments, nested_comments,
                 f'{indent}\t')
