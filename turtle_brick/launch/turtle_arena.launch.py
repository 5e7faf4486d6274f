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
"""Run the whole arena: the turtle robot catches the brick that is dropped."""

from launch import LaunchDescription
from launch.actions import (DeclareLaunchArgument, IncludeLaunchDescription,
                            SetLaunchConfiguration)
from launch.conditions import IfCondition
from launch.substitutions import (EnvironmentVariable, EqualsSubstitution, LaunchConfiguration,
                                  PathJoinSubstitution, ThisLaunchFileDir)
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Describe the running robot, the arena with its brick and the catcher."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'rviz_config',
            default_value='config/turtle_arena.rviz',
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
            description='What shows robot, arena and brick: rviz2 (rviz), a page in the browser '
                        '(web) or nothing, for a machine without a display (none). '
                        'The variable TURTLE_BRICK_VIEW, if set, replaces the default.'),
        DeclareLaunchArgument(
            'namespace',
            default_value='',
            description='The namespace of all nodes, topics and services, TF included: with one '
                        'of its own each, several robots live side by side.'),
        IncludeLaunchDescription(
            PathJoinSubstitution([ThisLaunchFileDir(), 'run_turtle.launch.py']),
            launch_arguments=[
                ('rviz_config', LaunchConfiguration('rviz_config')),
                ('view', LaunchConfiguration('view')),
                ('namespace', LaunchConfiguration('namespace')),
            ]),
        Node(
            package='turtle_brick',
            executable='arena',
            namespace=LaunchConfiguration('namespace'),
            remappings=[('/tf', 'tf'), ('/tf_static', 'tf_static')],
            parameters=[
                PathJoinSubstitution([FindPackageShare('turtle_brick'), 'config', 'turtle.yaml']),
            ]),
        Node(
            package='turtle_brick',
            executable='catcher',
            namespace=LaunchConfiguration('namespace'),
            remappings=[('/tf', 'tf'), ('/tf_static', 'tf_static')],
            parameters=[
                PathJoinSubstitution([FindPackageShare('turtle_brick'), 'config', 'turtle.yaml']),
            ]),
    ])
