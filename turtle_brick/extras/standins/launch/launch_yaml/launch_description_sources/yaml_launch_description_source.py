# SPDX-License-Identifier: Apache-2.0
"""The launch description source YAMLLaunchDescriptionSource."""

from launch.launch_description_sources import FrontendLaunchDescriptionSource


class YAMLLaunchDescriptionSource(FrontendLaunchDescriptionSource):
    """A YAML launch file."""
