# SPDX-License-Identifier: Apache-2.0
"""Descriptions of parameters."""

from launch.missing import missing_name
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue

__all__ = ['ParameterFile', 'ParameterValue']
__getattr__ = missing_name('launch_ros')
