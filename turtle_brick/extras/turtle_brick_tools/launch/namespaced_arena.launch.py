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
