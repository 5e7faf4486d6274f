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

"""turtle_robot in a live graph with turtlesim: rates, frames, goals and what it must refuse."""

from itertools import cycle
from math import cos, dist, inf, nan, sin

from geometry_msgs.msg import PoseStamped, Twist
from live_graph import graph, LATCHED, PATIENCE
from nav_msgs.msg import Odometry
import pytest
from sensor_msgs.msg import JointState
from tf2_ros import StaticTransformBroadcaster
from turtle_brick.core.geometry import from_yaw, Pose
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.ros.tf import transform_message
from turtle_brick_interfaces.msg import Tilt
from turtle_referee.domains import reserved_domain
from turtlesim.msg import Pose as TurtlePoseMessage
from turtlesim.srv import TeleportAbsolute

START = (3.0, 4.0, 1.0)
"""Where the turtle is, and its heading, when the robot sees it first."""


def goal_at(x, y, frame='world'):
    """Return a goal."""
    goal = PoseStamped()
    goal.header.frame_id = frame
    goal.pose.position.x, goal.pose.position.y = x, y
    return goal


class Bench:
    """The robot with a turtle, and recordings of both."""

    def __init__(self, live):
        """Bring up the robot, and wait until it and the turtle see each other."""
        self.live = live
        self.poses = live.record('turtle1/pose', TurtlePoseMessage)
        self.teleport(*START)
        self.robot = live.add_robot()
        self.commands = live.record('turtle1/cmd_vel', Twist)
        self.odometry = live.record('odom', Odometry)
        self.joints = live.record('joint_states', JointState)
        self.base_link = live.record_transforms('base_link')
        self.goals = live.publisher('goal_pose', PoseStamped)
        self.tilts = live.publisher('tilt', Tilt)
        self.outputs = [self.commands, self.odometry, self.joints, self.base_link]
        live.wait_for(lambda: all(output.messages for output in self.outputs) and
                      self.robot.cmd_vel_publisher.get_subscription_count() >= 2,
                      PATIENCE, 'turtle and robot to see each other')

    @property
    def pose(self):
        """Return the last pose of the turtle."""
        return self.poses.last

    def send(self, x, y, frame='world'):
        """Send a goal."""
        self.goals.publish(goal_at(x, y, frame))

    def teleport(self, x, y, theta):
        """Teleport the turtle."""
        self.live.call('turtle1/teleport_absolute', TeleportAbsolute,
                       TeleportAbsolute.Request(x=x, y=y, theta=theta))
        self.live.wait_for(
            lambda: self.pose and dist((self.pose.x, self.pose.y, self.pose.theta), (x, y, theta))
            < 1e-3, PATIENCE, 'its pose to show it')
        self.next(self.poses)

    def arrive(self, x, y):
        """Wait until the turtle stands at a place, within 5 mm, and nothing else is asked for."""
        # On a busy machine it may overshoot, and come back.
        self.live.wait_for(
            lambda: dist((self.pose.x, self.pose.y), (x, y)) < 0.005
            and self.pose.linear_velocity == 0.0
            and self.commands.messages[-20:] == 20 * [Twist()],
            PATIENCE, f'the turtle at ({x}, {y})')

    def next(self, recording):
        """Let 20 more messages come; return them."""
        recording.clear()
        self.live.wait_for(lambda: len(recording.messages) >= 20, PATIENCE, '20 messages')
        return recording.messages


@pytest.fixture(scope='module')
def bench():
    """Bring up turtlesim and the robot."""
    with reserved_domain() as domain, graph(domain, namespace='left') as live:
        live.add_turtlesim()
        yield Bench(live)


@pytest.fixture
def warned(bench, capfd):
    """Return a function that tells what the robot has warned of since, from standard error."""
    def warned():
        return [line for line in capfd.readouterr().err.splitlines()
                if '[WARN]' in line and 'turtle_robot]' in line]

    warned()
    return warned


def test_odom_is_the_first_pose_heading_included(bench):
    """World to odom is latched, said once, and outlives teleports, which roll no wheel."""
    wheel = bench.robot.odometer.wheel_angle
    bench.teleport(8.0, 2.0, -2.0)
    statics = bench.live.record_transforms('odom', '/tf_static', LATCHED)
    bench.live.wait_for(lambda: statics.messages, PATIENCE, 'a late joiner gets world -> odom')
    seen = bench.next(bench.odometry)[-1].pose.pose.position
    (transform,) = statics.messages
    assert transform.header.frame_id == 'world'
    place, turn = transform.transform.translation, transform.transform.rotation
    assert (place.x, place.y, place.z) == pytest.approx((3.0, 4.0, 0.0), abs=1e-6)
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx(from_yaw(1.0), abs=1e-6)
    # In odom the turtle is where a look from there would find it.
    assert (seen.x, seen.y) == pytest.approx(
        (5.0 * cos(1.0) - 2.0 * sin(1.0), -5.0 * sin(1.0) - 2.0 * cos(1.0)), abs=1e-5)
    assert bench.robot.odometer.wheel_angle == wheel


def test_each_output_comes_at_100_hz_idle_and_driving(bench):
    """
    Within 1 %, by when it is published, from one publisher.

    At the same instants the odometry equals the transform, and its twist is the command.
    """
    assert bench.live.rates(bench.outputs, 100) == pytest.approx([100.0] * 4, rel=0.01)
    corners = cycle([(1.0, 1.0), (10.0, 1.0), (10.0, 10.0), (1.0, 10.0)])
    timer = bench.live.listener.create_timer(0.8, lambda: bench.send(*next(corners)))
    bench.live.wait_for(lambda: bench.pose.linear_velocity > 0.0, PATIENCE, 'the robot drives')
    assert bench.live.rates(bench.outputs, 100) == pytest.approx([100.0] * 4, rel=0.01)
    bench.live.listener.destroy_timer(timer)
    for topic in ('turtle1/cmd_vel', 'odom', 'joint_states'):
        assert bench.live.listener.count_publishers(topic) == 1, topic
    assert sum(command != Twist() for command in bench.commands.messages) > 50
    transforms = {(t.header.stamp.sec, t.header.stamp.nanosec): t.transform
                  for t in bench.base_link.messages}
    for odometry in bench.odometry.messages[10:90]:  # those at the ends may have come alone
        assert (odometry.header.frame_id, odometry.child_frame_id) == ('odom', 'base_link')
        transform = transforms[odometry.header.stamp.sec, odometry.header.stamp.nanosec]
        pose = odometry.pose.pose
        assert pose.orientation == transform.rotation
        assert (pose.position.x, pose.position.y, pose.position.z) == (
            transform.translation.x, transform.translation.y, 0.0)
    twists = [odometry.twist.twist for odometry in bench.odometry.messages]
    assert all(command in twists for command in bench.commands.messages[10:90])


def test_goals_in_frames_of_its_own_and_of_others(bench):
    """TF is listened to from the first goal on that needs it, and a frame may come after it."""
    live = bench.live
    bench.send(1.0, -1.0, 'odom')
    bench.arrive(3.0 + cos(1.0) + sin(1.0), 4.0 + sin(1.0) - cos(1.0))
    bench.send(4.0, 3.0)
    bench.arrive(4.0, 3.0)
    assert max(pose.linear_velocity for pose in bench.poses.messages) == pytest.approx(3.0)
    heading = bench.pose.theta
    bench.send(1.0, 0.5, 'base_link')
    bench.arrive(4.0 + cos(heading) - 0.5 * sin(heading), 3.0 + sin(heading) + 0.5 * cos(heading))
    assert bench.robot.tf_listener is None
    broadcaster = StaticTransformBroadcaster(live.listener)
    broadcaster.sendTransform(transform_message(
        'odom', 'beside', Pose((0.0, 1.0, 0.0), from_yaw(-1.0))))
    bench.send(0.5, 1.0, 'beside')
    bench.arrive(3.0 - sin(1.0) + 0.5, 4.0 + cos(1.0) + 1.0)
    bench.send(0.5, 0.5, 'elsewhere')
    live.wait_for(lambda: bench.robot.pending, PATIENCE, 'the goal to wait for its frame')
    bench.send(nan, 0.5)  # changes nothing
    broadcaster.sendTransform(transform_message(
        'world', 'elsewhere', Pose((2.0, 3.0, 0.0), from_yaw(0.0))))
    bench.arrive(2.5, 3.5)
    bench.send(0.5, 0.5, 'nowhere')
    live.wait_for(lambda: bench.robot.pending, PATIENCE, 'the goal to wait for its frame')
    bench.send(3.0, 3.0)  # takes its place
    bench.arrive(3.0, 3.0)
    assert bench.robot.pending is None


def test_goals_that_make_no_sense(bench, warned):
    """Each is refused with one warning that names it, and changes nothing."""
    bench.send(7.0, 6.0, '')  # As `ros2 topic pub --once goal_pose` sends it.
    bench.arrive(7.0, 6.0)
    assert warned() == []
    for x, y, frame, word in ((nan, 1.0, 'world', 'nan'), (1.0, inf, 'world', 'inf'),
                              (1.0, 1.0, 'nowhere', '"nowhere"')):
        bench.send(x, y, frame)
        assert all(command == Twist() for command in bench.next(bench.commands))
        bench.live.wait_for(lambda: not bench.robot.pending, PATIENCE, 'no goal waits')
        (warning,) = warned()
        assert word in warning
    bench.robot.drive_to(Pose((1e308, 1e308, 0.0), from_yaw(0.8)), (1.7e308, 1.7e308, 0.0))
    (warning,) = warned()
    assert 'too far' in warning and len(warning) < 300
    assert all(command == Twist() for command in bench.next(bench.commands))
    bench.send(14.0, 6.0)  # makes sense as far as the wall
    bench.arrive(ARENA_SIZE, 6.0)
    (warning,) = warned()
    assert 'outside the arena' in warning and '(14, 6)' in warning


def test_the_platforms_joint_is_the_last_finite_tilt(bench, warned):
    assert list(bench.joints.last.name) == ['stem_joint', 'wheel_joint', 'platform_joint']
    for angle in (0.5, -7.0):
        bench.tilts.publish(Tilt(angle=angle))
        bench.live.wait_for(lambda: bench.joints.last.position[2] == angle, PATIENCE,
                            f'tilted by {angle}')
    for bad in (nan, -inf):
        bench.tilts.publish(Tilt(angle=bad))
        assert bench.next(bench.joints)[-1].position[2] == -7.0
        (warning,) = warned()
        assert str(bad) in warning


def test_without_a_turtle(domain_id, capfd):
    """Nothing is to move, and poses that no turtle has change nothing."""
    with graph(domain_id) as live:
        robot = live.add_robot()
        commands, odometry = live.record('turtle1/cmd_vel', Twist), live.record('odom', Odometry)
        for x, y, velocity in ((1e30, 5.0, 1.0), (-3.0, 5.0, 1.0), (nan, 5.0, 1.0),
                               (5.0, 5.0, inf)):
            robot.on_pose(TurtlePoseMessage(x=x, y=y, linear_velocity=velocity))
        assert robot.odometer.origin is None and robot.driver.pose is None
        robot.on_goal(goal_at(1.0, 1.0, 'base_link'))
        live.wait_for(lambda: not robot.pending, PATIENCE, 'the goal to be given up')
        assert not odometry.messages
        assert commands.messages and all(message == Twist() for message in commands.messages)
    warnings = [line for line in capfd.readouterr().err.splitlines() if '[WARN]' in line]
    assert sum('that no turtle has' in line for line in warnings) == 4
    assert sum('Ignored a goal in the frame "base_link"' in line for line in warnings) == 1
