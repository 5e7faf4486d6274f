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

"""The node turtle_robot, alone in a process, publishes cmd_vel at 100 Hz: without launch."""

from geometry_msgs.msg import Twist
from live_graph import executable
from live_graph import process
import pytest
from turtle_brick.graph import Graph
from turtle_brick.parameters import default_path
from witness import measure
from witness import Witness


def assert_cmd_vel_at_100_hz(domain_id):
    """
    Measure the mean rate of cmd_vel over 3 s.

    :param domain_id: the ROS domain in which one turtle_robot runs
    :raises AssertionError: It is off 100 Hz by over 1 %, or a command is not for standing still.
    """
    with Graph(domain_id) as graph:
        witness = graph.add(Witness, parameters=False)
        commands = witness.record(Twist, 'cmd_vel')
        graph.spin_until(lambda: commands, 20.0, 'a cmd_vel')
        rate, = measure(graph, [commands], 3.0)
        assert rate == pytest.approx(100.0, rel=0.01)
        assert all(command == Twist() for _, command in commands)


def test_rate(domain_id):
    """The installed executable, in a process of its own, does it."""
    with process([executable('turtle_brick', 'turtle_robot'),
                  '--ros-args', '--params-file', str(default_path())], domain_id):
        assert_cmd_vel_at_100_hz(domain_id)
