# SPDX-License-Identifier: Apache-2.0
"""The launch description source XMLLaunchDescriptionSource."""

from launch.launch_description_sources import FrontendLaunchDescriptionSource


class XMLLaunchDescriptionSource(FrontendLaunchDescriptionSource):
    """An XML launch file."""
