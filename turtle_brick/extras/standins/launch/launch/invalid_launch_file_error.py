# SPDX-License-Identifier: Apache-2.0
"""The error of launch files that cannot be loaded."""


class InvalidLaunchFileError(Exception):
    """Raised when a launch file cannot be loaded."""
