# SPDX-License-Identifier: Apache-2.0
"""Substitutions for ROS."""

from launch.missing import missing_name
from launch_ros.substitutions.executable_in_package import ExecutableInPackage
from launch_ros.substitutions.find_package import (
    FindPackage, FindPackagePrefix, FindPackageShare)

__all__ = ['ExecutableInPackage', 'FindPackage', 'FindPackagePrefix', 'FindPackageShare']
__getattr__ = missing_name('launch_ros')
