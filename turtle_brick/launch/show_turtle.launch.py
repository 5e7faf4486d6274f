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
from launch.actions import DeclareLaunchArgument, LogInfo
from launch.conditions import IfCondition
from launch.substitutions import (Command, EnvironmentVariable, EqualsSubstitution,
                                  LaunchConfiguration, PathJoinSubstitution)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return actions that start robot_state_publisher, a joint state publisher and a view."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'use_jsp',
            default_value='gui',
            choices=['gui', 'jsp', 'none'],
            description='The publisher of joint_states: joint_state_publisher_gui (gui), '
                        'joint_state_publisher (jsp) or none.'),
        DeclareLaunchArgument(
            'rviz_config',
            default_value='config/show_turtle.rviz',
            description='The configuration file of rviz2, relative to the share directory of '
                        'turtle_brick.'),
        DeclareLaunchArgument(
            'view',
            default_value=EnvironmentVariable('TURTLE_BRICK_VIEW', default_value='rviz'),
            choices=['rviz', 'web', 'none'],
            description='The program that shows the robot: rviz2 (rviz), a page in the browser '
                        '(web) or none. The environment variable TURTLE_BRICK_VIEW changes the '
                        'default.'),
        DeclareLaunchArgument(
            'namespace',
            default_value='',
            description='The namespace of all nodes, topics and services, including TF. Several '
                        'robots can run in different namespaces.'),
        Node(
            package='robot_state_publisher',
            executable='robot_state_publisher',
            namespace=LaunchConfiguration('namespace'),
            remappings=[('/tf', 'tf'), ('/tf_static', 'tf_static')],
            parameters=[{
                'robot_description': ParameterValue(
                    Command([
                        'xacro "',
                        PathJoinSubstitution(
                            [FindPackageShare('turtle_brick'), 'urdf', 'turtle.urdf.xacro']),
                        '"',
                    ], on_stderr='warn'),
                    value_type=str),
                # Without this setting, transforms are up to 50 ms late, and a joint state with a
                # timestamp in the future blocks all later joint states.
                'ignore_timestamp': True,
            }]),
        Node(
            package='joint_state_publisher_gui',
            executable='joint_state_publisher_gui',
            namespace=LaunchConfiguration('namespace'),
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('use_jsp'), 'gui'))),
        Node(
            package='joint_state_publisher',
            executable='joint_state_publisher',
            namespace=LaunchConfiguration('namespace'),
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('use_jsp'), 'jsp'))),
        LogInfo(
            msg='Showing the robot in rviz2. If rviz2 is not installed, use view:=web.',
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('view'), 'rviz'))),
        Node(
            package='rviz2',
            executable='rviz2',
            namespace=LaunchConfiguration('namespace'),
            remappings=[('/tf', 'tf'), ('/tf_static', 'tf_static')],
            arguments=[
                '-d',
                PathJoinSubstitution(
                    [FindPackageShare('turtle_brick'), LaunchConfiguration('rviz_config')]),
            ],
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('view'), 'rviz'))),
        Node(
            package='turtle_brick',
            executable='viewer',
            namespace=LaunchConfiguration('namespace'),
            remappings=[('/tf', 'tf'), ('/tf_static', 'tf_static')],
            condition=IfCondition(EqualsSubstitution(LaunchConfiguration('view'), 'web'))),
    ])
