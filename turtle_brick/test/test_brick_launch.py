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

"""Launch turtlesim and turtle_robot, and check that cmd_vel is published at 100 Hz."""

import time
import unittest

from geometry_msgs.msg import PoseStamped, Twist
from launch import LaunchDescription
from launch.substitutions import EnvironmentVariable, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from launch_testing.actions import ReadyToTest
import pytest
import rclpy

COUNT = 200
"""Number of commands in each measurement."""

TIMEOUT = 120.0
"""Timeout (s) for each measurement, including the start of the nodes."""


@pytest.mark.launch_test
def generate_test_description():
    """Launch a robot that can drive."""
    parameters = PathJoinSubstitution([FindPackageShare('turtle_brick'), 'config', 'turtle.yaml'])
    return LaunchDescription([
        # turtlesim opens a window if there is a display.
        Node(package='turtlesim', executable='turtlesim_node', parameters=[{'holonomic': True}],
             additional_env={'QT_QPA_PLATFORM': EnvironmentVariable(
                 'QT_QPA_PLATFORM', default_value='xcb;wayland;offscreen')}),
        # At 1 m/s, the robot needs 13 s to drive from one corner to the other.
        Node(package='turtle_brick', executable='turtle_robot',
             parameters=[parameters, {'max_velocity': 1.0}],
             remappings=[('cmd_vel', 'turtle1/cmd_vel')]),
        ReadyToTest(),
    ])


class TestCmdVel(unittest.TestCase):
    """Measure the rate of cmd_vel by the publication times of the commands."""

    def setUp(self):
        """Subscribe to the commands."""
        rclpy.init()
        self.node = rclpy.create_node('listener')
        self.goal_publisher = self.node.create_publisher(PoseStamped, 'goal_pose', 10)
        self.corner, self.commands = 10.0, []
        self.node.create_subscription(Twist, 'turtle1/cmd_vel', self.on_command, 1000)

    def tearDown(self):
        """Shut down rclpy."""
        self.node.destroy_node()
        rclpy.shutdown()

    def on_command(self, command, info):
        """Record whether the robot is driving, and the time (ns) of the publication."""
        is_driving = command.linear.x != 0.0 or command.linear.y != 0.0
        self.commands.append((is_driving, info['source_timestamp']))

    def wait_for_rate(self, is_driving):
        """
        Wait until COUNT successive commands of a robot that drives or is idle have 100 Hz.

        On an overloaded machine, some measurements may have a lower rate.
        """
        deadline, rate = time.monotonic() + TIMEOUT, 0.0
        while not 98.0 < rate < 102.0:
            self.assertLess(time.monotonic(), deadline, f'the last rate was {rate:.1f} Hz')
            rclpy.spin_once(self.node, timeout_sec=1.0)
            if [driving for driving, _ in self.commands] == [is_driving] * (COUNT + 1):
                rate = COUNT / (self.commands[-1][1] - self.commands[0][1]) * 1e9
                self.commands.clear()
            elif self.commands and self.commands[-1][0] is not is_driving:
                self.commands.clear()

    def drive(self):
        """Send the robot to the other corner."""
        self.corner = 11.0 - self.corner
        goal = PoseStamped()
        goal.header.frame_id = 'world'
        goal.pose.position.x = goal.pose.position.y = self.corner
        self.goal_publisher.publish(goal)

    def test_idle_robot(self):
        """A robot without a goal publishes commands of 0."""
        self.wait_for_rate(is_driving=False)

    def test_moving_robot(self):
        """A robot that drives to and fro publishes at the same rate."""
        self.node.create_timer(3.0, self.drive)
        self.wait_for_rate(is_driving=True)
