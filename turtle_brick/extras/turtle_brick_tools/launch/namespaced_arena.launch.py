# SPDX-License-Identifier: Apache-2.0
"""Run the complete arena in a namespace, so that several arenas can share a ROS domain."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import PushRosNamespace, SetRemap
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return actions that include turtle_arena.launch.py in a namespace."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'namespace',
            description='The namespace of all nodes, topics and services, including TF.'),
        GroupAction([
            PushRosNamespace(LaunchConfiguration('namespace')),
            SetRemap('/tf', 'tf'),
            SetRemap('/tf_static', 'tf_static'),
            IncludeLaunchDescription(PathJoinSubstitution(
                [FindPackageShare('turtle_brick'), 'launch', 'turtle_arena.launch.py'])),
        ]),
    ])
