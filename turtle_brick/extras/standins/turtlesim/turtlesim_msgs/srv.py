# SPDX-License-Identifier: Apache-2.0
"""The services of turtlesim."""

from turtlesim.srv import Kill, SetPen, Spawn, TeleportAbsolute, TeleportRelative

__all__ = ['Kill', 'SetPen', 'Spawn', 'TeleportAbsolute', 'TeleportRelative']
