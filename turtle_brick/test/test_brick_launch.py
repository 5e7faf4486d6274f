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
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from launch_testing.actions import ReadyToTest
import pytest
import rclpy

COUNT = 25
"""Number of consecutive intervals between commands in each measurement."""

CALM_NS = range(5_000_000, 15_000_000)
"""Intervals (ns) between commands unless a busy machine delays a command by about half a cycle."""

TIMEOUT = 120.0
"""Timeout (s) for a measurement, including the start of the nodes."""


@pytest.mark.launch_test
def generate_test_description():
    """Launch a robot that is too slow to reach its goal during the test."""
    parameters = PathJoinSubstitution([FindPackageShare('turtle_brick'), 'config', 'turtle.yaml'])
    return LaunchDescription([
        Node(package='turtlesim', executable='turtlesim_node', parameters=[{'holonomic': True}],
             additional_env={'QT_QPA_PLATFORM': 'offscreen'}),
        Node(package='turtle_brick', executable='turtle_robot',
             parameters=[parameters, {'max_velocity': 0.04}],
             remappings=[('cmd_vel', 'turtle1/cmd_vel')]),
        ReadyToTest(),
    ])


class TestCmdVel(unittest.TestCase):
    """Measure the rate of cmd_vel from the publication times of the commands."""

    def setUp(self):
        rclpy.init()
        self.node = rclpy.create_node('listener')
        self.goal_publisher = self.node.create_publisher(PoseStamped, 'goal_pose', 10)
        self.times = {'idle': [], 'driving': []}
        self.node.create_subscription(Twist, 'turtle1/cmd_vel', self.on_command, 1000)

    def tearDown(self):
        self.node.destroy_node()
        rclpy.shutdown()

    def on_command(self, command, info):
        """Record the publication time (ns) of a command, or start again if it was delayed."""
        times = self.times['idle' if command == Twist() else 'driving']
        if times and info['source_timestamp'] - times[-1] not in CALM_NS:
            times.clear()
        times.append(info['source_timestamp'])

    def send_goal(self):
        goal = PoseStamped()
        goal.header.frame_id = 'world'
        goal.pose.position.x = goal.pose.position.y = 10.0
        self.goal_publisher.publish(goal)

    def measure_rate(self, state):
        """Return the mean rate (Hz) of consecutive commands that were not delayed."""
        times, deadline = self.times[state], time.monotonic() + TIMEOUT
        times.clear()
        while len(times) <= COUNT:
            self.assertLess(time.monotonic(), deadline, f'{state}: {len(times)} commands')
            rclpy.spin_once(self.node, timeout_sec=1.0)
        return 1e9 * COUNT / (times[COUNT] - times[0])

    def test_commands_have_100_hz(self):
        """The rate of cmd_vel is 100 Hz with and without a goal."""
        self.assertAlmostEqual(self.measure_rate('idle'), 100.0, delta=5.0)
        self.node.create_timer(0.2, self.send_goal)
        self.assertAlmostEqual(self.measure_rate('driving'), 100.0, delta=5.0)
