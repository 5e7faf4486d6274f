# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""Show the turtle robot without a simulation."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import (Command, EqualsSubstitution, LaunchConfiguration,
                                  PathJoinSubstitution)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return actions that start robot_state_publisher, a joint state publisher and rviz2."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'use_jsp', default_value='gui', choices=['gui', 'jsp', 'none'],
            description='The publisher of joint_states: joint_state_publisher_gui (gui), '
                        'joint_state_publisher (jsp) or none.'),
        DeclareLaunchArgument(
            'rviz_config', default_value='config/show_turtle.rviz',
            description='The rviz2 configuration file, relative to the share directory.'),
        DeclareLaunchArgument(
            'view', default_value='rviz', choices=['rviz', 'none'],
            description='The program that shows the robot: rviz2 (rviz) or none.'),
        Node(
            package='robot_state_publisher',
            executable='robot_state_publisher',
            parameters=[{
                'robot_description': ParameterValue(
                    Command(['xacro "', PathJoinSubstitution(
                        [FindPackageShare('turtle_brick'), 'urdf', 'turtle.urdf.xacro']), '"'],
                            on_stderr='warn'), value_type=str),
                # Without ignore_timestamp, transforms are up to 50 ms late, and a joint state with
                # a timestamp in the future blocks all later joint states.
                'ignore_timestamp': True,
            }]),
        Node(
            package='joint_state_publisher_gui',
            executable='joint_state_publisher_gui',
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('use_jsp'), 'gui'))),
        Node(
            package='joint_state_publisher',
            executable='joint_state_publisher',
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('use_jsp'), 'jsp'))),
        Node(
            package='rviz2',
            executable='rviz2',
            arguments=['-d', PathJoinSubstitution(
                [FindPackageShare('turtle_brick'), LaunchConfiguration('rviz_config')])],
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('view'), 'rviz'))),
    ])
