# SPDX-License-Identifier: Apache-2.0
"""The launch description source FrontendLaunchDescriptionSource."""

from launch.launch_description_sources.any_launch_description_source import (
    AnyLaunchDescriptionSource)


class FrontendLaunchDescriptionSource(AnyLaunchDescriptionSource):
    """A launch file in XML or YAML."""
