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
"""Run the complete arena, in which the turtle robot catches dropped bricks."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return actions that start the robot (run_turtle.launch.py), the arena and the catcher."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'rviz_config', default_value='config/turtle_arena.rviz',
            description='The rviz2 configuration file, relative to the share directory.'),
        IncludeLaunchDescription(
            PathJoinSubstitution(
                [FindPackageShare('turtle_brick'), 'launch', 'run_turtle.launch.py']),
            launch_arguments=[('rviz_config', LaunchConfiguration('rviz_config'))]),
        Node(
            package='turtle_brick',
            executable='arena',
            parameters=[PathJoinSubstitution(
                [FindPackageShare('turtle_brick'), 'config', 'turtle.yaml'])]),
        Node(
            package='turtle_brick',
            executable='catcher',
            parameters=[PathJoinSubstitution(
                [FindPackageShare('turtle_brick'), 'config', 'turtle.yaml'])]),
    ])
