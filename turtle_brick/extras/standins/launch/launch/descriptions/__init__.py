# SPDX-License-Identifier: Apache-2.0
"""Descriptions of programs."""

from launch.descriptions.executable import Executable
from launch.missing import missing_name

__all__ = ['Executable']
__getattr__ = missing_name('launch')
