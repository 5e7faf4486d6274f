# SPDX-License-Identifier: Apache-2.0
"""The reader of XML and YAML launch files."""

from __future__ import annotations

from launch.frontend.parser import Parser
from launch.launch_description import LaunchDescription


def get_launch_description_from_frontend_launch_file(
        path: str, *, parser: type[Parser]) -> LaunchDescription:
    """Read a launch file with a parser."""
    root_entity, instance = parser.load(path)
    return instance.parse_description(root_entity)
