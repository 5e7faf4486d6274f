# SPDX-License-Identifier: Apache-2.0
"""Actions for tests."""

from launch.missing import missing_name
from launch_testing.actions.ready import ReadyToTest

__all__ = ['ReadyToTest']
__getattr__ = missing_name('launch_testing')
