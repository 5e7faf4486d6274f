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

"""The catcher in a live graph with a driven time: its orders, its marker, what it waits for."""

from math import dist

from driven import PARAMETERS, Stage
from geometry_msgs.msg import PoseStamped
from live_graph import graph, LATCHED, PATIENCE
import pytest
from rclpy.duration import Duration
from rclpy.qos import ReliabilityPolicy
from rclpy.time import Time
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from turtle_brick.catcher import CatcherNode
from turtle_brick.core.catch_logic import CENTER, State
from turtle_brick.core.geometry import IDENTITY, Pose
from turtle_brick.core.reachability import resting_height
from turtle_brick.physics import Phase, STEP
from turtle_brick.ros.tf import BASE_LINK, BRICK, PLATFORM, transform_message, WORLD
from turtle_brick_interfaces.msg import Tilt
from turtle_referee.domains import reserved_domain
from visualization_msgs.msg import Marker

REST = resting_height(PARAMETERS)


class Bench(Stage):
    """Arena and catcher, and a robot that obeys without delay."""

    def __init__(self, live):
        """Bring them up, without any robot that hears the catcher."""
        self.goal = (5.0, 5.0)
        self.goals = self.tilts = None
        super().__init__(live, CatcherNode)
        self.node = self.nodes[1]
        self.catcher = self.node.catcher
        self.markers = live.record('catcher_marker', Marker)
        self.states = live.record('catcher_state', String, LATCHED)

    def bring_up_robot(self):
        """Let the robot hear the catcher from now on."""
        self.goals = self.live.record('goal_pose', PoseStamped)
        self.tilts = self.live.record('tilt', Tilt)
        self.until(lambda: self.node.complete, 'robot and brick are in sight')

    def move(self, seconds):
        """Obey the last orders."""
        x, y, yaw, tilt = self.platform
        if self.goals and self.goals.messages:
            goal = self.goals.last.pose.position
            self.goal = (goal.x, goal.y)
        if self.tilts and self.tilts.messages:
            tilt = self.tilts.last.angle
        way = max(dist((x, y), self.goal), 1e-9)
        part = min(PARAMETERS.max_velocity * abs(seconds) / way, 1.0)
        self.platform = (x + part * (self.goal[0] - x), y + part * (self.goal[1] - y), yaw, tilt)

    def reach(self, state):
        """Let the time go on until the catcher is in a state."""
        self.until(lambda: self.catcher.state is state, state.value)

    def release(self, *place):
        """Let the brick hover somewhere (m) for a while, and fall; forget what was said before."""
        assert self.place(*place).success
        self.run(0.3)
        for recording in (self.goals, self.tilts, self.markers):
            recording.clear()
        assert self.drop().success
        self.until(Phase.FALLING)

    def catch(self, *place):
        """Drop a brick that is in reach, and see that it is caught, carried and tipped off."""
        before = self.catcher.decision
        self.release(*place)
        self.reach(State.CARRYING)
        assert self.catcher.decision is not before and self.catcher.decision.reachable
        assert self.world.phase is Phase.RIDING
        self.reach(State.TILTING)
        assert dist(self.platform[:2], CENTER) < 0.05
        self.reach(State.WAITING)
        assert self.world.phase is Phase.FLOATING
        self.until(lambda: self.platform[3] == 0.0, 'level')
        assert not self.markers.messages

    def refuse(self, *place):
        """Drop a brick that can't be caught; return the decision and the one marker."""
        self.markers.clear()
        before = self.catcher.decision
        assert self.place(*place).success
        self.run(0.3)
        assert self.drop().success
        self.until(Phase.GROUNDED)
        (marker,) = self.markers.messages
        assert self.catcher.state is State.WAITING
        assert self.catcher.decision is not before and not self.catcher.decision.reachable
        return self.catcher.decision, marker


@pytest.fixture(scope='module')
def whole_bench():
    """Bring up arena and catcher, in a namespace."""
    with reserved_domain() as domain, graph(domain, namespace='left') as live:
        yield Bench(live)


@pytest.fixture
def bench(whole_bench):
    """Have a robot too, which stands level."""
    if not whole_bench.goals:
        whole_bench.bring_up_robot()
    whole_bench.run(0.5)
    return whole_bench


def test_without_a_robot_that_hears_it_nothing_is_reachable(domain_id, capfd):
    """It waits with one line, and says in another when all is in sight."""
    with graph(domain_id) as live:
        bench = Bench(live)
        decision, _ = bench.refuse(7.0, 7.0, 6.0)
        bench.bring_up_robot()
        bench.catch(5.0, 5.0, 6.0)
        assert [state.data for state in bench.states.messages] == [
            'waiting', f'unreachable: {decision.reason}',
            'approaching', 'carrying', 'tilting', 'leveling', 'waiting']
        late = live.record('catcher_state', String, LATCHED)
        live.wait_for(lambda: late.messages, PATIENCE, 'the state')
        assert late.last.data == 'waiting'
    lines = capfd.readouterr().err.splitlines()
    (waiting,) = [line for line in lines if 'Waiting for' in line]
    assert 'a robot that hears goal_pose and tilt' in waiting
    assert sum('Robot and brick are in sight' in line for line in lines) == 1
    assert sum(': unreachable, ' in line for line in lines) == 1
    assert sum('can be caught: down in' in line for line in lines) == 1
    assert not [line for line in lines if 'WARN' in line or 'ERROR' in line]


def test_latency_is_measured_and_clocks_that_disagree_are_seen(domain_id, capfd):
    """By the stamps of the moving frames."""
    with graph(domain_id) as live:
        node = live.add(CatcherNode)
        latency, clock = node.catcher.latency, node.get_clock()
        publisher = live.publisher('/tf', TFMessage)
        (heard,) = node.get_subscriptions_info_by_topic('/tf')
        assert heard.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT

        def excess(age, *frames):
            stamp = clock.now() - Duration(seconds=age)
            publisher.publish(TFMessage(transforms=[
                transform_message(WORLD, frame, stamp=stamp.to_msg()) for frame in frames]))
            return latency.excess(clock.now().nanoseconds)

        live.wait_for(lambda: excess(0.1, BRICK) > 0.18, PATIENCE, 'it is as slow as the brick')
        live.wait_for(lambda: excess(0.2, PLATFORM, 'nobody') > 0.38, PATIENCE, 'the platform')
        live.wait_for(lambda: excess(0.3, BASE_LINK) > 0.58, PATIENCE, 'the robot')
        assert 'chrony' not in capfd.readouterr().err
        live.wait_for(lambda: excess(-0.4, BASE_LINK) > 1.4, PATIENCE, 'stamps are ahead')
        live.wait_for(lambda: node.warned_of_clocks, PATIENCE, 'a warning')
    assert capfd.readouterr().err.count('chrony') == 1


def test_drops_one_after_another(bench):
    """From where the robot is; all names are relative: here they are in a namespace."""
    topics = {name for name, _ in bench.live.listener.get_topic_names_and_types()}
    assert {name for name in topics if not name.startswith('/left/')} <= {
        '/clock', '/parameter_events', '/rosout', '/tf', '/tf_static'}
    for place in ((6.0, 6.0), (3.5, 5.0)):
        bench.catch(*place, 8.0)
        goals = [(goal.pose.position.x, goal.pose.position.y) for goal in bench.goals.messages]
        assert dist(goals[0], place) < 1e-6 and goals[-1] == CENTER
        assert {goal.header.frame_id for goal in bench.goals.messages} == {'world'}
        angles = [tilt.angle for tilt in bench.tilts.messages]
        assert max(angles) == PARAMETERS.tilt_angle and angles[-1] == 0.0
        assert len(set(angles)) > 20  # smoothly


def test_unreachable_is_said_once_and_why(bench):
    """One text marker near the brick, for 3 s, in the world; the robot stays where it is."""
    place = bench.platform
    decision, marker = bench.refuse(0.5, 0.5, 4.0)
    assert 'too early' in decision.reason
    assert marker.text == 'Unreachable'
    assert marker.type == Marker.TEXT_VIEW_FACING and marker.action == Marker.ADD
    assert marker.header.frame_id == 'world'
    assert Duration.from_msg(marker.lifetime) == Duration(seconds=3)
    position = marker.pose.position
    assert dist((position.x, position.y), (0.5, 0.5)) < 1e-6
    assert 3.5 < position.z < 6.0
    assert 'outside' in bench.refuse(5.0, 11.2, 8.0)[0].reason
    assert bench.platform == place


def test_fall_that_comes_in_one_message(bench):
    """It is seen from its start, as after a machine stood still: the arena makes up for it all."""
    message = TFMessage()
    for step in range(1, 51):
        fallen = 0.5 * PARAMETERS.gravity_accel * (max(step - 10, 0) * STEP * 1e-9) ** 2
        message.transforms.append(transform_message(
            WORLD, BRICK, Pose((12.0, 6.0, 8.0 - fallen), IDENTITY),
            Time(nanoseconds=bench.now + step * STEP).to_msg()))
    bench.node.tf_listener.callback(message)
    fall = bench.catcher.decision.fall
    # Three samples of it after the last one at rest, or the one before shows little.
    assert fall.stamp - bench.now in (12 * STEP, 13 * STEP)
    assert (fall.x, fall.y) == (12.0, 6.0)
