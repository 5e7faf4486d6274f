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
"""Launch turtle_robot and check that it publishes cmd_vel at 100 Hz."""

import os
import time
import unittest

from geometry_msgs.msg import Twist
from graph_client.domains import reserved_domain
from launch import LaunchDescription
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from launch_testing.actions import ReadyToTest
import pytest
import rclpy

DOMAIN = reserved_domain()

WARM_UP, COUNT = 50, 400
"""Number of commands to ignore after the launch, and number of commands to measure."""


@pytest.mark.launch_test
def generate_test_description():
    """Launch only turtle_robot in an unused ROS domain."""
    os.environ['ROS_DOMAIN_ID'] = str(DOMAIN.__enter__())
    parameters = PathJoinSubstitution([FindPackageShare('turtle_brick'), 'config', 'turtle.yaml'])
    return LaunchDescription([
        Node(package='turtle_brick', executable='turtle_robot', parameters=[parameters]),
        ReadyToTest(),
    ])


class TestCmdVel(unittest.TestCase):

    @classmethod
    def tearDownClass(cls):
        DOMAIN.__exit__(None, None, None)

    def setUp(self):
        rclpy.init()
        self.node = rclpy.create_node('listener')

    def tearDown(self):
        self.node.destroy_node()
        rclpy.shutdown()

    def test_rate(self):
        stamps = []
        self.node.create_subscription(
            Twist, 'cmd_vel', lambda _, info: stamps.append(info['source_timestamp'] * 1e-9), 100)
        deadline = time.monotonic() + 30.0
        while len(stamps) <= WARM_UP + COUNT and time.monotonic() < deadline:
            rclpy.spin_once(self.node, timeout_sec=1.0)
        self.assertGreater(len(stamps), WARM_UP + COUNT)
        begin, end = stamps[WARM_UP], stamps[WARM_UP + COUNT]
        self.assertAlmostEqual(COUNT / (end - begin), 100.0, delta=2.0)
