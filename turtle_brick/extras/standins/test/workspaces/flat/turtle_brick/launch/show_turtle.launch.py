# SPDX-License-Identifier: Apache-2.0
"""Start the nodes that show the robot."""

from launch import LaunchDescription
from launch.substitutions import Command, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare


def generate_launch_description():
    return LaunchDescription([
        Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=[{
            'robot_description': Command([
                ExecutableInPackage('xacro', 'xacro'), ' ',
                PathJoinSubstitution([FindPackageShare('turtle_brick'), 'turtle.urdf.xacro'])])}]),
    ])
