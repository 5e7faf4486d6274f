# SPDX-License-Identifier: Apache-2.0
"""Actions for ROS."""

from launch.missing import missing_name
from launch_ros.actions.lifecycle_node import LifecycleNode
from launch_ros.actions.node import Node
from launch_ros.actions.push_ros_namespace import PushROSNamespace, PushRosNamespace
from launch_ros.actions.ros_timer import ROSTimer, RosTimer
from launch_ros.actions.set_parameter import SetParameter
from launch_ros.actions.set_parameters_from_file import SetParametersFromFile
from launch_ros.actions.set_remap import SetRemap
from launch_ros.actions.set_use_sim_time import SetUseSimTime

__all__ = ['LifecycleNode', 'Node', 'PushROSNamespace', 'PushRosNamespace', 'ROSTimer', 'RosTimer',
           'SetParameter', 'SetParametersFromFile', 'SetRemap', 'SetUseSimTime']
__getattr__ = missing_name('launch_ros')
