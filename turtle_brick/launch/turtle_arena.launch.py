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
"""
Run the complete arena, in which the turtle robot catches dropped bricks.

The arena provides the `place` and `drop` services. The `namespace` argument also applies to TF.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.substitutions import (EnvironmentVariable, LaunchConfiguration, PathJoinSubstitution,
                                  ThisLaunchFileDir)
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return actions that start the robot (run_turtle.launch.py), the arena and the catcher."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'rviz_config',
            default_value='config/turtle_arena.rviz',
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
        # The included file starts turtlesim, turtle_robot, robot_state_publisher and the view. It
        # inherits all arguments.
        IncludeLaunchDescription(
            PathJoinSubstitution([ThisLaunchFileDir(), 'run_turtle.launch.py'])),
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
