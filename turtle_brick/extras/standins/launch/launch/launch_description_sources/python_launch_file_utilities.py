# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
