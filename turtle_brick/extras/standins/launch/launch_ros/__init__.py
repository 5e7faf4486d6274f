# SPDX-License-Identifier: Apache-2.0
"""The stand-in for launch_ros 0.26.12: nodes with parameters, remappings and namespaces."""

from launch.missing import missing_name
from launch_ros import actions
from launch_ros import descriptions
from launch_ros import parameter_descriptions
from launch_ros import substitutions
from launch_ros import utilities

__all__ = ['actions', 'descriptions', 'parameter_descriptions', 'substitutions', 'utilities']
__getattr__ = missing_name('launch_ros')
