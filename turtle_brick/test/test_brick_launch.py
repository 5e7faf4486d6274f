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

from itertools import pairwise
from statistics import median
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

DURATION = 20.0
"""Duration (s) of each measurement. A node that waits up to 1 s for a processor makes up for the
missed commands, so this test usually passes on a busy machine too. It fails if the node waits
longer, because the rate is then too low."""

TOLERANCE = 2.0
"""Maximum error (Hz) of the rate, equal to a delay of 0.4 s at the end of a measurement."""

INTERVALS = (0.009, 0.011)
"""Range (s) of the median interval between two commands. The median does not depend on the few
intervals in which the node waited, but it would show commands that are published in batches."""

TIMEOUT = 120.0
"""Timeout (s) for the start of the nodes and for each measurement."""


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
        self.commands = []
        self.node.create_subscription(Twist, 'turtle1/cmd_vel', self.on_command, 2000)

    def tearDown(self):
        self.node.destroy_node()
        rclpy.shutdown()

    def on_command(self, command, info):
        """Record the publication time (s) of a command, and whether the robot shall move."""
        self.commands.append((1e-9 * info['source_timestamp'], command != Twist()))

    def send_goal(self):
        goal = PoseStamped()
        goal.header.frame_id = 'world'
        goal.pose.position.x = goal.pose.position.y = 10.0
        self.goal_publisher.publish(goal)

    def wait_for(self, condition, what):
        deadline = time.monotonic() + TIMEOUT
        while not condition():
            self.assertLess(time.monotonic(), deadline, what)
            rclpy.spin_once(self.node, timeout_sec=1.0)

    def check_rate(self, is_driving):
        """Check the commands that were published within DURATION after the first one."""
        self.wait_for(lambda: self.commands and self.commands[-1][1] == is_driving,
                      f'a first command, driving: {is_driving}')
        del self.commands[:-1]
        end = self.commands[0][0] + DURATION
        self.wait_for(lambda: self.commands[-1][0] >= end, f'commands for {DURATION} s')
        times = [published for published, _ in self.commands if published < end]
        self.assertAlmostEqual(len(times) / DURATION, 100.0, delta=TOLERANCE)
        shortest, longest = INTERVALS
        interval = median(after - before for before, after in pairwise(times))
        self.assertTrue(shortest <= interval <= longest, f'median interval: {interval} s')
        driving = [is_moving for _, is_moving in self.commands]
        self.assertGreater(driving.count(is_driving), 0.5 * len(driving))

    def test_commands_have_100_hz(self):
        """The rate of cmd_vel is 100 Hz with and without a goal."""
        self.check_rate(is_driving=False)
        self.node.create_timer(0.2, self.send_goal)
        self.check_rate(is_driving=True)
