# SPDX-License-Identifier: Apache-2.0
"""The action of turtlesim."""

from turtlesim.action import RotateAbsolute

__all__ = ['RotateAbsolute']
