# SPDX-License-Identifier: Apache-2.0
"""The launch description source PythonLaunchDescriptionSource."""

from __future__ import annotations

from launch.launch_description import LaunchDescription
from launch.launch_description_source import LaunchDescriptionSource
from launch.launch_description_sources.python_launch_file_utilities import (
    get_launch_description_from_python_launch_file)


class PythonLaunchDescriptionSource(LaunchDescriptionSource):
    """A launch file in Python, whatever its suffix is."""

    def read(self, path: str) -> LaunchDescription:
        return get_launch_description_from_python_launch_file(path)
