# SPDX-License-Identifier: Apache-2.0
"""The reader of Python launch files."""

from __future__ import annotations

from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec

from launch.invalid_launch_file_error import InvalidLaunchFileError
from launch.launch_description import LaunchDescription


class InvalidPythonLaunchFileError(InvalidLaunchFileError):
    """Raised when a Python launch file does not define generate_launch_description()."""


def get_launch_description_from_python_launch_file(path: str) -> LaunchDescription:
    """Import a launch file, and return the result of generate_launch_description()."""
    loader = SourceFileLoader('python_launch_file', path)
    module = module_from_spec(ModuleSpec(loader.name, loader, origin=path))
    loader.exec_module(module)
    if not hasattr(module, 'generate_launch_description'):
        raise InvalidPythonLaunchFileError(
            f"The launch file '{path}' does not define the function "
            'generate_launch_description()')
    return module.generate_launch_description()
