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
"""Run the turtle robot in turtlesim, to be sent about with goal_pose."""

from launch import LaunchDescription
from launch.actions import (DeclareLaunchArgument, IncludeLaunchDescription,
                            SetLaunchConfiguration)
from launch.conditions import IfCondition
from launch.substitutions import (EnvironmentVariable, EqualsSubstitution, LaunchConfiguration,
                                  PathJoinSubstitution, ThisLaunchFileDir)
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Describe turtlesim, the node turtle_robot that drives in it and the view of the robot."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'rviz_config',
            default_value='config/run_turtle.rviz',
            description='The configuration of rviz2, relative to the share directory of '
                        'turtle_brick.'),
        # An argument that is set keeps its value: the environment goes before the default.
        SetLaunchConfiguration(
            'view',
            EnvironmentVariable('TURTLE_BRICK_VIEW', default_value='rviz'),
            condition=IfCondition(
                EqualsSubstitution(LaunchConfiguration('view', default='unset'), 'unset'))),
        DeclareLaunchArgument(
            'view',
            default_value='rviz',
            choices=['rviz', 'web', 'none'],
            description='What shows the robot: rviz2 (rviz), a page in the browser (web) or '
                        'nothing, for a machine without a display (none). '
                        'The variable TURTLE_BRICK_VIEW, if set, replaces the default.'),
        DeclareLaunchArgument(
            'namespace',
            default_value='',
            description='The namespace of all nodes, topics and services, TF included: with one '
                        'of its own each, several robots live side by side.'),
        # First: launch waits for xacro here, and a Ctrl-C meanwhile would leave nodes behind.
        IncludeLaunchDescription(
            PathJoinSubstitution([ThisLaunchFileDir(), 'show_turtle.launch.py']),
            launch_arguments=[
                ('use_jsp', 'none'),
                ('rviz_config', LaunchConfiguration('rviz_config')),
                ('view', LaunchConfiguration('view')),
                ('namespace', LaunchConfiguration('namespace')),
            ]),
        Node(
            package='turtlesim',
            executable='turtlesim_node',
            namespace=LaunchConfiguration('namespace'),
            parameters=[{'holonomic': True}],
            # Qt takes the first that works: without a display turtlesim draws into memory.
            additional_env={
                'QT_QPA_PLATFORM': EnvironmentVariable(
                    'QT_QPA_PLATFORM', default_value='xcb;wayland;offscreen'),
            }),
        Node(
            package='turtle_brick',
            executable='turtle_robot',
            namespace=LaunchConfiguration('namespace'),
            parameters=[
                PathJoinSubstitution([FindPackageShare('turtle_brick'), 'config', 'turtle.yaml']),
            ],
            remappings=[('cmd_vel', 'turtle1/cmd_vel'), ('/tf', 'tf'),
                        ('/tf_static', 'tf_static')]),
    ])
