# SPDX-License-Identifier: Apache-2.0
"""The messages of turtlesim."""

from turtlesim.msg import Color, Pose

__all__ = ['Color', 'Pose']
