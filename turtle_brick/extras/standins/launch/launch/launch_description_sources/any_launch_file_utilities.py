# SPDX-License-Identifier: Apache-2.0
"""The reader of launch files in any format."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
import os
import re

from ament_index_python import get_resource, get_resources
from launch.frontend.parser import Parser
from launch.invalid_launch_file_error import InvalidLaunchFileError
from launch.launch_description import LaunchDescription
from launch.launch_description_sources.frontend_launch_file_utilities import (
    get_launch_description_from_frontend_launch_file)
from launch.launch_description_sources.python_launch_file_utilities import (
    get_launch_description_from_python_launch_file)


def readers() -> dict[str, Callable[[str], LaunchDescription]]:
    """Return the functions that read a launch file, keyed by file name extension."""
    functions: dict[str, Callable[[str], LaunchDescription]] = {
        'py': get_launch_description_from_python_launch_file}
    for parser in Parser.get_parsers_from_entry_points().values():
        for extension in parser.get_file_extensions():
            functions[extension] = partial(
                get_launch_description_from_frontend_launch_file, parser=parser)
    return functions


def explain(error: Exception) -> str:
    """Return the message of an error, or why the environment lacks a package of ROS 2."""
    match = re.match("package '(.+?)' not found", str(error.args[0] if error.args else ''))
    if match and match[1] in get_resources('absent_packages'):
        return get_resource('absent_packages', match[1])[0]
    return str(error)


def get_launch_description_from_any_launch_file(path: str) -> LaunchDescription:
    """
    Read a launch file. A file with an unknown extension may have any format.

    :raises InvalidLaunchFileError: if the file cannot be read
    """
    extension = os.path.splitext(path)[1][1:]
    if extension in readers():
        try:
            return readers()[extension](path)
        except Exception as error:
            raise InvalidLaunchFileError(f"The launch file '{path}' has an error:\n - "
                                         f'{type(error).__name__}: {explain(error)}') from error
    for read in readers().values():
        with suppress(Exception):
            return read(path)
    raise InvalidLaunchFileError(
        f"The launch file '{path}' has a syntax error, or its format is unknown")
