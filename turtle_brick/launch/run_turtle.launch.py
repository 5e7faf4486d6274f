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
"""Run the turtle robot in turtlesim. Publish goal_pose to drive it."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.substitutions import (EnvironmentVariable, LaunchConfiguration,
                                  PathJoinSubstitution)
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return actions that start turtlesim and turtle_robot, and include show_turtle.launch.py."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'rviz_config', default_value='config/run_turtle.rviz',
            description='The rviz2 configuration file, relative to the share directory.'),
        IncludeLaunchDescription(
            PathJoinSubstitution(
                [FindPackageShare('turtle_brick'), 'launch', 'show_turtle.launch.py']),
            launch_arguments=[
                ('rviz_config', LaunchConfiguration('rviz_config')), ('use_jsp', 'none')]),
        Node(
            package='turtlesim',
            executable='turtlesim_node',
            parameters=[{'holonomic': True}],
            # Without a display, Qt falls back to the offscreen platform.
            additional_env={'QT_QPA_PLATFORM': EnvironmentVariable(
                'QT_QPA_PLATFORM', default_value='xcb;wayland;offscreen')}),
        Node(
            package='turtle_brick',
            executable='turtle_robot',
            parameters=[PathJoinSubstitution(
                [FindPackageShare('turtle_brick'), 'config', 'turtle.yaml'])],
            remappings=[('cmd_vel', 'turtle1/cmd_vel')]),
    ])
