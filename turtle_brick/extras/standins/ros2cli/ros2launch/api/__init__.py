# SPDX-License-Identifier: Apache-2.0
"""Functions for launch files."""

from __future__ import annotations

import argparse
import os

import ament_index_python as index
from ros2pkg.api import get_absence


LAUNCH_FILES = ('launch.py', 'launch', 'xml', 'yaml', 'yml')
"""Ends of the names of the files that the parsers of launch files accept."""


def find_launch_file(package: str, name: str | None) -> str:
    """
    Return the path of a launch file in or below the share directory of a package.

    :raises RuntimeError: if there is no such file, or more than one
    """
    try:
        share = index.get_package_share_directory(package)
    except index.PackageNotFoundError as error:
        raise RuntimeError(
            get_absence(package) or f"Package '{package}' not found: {error}") from None
    paths = [os.path.join(root, name or '') for root, _, names in os.walk(share) if name in names]
    where = f"in the share directory of package '{package}'"
    if not paths:
        raise RuntimeError(f"file '{name}' was not found {where} which is at '{share}'")
    if len(paths) > 1:
        raise RuntimeError(f"file '{name}' was found more than once {where}: {paths}")
    return paths[0]


def print_arguments_of_launch_file(path: str) -> str | None:
    """Print the arguments that a launch file declares, or return an error message."""
    from launch.launch_description_sources import get_launch_description_from_any_launch_file

    try:
        description = get_launch_description_from_any_launch_file(path)
    except Exception as error:  # noqa: B902 -- a launch file can raise any exception
        return f'{type(error).__name__}: {error}'
    declarations = description.get_first_declarations()
    print("Arguments (pass arguments as '<name>:=<value>'):")
    for argument, _, is_conditional in declarations:
        mark = '*' if is_conditional else ''
        print(f"\n    '{argument.name}':{mark}\n        {argument.description}")
        if argument.default_value is not None:
            default = ' + '.join(part.describe() for part in argument.default_value)
            print(f'        (default: {default})')
    if not declarations:
        print('\n  No arguments.')
    if any(declared.is_conditional for declared in declarations):
        print('\n* argument(s) which are only used if specific conditions occur')
    return None


def complete_launch_file_name(prefix: str, parsed_args: argparse.Namespace,
                              **kwargs: object) -> list[str]:
    """Return the names of the launch files in the package on the command line."""
    share = index.get_package_share_directory(parsed_args.package_name)
    return [name for _, _, names in os.walk(share) for name in names
            if name.endswith(LAUNCH_FILES)]
