# SPDX-License-Identifier: Apache-2.0
"""The stand-in for launch_testing_ros, which provides only the pytest mark `rostest`."""

from launch.missing import missing_name

__getattr__ = missing_name('launch_testing_ros')
