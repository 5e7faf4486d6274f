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

"""The whole graph, live: what is caught, what is called Unreachable, and what may go wrong."""

from itertools import groupby, product
from math import cos, dist, nan, sin
from time import time_ns

from geometry_msgs.msg import PoseStamped
from live_graph import graph, LiveGraph, PATIENCE
import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformBroadcaster, TransformException, TransformListener
from turtle_brick.core.catch_logic import CENTER, State
from turtle_brick.core.geometry import IDENTITY, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.reachability import guaranteed_distance, resting_height
from turtle_brick.core.time_steps import NANOSECONDS, nanoseconds_of
from turtle_brick.physics import Phase, STEP
from turtle_brick.ros.tf import BRICK, latest, PLATFORM, pose_of, transform_message, WORLD
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtle_referee.domains import reserved_domain
from turtlesim.msg import Pose as TurtlePoseMessage
from visualization_msgs.msg import Marker

PARAMETERS = load()
REST = resting_height(PARAMETERS)
EASY = 30.0
"""From where (m) a brick falls for 2.4 s: time enough on a machine that does much else, too."""


class Bench:
    """The whole graph, and what is heard of it."""

    def __init__(self, live: LiveGraph) -> None:
        """Bring it up, those first who need the others; see that they wait quietly."""
        self.live = live
        self.catcher, self.arena = live.add_catcher(), live.add_arena()
        live.add_robot_state_publisher()
        self.robot = live.add_robot()
        live.pass_time(0.2)
        live.add_turtlesim()
        self.markers = live.record('catcher_marker', Marker)
        self.tilts = live.record('tilt', Tilt)
        self.goals = live.record('goal_pose', PoseStamped)
        self.poses = live.record('turtle1/pose', TurtlePoseMessage)
        live.wait_for(
            lambda: self.catcher.complete and self.arena.world.platform is not None
            and self.poses.messages and all(publisher.get_subscription_count() >= count for
                                            publisher, count in (
                (self.catcher.goal_publisher, 2), (self.catcher.tilt_publisher, 2),
                (self.catcher.marker_publisher, 1))), PATIENCE, 'all frames are there')

    @property
    def state(self):
        """Return what the catcher does."""
        return self.catcher.catcher.state

    @property
    def decision(self):
        """Return what the catcher decided last."""
        return self.catcher.catcher.decision

    @property
    def place(self):
        """Return where the robot is (m)."""
        return (self.poses.last.x, self.poses.last.y)

    def put(self, x, y, z):
        """Place the brick, and let the catcher see it there for a while."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = x, y, z
        assert self.live.call('place', Place, request).success
        self.live.pass_time(0.3)

    def release(self):
        """Drop the brick."""
        assert self.live.call('drop', Trigger).success

    def until(self, what):
        """Wait until the catcher is in a state, or the brick in a phase."""
        self.live.wait_for(lambda: what in (self.state, self.arena.world.phase), PATIENCE,
                           what.value)

    def rest(self):
        """Wait until the robot stands, level."""
        def is_at_rest():
            last = self.poses.messages[-10:]
            return all(pose.linear_velocity == 0.0 for pose in last) and (
                self.robot.tilt_angle == 0.0)

        self.live.wait_for(is_at_rest, PATIENCE, 'the robot at rest')

    def catch(self, x, y, z):
        """Drop a brick that is in reach, and see that it is caught, carried and tipped off."""
        self.rest()
        self.put(x, y, z)
        before, said = self.decision, len(self.markers.messages)
        assert dist(self.place, (x, y)) < guaranteed_distance(z, PARAMETERS)
        for recording in (self.goals, self.tilts):
            recording.clear()
        self.release()
        self.until(State.CARRYING)
        assert self.decision is not before and self.decision.reachable
        assert self.arena.world.phase is Phase.RIDING
        self.until(State.TILTING)
        assert dist(self.place, CENTER) < 0.05
        self.until(State.WAITING)
        assert self.arena.world.phase is Phase.FLOATING
        goals = [(goal.pose.position.x, goal.pose.position.y) for goal in self.goals.messages]
        assert dist(goals[0], (x, y)) < 1e-6 and goals[-1] == CENTER
        assert {goal.header.frame_id for goal in self.goals.messages} == {'world'}
        self.live.wait_for(lambda: self.tilts.last.angle == 0.0, PATIENCE, 'the order to level')
        angles = [0.0, *(tilt.angle for tilt in self.tilts.messages)]
        assert max(angles) == PARAMETERS.tilt_angle
        assert len(set(angles)) > 10  # smoothly
        assert len(self.markers.messages) == said

    def verdict(self, x, y, z):
        """Drop a brick that can't be caught; return the decision and the one marker."""
        self.rest()
        self.put(x, y, z)
        self.markers.clear()
        self.release()
        self.until(Phase.GROUNDED)
        self.live.wait_for(lambda: self.markers.messages, PATIENCE, 'Unreachable')
        self.live.pass_time(0.2)
        (marker,) = self.markers.messages
        assert self.state is State.WAITING and not self.decision.reachable
        return self.decision, marker


@pytest.fixture(scope='module')
def bench():
    """Bring up the whole graph."""
    with reserved_domain() as domain, graph(domain) as live:
        yield Bench(live)


def test_drops_in_a_namespace_whoever_came_first(domain_id, capfd):
    """They wait with one line at most, and all that is relative is in the namespace."""
    with graph(domain_id, namespace='/left') as live:
        bench = Bench(live)
        lines = capfd.readouterr().err.splitlines()
        assert sum('Waiting for' in line for line in lines) <= 1
        assert not [line for line in lines if 'WARN' in line or 'ERROR' in line]
        topics = {name for name, _ in live.listener.get_topic_names_and_types()}
        assert not {'/cmd_vel', '/odom', '/goal_pose', '/tilt', '/turtle1/pose'} & topics
        assert {'/left/turtle1/cmd_vel', '/left/odom', '/left/joint_states', '/left/goal_pose',
                '/left/walls', '/left/brick_marker', '/left/tilt', '/tf'} <= topics
        bench.catch(6.0, 6.0, EASY)


def test_drops_one_after_another(bench):
    """From where the robot is, with two seconds to spare: the limit is core's."""
    bench.catch(6.0, 6.0, EASY)
    bench.catch(4.5, 5.0, EASY)


def test_unreachable_is_said_once_and_why(bench):
    """One text marker near the brick, for 3 s, in the world; the robot stays where it is."""
    bench.rest()
    place = bench.place
    _, marker = bench.verdict(0.5, 0.5, 4.0)
    assert marker.text == 'Unreachable'
    assert marker.type == Marker.TEXT_VIEW_FACING and marker.action == Marker.ADD
    assert marker.header.frame_id == 'world'
    assert Duration.from_msg(marker.lifetime) == Duration(seconds=3)
    position = marker.pose.position
    assert dist((position.x, position.y), (0.5, 0.5)) < 1e-6
    assert 3.5 < position.z < 6.0
    for brick, word in (((CENTER[0] + 0.1, CENTER[1], REST - 0.2), 'below'),
                        ((-0.1, 5.0, 8.0), 'outside'), ((5.0, 11.2, 8.0), 'outside')):
        decision, _ = bench.verdict(*brick)
        assert word in decision.reason
    assert dist(bench.place, place) < 1e-5


def test_brick_taken_away_while_it_is_tipped_off(bench):
    """The robot levels, waits, and catches the next; other stages are core's."""
    bench.rest()
    bench.put(6.0, 6.0, 9.0)
    bench.tilts.clear()
    bench.release()
    bench.until(State.TILTING)
    bench.live.wait_for(lambda: bench.tilts.messages and bench.tilts.last.angle > 0.1, PATIENCE,
                        'tilted')
    bench.put(2.0, 3.0, 6.0)
    bench.until(State.WAITING)
    bench.rest()
    assert bench.arena.world.phase is Phase.HOVERING
    bench.catch(CENTER[0] - 0.6, CENTER[1] + 0.4, EASY)


def test_caught_while_driving(bench):
    """A robot that somebody sends about catches what it says it can, also while it moves."""
    goals = bench.live.publisher('goal_pose', PoseStamped)
    bench.rest()
    bench.put(*CENTER, 8.0)
    goal = PoseStamped()
    goal.header.frame_id = 'world'
    goal.pose.position.x = CENTER[0] + 4.0 * cos(2.5)
    goal.pose.position.y = CENTER[1] + 4.0 * sin(2.5)
    goals.publish(goal)
    bench.live.wait_for(lambda: bench.poses.last.linear_velocity > 0.0, PATIENCE, 'it drives')
    bench.live.pass_time(0.3)
    before = bench.decision
    bench.release()
    bench.live.wait_for(lambda: bench.decision is not before, PATIENCE, 'decided')
    assert bench.decision.reachable
    assert bench.decision.distance < guaranteed_distance(8.0, PARAMETERS)
    bench.until(State.CARRYING)
    assert bench.arena.world.phase is Phase.RIDING
    bench.until(State.WAITING)


def test_brick_does_not_move_on_the_platform(bench):
    """However late what is heard: while it rides it has one place in the platform's frame."""
    transforms = bench.live.record_transforms('brick')
    buffer = Buffer()
    listener = TransformListener(buffer, bench.live.listener)
    seen = []

    def look():
        try:
            found = buffer.lookup_transform('platform', 'brick', Time())
        except TransformException:
            return
        if transforms.messages and transforms.last.header.frame_id == 'platform':
            seen.append((bench.state, pose_of(found.transform)))

    bench.rest()
    bench.put(6.0, 6.0, 9.0)
    transforms.clear()
    bench.release()
    bench.until(State.CARRYING)
    # What is looked up is up to a cycle of the robot older than the latest transform of the brick.
    bench.live.pass_time(0.05)
    timer = bench.live.listener.create_timer(1.0 / 60.0, look)
    bench.until(State.WAITING)
    bench.live.listener.destroy_timer(timer)
    listener.unregister()
    carried = [pose for state, pose in seen if state is State.CARRYING]
    tipped = [pose for state, pose in seen if state is State.TILTING]
    assert len(carried) > 5 and len(tipped) > 10
    for pose in carried:
        assert dist(pose.position, carried[0].position) < 1e-9
    for pose in carried + tipped:
        assert pose.position[2] == pytest.approx(carried[0].position[2], abs=1e-9)
        assert dist(pose.orientation, carried[0].orientation) < 1e-9
    # Floating, falling and hovering it is in the world, each step of it once.
    stamps = [nanoseconds_of(transform.header.stamp) for transform in transforms.messages]
    assert stamps == sorted(set(stamps))
    assert {later - earlier for earlier, later in zip(stamps, stamps[1:])} <= {STEP}
    frames = [transform.header.frame_id for transform in transforms.messages]
    assert [frame for frame, _ in groupby(frames)] == ['world', 'platform', 'world']


def test_hostile_transforms(bench, capfd):
    """What anybody may put on TF blinds nobody for long, and little is logged."""
    latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    moving = bench.live.publisher('/tf', TFMessage, readers=2)
    static = bench.live.publisher('/tf_static', TFMessage, latched, readers=2)
    capfd.readouterr()
    now = bench.arena.get_clock().now().nanoseconds
    hour = 3600 * NANOSECONDS
    frames = (BRICK, PLATFORM, 'base_link', 'odom', 'post', WORLD)
    for parent, child in product((*frames, 'nowhere'), frames):
        if parent == child:
            continue
        for stamp, x in ((-hour, 0.0), (now + hour, 0.0), (now, nan), (now, 1e308), (now, 1.0)):
            bad = transform_message(parent, child, Pose((x, 0.0, 3.0), IDENTITY))
            bad.header.stamp.sec, bad.header.stamp.nanosec = divmod(stamp, NANOSECONDS)
            if x != 1.0 or child not in ('odom', 'post'):  # tf2 believes the last who tells these.
                moving.publish(TFMessage(transforms=[bad]))
                static.publish(TFMessage(transforms=[bad]) if x else TFMessage())
        bench.live.pass_time(0.005)
    bench.live.pass_time(0.2)
    assert len(capfd.readouterr().err.splitlines()) <= 20
    bench.catch(6.0, 6.0, EASY)


def test_joint_states_from_another_time(bench):
    """They hold back nothing: the platform is seen to tilt, and the brick slides off it."""
    states = bench.live.publisher('joint_states', JointState)
    platform = bench.live.record_transforms(PLATFORM)
    bench.put(*CENTER, 7.0)
    bench.release()
    bench.until(State.TILTING)
    state = JointState(name=['stem_joint', 'wheel_joint', 'platform_joint'], position=[0.0] * 3)
    state.header.stamp = Time(
        nanoseconds=bench.arena.get_clock().now().nanoseconds + 3600 * NANOSECONDS).to_msg()
    # They are best effort, and one may get lost.
    bench.live.wait_for(
        lambda: states.publish(state) or any(transform.header.stamp == state.header.stamp
                                             for transform in platform.messages), PATIENCE,
        'a transform from another time')
    bench.until(State.WAITING)
    assert bench.arena.world.phase is Phase.FLOATING


class Thrower(Node):
    """Somebody else's brick and platform: at 50 Hz, the brick hovers, falls and lies."""

    def __init__(self, **node_options):
        """Hover."""
        super().__init__('thrower', **node_options)
        self.platform = CENTER
        self.hover(5.8, 5.5, 8.0)
        self.broadcaster = TransformBroadcaster(self)
        self.create_timer(0.02, self.on_timer)

    def hover(self, x, y, z):
        """Let the brick hover."""
        self.place, self.released = (x, y, z), None

    def on_timer(self):
        """Say where platform and brick are."""
        now = self.get_clock().now()
        x, y, z = self.place
        if self.released is not None:
            time = (now - self.released).nanoseconds * 1e-9
            z = max(z - 0.5 * PARAMETERS.gravity_accel * time * time, REST)
        hinge = PARAMETERS.platform_height - PARAMETERS.platform_thickness
        self.broadcaster.sendTransform([
            transform_message(WORLD, frame, Pose(place, IDENTITY), now.to_msg())
            for frame, place in ((BRICK, (x, y, z)), (PLATFORM, (*self.platform, hinge)))])


def test_brick_and_robot_of_others(domain_id):
    """
    Any frames will do; but orders to nobody are lost: without a robot all is unreachable.

    And a fall that comes in one message is seen, as after a machine stood still: the arena makes
    up for all of its steps at once.
    """
    with graph(domain_id, quiet=True) as live:
        catcher = live.add_catcher()
        now, message = catcher.get_clock().now().nanoseconds, TFMessage()
        for step in range(1, 51):
            fallen = 0.5 * PARAMETERS.gravity_accel * (max(step - 10, 0) * STEP * 1e-9) ** 2
            message.transforms.append(transform_message(
                WORLD, BRICK, Pose((12.0, 6.0, 8.0 - fallen), IDENTITY),
                Time(nanoseconds=now + step * STEP).to_msg()))
        catcher.tf_listener.callback(message)
        fall = catcher.catcher.decision.fall
        # Three samples of it after the last one at rest, or the one before shows little.
        assert fall.stamp - now in (12 * STEP, 13 * STEP)
        assert (fall.x, fall.y) == (12.0, 6.0)

        thrower = live.add(Thrower, parameters=False)

        def fall_again():
            live.pass_time(0.3)
            before, thrower.released = catcher.catcher.decision, thrower.get_clock().now()
            live.wait_for(lambda: catcher.catcher.decision is not before, PATIENCE, 'decided')
            return catcher.catcher.decision.reachable

        live.wait_for(lambda: all(latest(catcher.tf_buffer, frame) for frame in (PLATFORM, BRICK)),
                      PATIENCE, 'robot and brick are in sight')
        assert not fall_again()
        assert not catcher.complete
        thrower.hover(7.0, 6.0, 8.0)
        goals, _ = live.record('goal_pose', PoseStamped), live.record('tilt', Tilt)
        live.wait_for(lambda: catcher.complete, PATIENCE, 'the catcher is heard')
        assert fall_again()
        live.wait_for(lambda: goals.messages, PATIENCE, 'an order')
        place = goals.last.pose.position
        assert (place.x, place.y) == pytest.approx((7.0, 6.0))
        thrower.platform = (place.x, place.y)
        live.wait_for(lambda: catcher.catcher.state is State.CARRYING, PATIENCE, 'recognized')


class SimulatedTime(Node):
    """Simulated time: the system's, with an offset that may change."""

    def __init__(self, **node_options):
        """Begin with the system's time."""
        super().__init__('time', **node_options)
        self.offset = 0
        self.publisher = self.create_publisher(Clock, '/clock', 1)
        self.create_timer(0.002, self.on_timer)

    def on_timer(self):
        """Say what time it is."""
        self.publisher.publish(Clock(
            clock=Time(nanoseconds=time_ns() + self.offset).to_msg()))


def test_clock_that_is_set_back(domain_id):
    """The catcher starts afresh, waiting and level, and the next brick is caught."""
    with graph(domain_id, overrides={'use_sim_time': True}, quiet=True) as live:
        time = live.add(SimulatedTime, parameters=False)
        bench = Bench(live)
        for back in (3600, 5):
            bench.put(6.0, 6.0, 9.0)
            bench.release()
            bench.until(State.CARRYING)
            time.offset -= back * NANOSECONDS
            bench.until(State.WAITING)
            bench.rest()
            # What was under way then, with stamps from before the jump, is out of the way.
            bench.live.pass_time(1.0)
        bench.catch(CENTER[0] - 0.6, CENTER[1] + 0.4, EASY)
