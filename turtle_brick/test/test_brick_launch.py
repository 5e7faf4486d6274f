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
The node turtle_robot, launched alone, publishes cmd_vel at 100 Hz (launch_testing).

colcon test runs it; to run it alone:
    PYTHONPATH=$PYTHONPATH:turtle_brick/test launch_test turtle_brick/test/test_brick_launch.py
"""

import os
import unittest

from launch import LaunchDescription
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from launch_testing.actions import ReadyToTest
import pytest
from test_cmd_vel_rate import assert_cmd_vel_at_100_hz
from turtle_brick.domains import reserved_domain


DOMAIN = reserved_domain()


@pytest.mark.launch_test
def generate_test_description():
    """Launch turtle_robot, with nothing that it could drive, in a ROS domain of its own."""
    os.environ['ROS_DOMAIN_ID'] = str(DOMAIN.__enter__())
    return LaunchDescription([
        Node(
            package='turtle_brick',
            executable='turtle_robot',
            parameters=[
                PathJoinSubstitution([FindPackageShare('turtle_brick'), 'config', 'turtle.yaml']),
            ]),
        ReadyToTest(),
    ])


class TestCmdVel(unittest.TestCase):
    """What the launched node publishes."""

    @classmethod
    def tearDownClass(cls):
        """Give the domain back."""
        DOMAIN.__exit__(None, None, None)

    def test_rate(self):
        """The mean rate of cmd_vel over 3 s is 100 Hz."""
        assert_cmd_vel_at_100_hz(int(os.environ['ROS_DOMAIN_ID']))
