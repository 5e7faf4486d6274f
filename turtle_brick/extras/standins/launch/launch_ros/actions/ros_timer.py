# SPDX-License-Identifier: Apache-2.0
"""The action ROSTimer."""

from launch.actions import TimerAction
from launch.frontend import expose_action


@expose_action('ros_timer')
class ROSTimer(TimerAction):
    """Executes actions after a period (s) of the system clock."""


RosTimer = ROSTimer
