# SPDX-License-Identifier: Apache-2.0
"""The launch description source AnyLaunchDescriptionSource."""

from __future__ import annotations

from launch.launch_description import LaunchDescription
from launch.launch_description_source import LaunchDescriptionSource
from launch.launch_description_sources.any_launch_file_utilities import (
    get_launch_description_from_any_launch_file)


class AnyLaunchDescriptionSource(LaunchDescriptionSource):
    """A launch file in Python, XML or YAML."""

    def read(self, path: str) -> LaunchDescription:
        return get_launch_description_from_any_launch_file(path)
