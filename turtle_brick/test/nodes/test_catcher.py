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

"""Test the commands, decisions, markers and log messages of the catcher."""

from math import dist
import re

from defaults import REST_Z, seconds
from driven import PARAMETERS, record_published, SteppedGraph
from geometry_msgs.msg import Point, Pose, PoseStamped
from live_nodes import LATCHED, TIMEOUT
import pytest
from rclpy.duration import Duration
from std_msgs.msg import String
from turtle_brick.catcher import CatcherNode
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.physics import BrickState, STEP_NS
from turtle_brick.ros.tf import nanoseconds_of
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker


class Bench(SteppedGraph):
    """A SteppedGraph with a catcher and a robot that responds to goals after a delay (s)."""

    def __init__(self, live, delay=0.0):
        self.delay = seconds(delay)
        self.goals, self.tilts = [], []
        super().__init__(live, CatcherNode)
        self.catcher = self.nodes[1]
        self.goals = record_published(self.catcher.goal_publisher)
        self.tilts = record_published(self.catcher.tilt_publisher)

    def move(self, time):
        x, y, yaw, tilt = self.platform
        if self.tilts:
            tilt = self.tilts[-1].angle
        goals = [goal for goal in self.goals
                 if nanoseconds_of(goal.header.stamp) + self.delay <= self.now]
        if goals:
            goal = goals[-1].pose.position
            distance = max(dist((x, y), (goal.x, goal.y)), 1e-9)
            fraction = min(PARAMETERS.max_velocity * time / distance, 1.0)
            x, y = x + fraction * (goal.x - x), y + fraction * (goal.y - y)
        self.platform = (x, y, yaw, tilt)

    def connect(self):
        recordings = (self.live.record('goal_pose', PoseStamped), self.live.record('tilt', Tilt))
        self.live.wait_for(self.catcher.has_subscribers, TIMEOUT, 'the catcher finds the robot')
        return recordings

    def release(self, *place):
        assert self.place(*place).success
        self.run(0.3)
        assert self.drop().success


def test_unreachable_and_reachable_brick(live, capfd):
    """The first brick falls before a robot subscribes to goals. The second brick is caught."""
    bench = Bench(live)
    markers = live.record('catcher_marker', Marker)
    states = live.record('catcher_state', String, LATCHED)
    decisions = live.record('catcher_decision', String, LATCHED)
    live.wait_for(lambda: states.messages, TIMEOUT, 'the first state')
    bench.release(0.5, 1.0, 6.0)
    bench.until(BrickState.GROUNDED)
    goals, tilts = bench.connect()
    bench.release(6.0, 4.5, 8.0)
    bench.until(BrickState.RIDING)
    bench.until(BrickState.FLOATING)
    assert dist(bench.platform[:2], CENTER) < 0.05
    bench.until(lambda: bench.platform[3] == 0.0, 'the platform is level')
    live.wait_for(lambda: len(states.messages) == 6, TIMEOUT, 'the last state')
    late = live.record('catcher_state', String, LATCHED)
    live.wait_for(lambda: late.messages and goals.last == bench.goals[-1]
                  and tilts.last == bench.tilts[-1], TIMEOUT, 'state and commands')
    lines = capfd.readouterr().err.splitlines()
    assert [state.data for state in states.messages] == [
        'waiting', 'approaching', 'carrying', 'tilting', 'leveling', 'waiting']
    assert [text.data.split(':')[0] for text in decisions.messages] == ['unreachable', 'reachable']
    for decision in decisions.messages:
        assert sum(f') is {decision.data}' in line for line in lines) == 1
    assert late.last.data == 'waiting'
    (marker,) = markers.messages
    assert (marker.text, marker.header.frame_id) == ('Unreachable', 'world')
    assert (marker.type, marker.action) == (Marker.TEXT_VIEW_FACING, Marker.ADD)
    assert Duration.from_msg(marker.lifetime) == Duration(seconds=3)
    position = marker.pose.position
    assert (position.x, position.y) == pytest.approx((0.5, 1.0))
    assert 5.5 < position.z < 8.0
    first, last = bench.goals[0].pose.position, bench.goals[-1].pose.position
    assert (first.x, first.y) == pytest.approx((6.0, 4.5)) and (last.x, last.y) == CENTER
    assert {goal.header.frame_id for goal in bench.goals} == {'world'}
    angles = [tilt.angle for tilt in bench.tilts]
    assert max(angles) == PARAMETERS.tilt_angle and angles[-1] == 0.0
    assert len(set(angles)) > 20  # The angle changes smoothly.
    assert not [line for line in lines if 'WARN' in line or 'ERROR' in line]


def test_brick_attached_to_the_platform_is_carried(live):
    """The catcher does not observe a fall, because the brick is released on the platform."""
    bench = Bench(live)
    bench.connect()
    bench.place(5.0, 5.0, REST_Z)
    bench.run(3.0)
    assert bench.goals == [] and bench.world.state is BrickState.HOVERING
    bench.drop()
    bench.until(BrickState.FLOATING)


def test_tilt_and_goal_of_another_node_are_corrected(live):
    bench = Bench(live)
    bench.connect()
    bench.release(8.0, 7.0, 20.0)
    for state in (BrickState.FALLING, BrickState.RIDING):
        bench.until(state)
        bench.run(0.3)
        bench.tilts.append(Tilt(angle=0.4))
        corner = PoseStamped(pose=Pose(position=Point(x=1.0, y=10.0)))
        bench.goals.append(corner)
        bench.run(0.06)
        assert bench.tilts[-1].angle == 0.0 and bench.goals[-1] is not corner
    bench.until(BrickState.FLOATING)
    assert dist(bench.platform[:2], CENTER) < 0.05


def test_late_robot_is_reported_once(live, capfd):
    bench = Bench(live, delay=0.3)
    bench.connect()
    bench.run(0.5)
    for x in (6.5, 4.5):
        bench.release(x, 5.0, 8.0)
        bench.until(BrickState.FLOATING)
    (warning,) = [line for line in capfd.readouterr().err.splitlines() if 'WARN' in line]
    needed = float(re.search(r'The robot needed ([\d.]+) s to respond to a goal, but '
                             r'command_latency is 0.11 s', warning)[1])
    assert needed == pytest.approx(0.3, abs=0.03)
    assert f'Set command_latency to at least {needed:.2f} in turtle.yaml.' in warning


def test_fall_in_one_message_is_detected_immediately(live):
    """After a delay, the arena broadcasts the transforms of many steps in one message."""
    bench = Bench(live)
    bench.release(12.0, 6.0, 8.0)
    bench.tick()
    begin = bench.now
    bench.tick(200_000_000, updates=False)
    fall = bench.catcher.catcher.decision.fall
    assert abs(fall.stamp - begin) <= 3 * STEP_NS
    assert fall.position[:2] == (12.0, 6.0)
