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
from math import cos, hypot, nan, pi, sin

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
import pytest
from rclpy.qos import DurabilityPolicy
from sensor_msgs.msg import JointState
from tf2_ros import StaticTransformBroadcaster
from turtle_brick.core.geometry import from_yaw
from turtle_brick.core.geometry import Pose as Pose3D
from turtle_brick.core.geometry import yaw_of
from turtle_brick.ros.tf import transform_message
from turtle_brick.tools.graph import Graph
from turtle_brick_interfaces.msg import Tilt
from turtlesim.msg import Pose
from turtlesim.srv import TeleportAbsolute
from witness import measure, Witness

CENTER = 5.544444561004639


@pytest.fixture
def graph(domain_id):
    """Make an empty graph in a ROS domain of its own."""
    with Graph(domain_id) as graph:
        yield graph


class Bench:
    """Turtlesim, the robot, and a witness of both."""

    def __init__(self, graph):
        """Bring them up."""
        self.graph = graph
        self.turtlesim = graph.add_turtlesim()
        self.robot = graph.add_robot()
        self.witness = graph.add(Witness, parameters=False)
        self.poses = self.witness.record(Pose, 'turtle1/pose')
        self.commands = self.witness.record(Twist, 'turtle1/cmd_vel')
        self.odometry = self.witness.record(Odometry, 'odom')
        self.joints = self.witness.record(JointState, 'joint_states')
        self.base_link = self.witness.record_transforms('base_link')
        self.goals = self.witness.create_publisher(PoseStamped, 'goal_pose', 10)
        self.tilts = self.witness.create_publisher(Tilt, 'tilt', 10)
        graph.spin_until(
            lambda: self.poses and self.commands and self.odometry and self.joints
            and self.base_link and self.goals.get_subscription_count()
            and self.tilts.get_subscription_count()
            and self.robot.cmd_vel_publisher.get_subscription_count() >= 2,
            20.0, 'turtlesim and robot see each other')

    @property
    def outputs(self):
        """Return the four recordings of what is published at 100 Hz."""
        return [self.commands, self.odometry, self.joints, self.base_link]

    @property
    def pose(self):
        """Return the last pose of the turtle."""
        return self.poses[-1][1]

    def send(self, x, y, frame='world'):
        """Send a goal."""
        goal = PoseStamped()
        goal.header.frame_id = frame
        goal.pose.position.x, goal.pose.position.y = float(x), float(y)
        self.goals.publish(goal)

    def teleport(self, x, y, theta):
        """Teleport the turtle."""
        client = self.witness.create_client(TeleportAbsolute, 'turtle1/teleport_absolute')
        self.graph.spin_until(client.service_is_ready, 10.0, 'teleport_absolute is served')
        future = client.call_async(TeleportAbsolute.Request(x=x, y=y, theta=theta))
        self.graph.spin_until(future.done, 5.0, 'the turtle is teleported')
        self.graph.spin_until(lambda: hypot(self.pose.x - x, self.pose.y - y) < 1e-3, 5.0,
                              'its pose shows it')

    def at_rest(self, x, y):
        """Tell whether the turtle stands at a place, within 5 mm."""
        return (hypot(self.pose.x - x, self.pose.y - y) < 0.005
                and self.pose.linear_velocity == 0.0)

    def arrive(self, x, y, timeout=10.0):
        """Wait until the turtle stands at a place."""
        self.graph.spin_until(lambda: self.at_rest(x, y), timeout, f'arrived at ({x}, {y})')

    def stand(self):
        """Wait until the robot has asked for no motion for as long as a command takes."""
        self.graph.spin_until(
            lambda: len(self.commands) > 10 and all(
                command == Twist() for _, command in self.commands[-10:]), 5.0, 'standing')


@pytest.fixture
def bench(graph):
    """Bring up turtlesim and the robot."""
    return Bench(graph)


def warnings(caught):
    """Return what nodes have warned of, from the process's standard error."""
    return [line for line in caught.readouterr().err.splitlines() if '[WARN]' in line]


def test_rates_idle_and_driving(bench):
    """Each output comes at 100 Hz, within 0.5 %, at rest and driving, from one publisher."""
    for driving in (False, True):
        if driving:
            corners = cycle([(1.0, 1.0), (10.0, 1.0), (10.0, 10.0), (1.0, 10.0)])
            bench.witness.create_timer(0.8, lambda: bench.send(*next(corners)))
            bench.graph.spin_until(
                lambda: bench.pose.linear_velocity > 0.0, 5.0, 'the robot drives')
        rates = measure(bench.graph, bench.outputs, 5.0)
        assert rates == pytest.approx([100.0] * 4, rel=0.005), f'driving: {driving}'
        if driving:
            moving = sum(command != Twist() for _, command in bench.commands)
            assert moving > 0.5 * len(bench.commands)
    for topic in ('turtle1/cmd_vel', 'odom', 'joint_states', 'goal_pose', 'tilt'):
        assert bench.witness.count_publishers(topic) == 1, topic


def test_commands_before_any_pose(graph):
    """Without a turtle the robot says 100 times per second that nothing is to move."""
    graph.add_robot()
    witness = graph.add(Witness, parameters=False)
    commands = witness.record(Twist, 'turtle1/cmd_vel')
    joints = witness.record(JointState, 'joint_states')
    odometry = witness.record(Odometry, 'odom')
    transforms = witness.record_transforms('base_link')
    assert measure(graph, [commands, joints], 2.0) == pytest.approx([100.0, 100.0], rel=0.01)
    assert all(message == Twist() for _, message in commands)
    assert not odometry and not transforms


def test_odometry_equals_transform_and_twist_the_command(bench):
    """Odom and TF say the same at the same instants; the twist is a copy of cmd_vel."""
    for recording in bench.outputs:
        recording.clear()
    bench.send(8.0, 7.0)
    bench.graph.spin_for(0.4)
    bench.send(3.0, 5.0)
    bench.graph.spin_for(0.4)
    transforms = {(t.header.stamp.sec, t.header.stamp.nanosec): t.transform
                  for _, t in bench.base_link}
    commands = [message for _, message in bench.commands]
    compared = 0
    for _, odometry in bench.odometry:
        assert (odometry.header.frame_id, odometry.child_frame_id) == ('odom', 'base_link')
        stamp = odometry.header.stamp
        transform = transforms.get((stamp.sec, stamp.nanosec))
        if transform is None:
            continue  # The very last may not have come yet.
        pose = odometry.pose.pose
        assert pose.orientation == transform.rotation
        assert (pose.position.x, pose.position.y, pose.position.z) == (
            transform.translation.x, transform.translation.y, 0.0)
        assert odometry.twist.twist in commands
        compared += 1
    assert compared > 60
    assert {odometry.twist.twist.linear.x for _, odometry in bench.odometry} >= {
        command.linear.x for command in commands[5:-5]}


def test_odom_is_the_first_pose_heading_included(graph):
    """World to odom is the first pose, latched, and outlives teleports."""
    bench = Bench(graph)
    first = bench.poses[0][1]
    graph.remove(bench.robot)
    bench.teleport(3.0, 4.0, 1.0)
    robot = graph.add_robot()
    graph.spin_until(lambda: robot.odometer.pose is not None, 10.0, 'the robot sees the turtle')
    bench.robot = robot
    bench.teleport(8.0, 2.0, -2.0)
    late = graph.add(Witness, parameters=False)
    statics = late.record_transforms(
        'odom', '/tf_static', durability=DurabilityPolicy.TRANSIENT_LOCAL)
    graph.spin_until(lambda: statics, 10.0, 'a late joiner gets world -> odom')
    graph.spin_for(0.3)
    assert len(statics) == 1
    transform = statics[0][1]
    assert (first.x, first.y) == (CENTER, CENTER)
    assert transform.header.frame_id == 'world'
    translation = transform.transform.translation
    assert (translation.x, translation.y) == pytest.approx((3.0, 4.0), abs=1e-6)
    rotation = transform.transform.rotation
    assert yaw_of((rotation.x, rotation.y, rotation.z, rotation.w)) == pytest.approx(1.0, abs=1e-6)
    # In odom the turtle is where a look from there would find it.
    dx, dy = 8.0 - 3.0, 2.0 - 4.0
    assert robot.odometer.pose.x == pytest.approx(cos(1.0) * dx + sin(1.0) * dy, abs=1e-5)
    assert robot.odometer.pose.y == pytest.approx(-sin(1.0) * dx + cos(1.0) * dy, abs=1e-5)
    assert robot.odometer.wheel_angle == 0.0


def test_drives_straight_whatever_its_heading(bench):
    """A teleported turtle with any theta goes straight to its goal, in the body's own frame."""
    bench.teleport(2.0, 2.0, 2.5)
    bench.poses.clear()
    bench.send(6.0, 5.0)
    bench.graph.spin_until(lambda: bench.poses, 5.0, 'a pose')
    bench.arrive(6.0, 5.0)
    for _, pose in bench.poses:
        # Distance from the line from (2, 2) to (6, 5).
        assert abs(3.0 * (pose.x - 2.0) - 4.0 * (pose.y - 2.0)) / 5.0 < 0.01
    speeds = [pose.linear_velocity for _, pose in bench.poses]
    assert max(speeds) <= 3.0 + 1e-6
    assert max(speeds) == pytest.approx(3.0)
    bench.stand()
    bench.commands.clear()
    bench.graph.spin_until(lambda: len(bench.commands) > 50, 5.0, '50 commands')
    assert all(command == Twist() for _, command in bench.commands)


def test_goals_in_other_frames(bench):
    """A goal in odom or base_link is where that frame puts it."""
    bench.teleport(4.0, 3.0, pi / 2.0)
    bench.graph.spin_until(
        lambda: abs(bench.base_link[-1][1].transform.translation.x - (4.0 - CENTER)) < 1e-3,
        5.0, 'TF shows the teleport')
    bench.send(1.0, 0.5, 'base_link')
    bench.arrive(3.5, 4.0)
    bench.send(1.0, -1.0, 'odom')
    bench.arrive(CENTER + 1.0, CENTER - 1.0)


def test_goals_in_frames_of_others(bench):
    """TF is listened to from the first goal on that needs it, and a frame may come after it."""
    bench.teleport(6.0, 4.0, pi / 2.0)
    broadcaster = StaticTransformBroadcaster(bench.witness)
    ahead = transform_message(
        'base_link', 'ahead', Pose3D((1.0, 0.0, 0.0), from_yaw(pi / 2.0)))
    elsewhere = transform_message(
        'world', 'elsewhere', Pose3D((2.0, 3.0, 0.0), from_yaw(0.0)))
    broadcaster.sendTransform(ahead)
    assert bench.witness.count_subscribers('/tf') == 1  # the witness itself
    bench.send(0.5, 1.0, 'ahead')
    bench.arrive(5.5, 4.0)
    assert bench.witness.count_subscribers('/tf') == 2
    bench.send(0.5, 0.5, 'elsewhere')
    bench.graph.spin_until(lambda: bench.robot.pending, 1.0, 'the goal waits for its frame')
    bench.send(nan, 0.5)  # changes nothing
    broadcaster.sendTransform(elsewhere)
    bench.arrive(2.5, 3.5)


def test_a_goal_before_the_first_pose(graph, capfd):
    """In odom or base_link it is none, which no TF can change."""
    robot = graph.add_robot()
    for frame in ('odom', 'base_link'):
        goal = PoseStamped()
        goal.header.frame_id = frame
        robot.on_goal(goal)
        graph.spin_until(lambda: not robot.pending, 5.0, 'the goal is given up')
        (warning,) = warnings(capfd)
        assert f'"{frame}" is not there before the first pose' in warning
    assert robot.count_subscribers('/tf') == 0


def test_goals_that_make_no_sense(bench, capfd):
    """Each is refused with one warning that names it, and changes nothing."""
    bench.send(7.0, 6.0)
    bench.arrive(7.0, 6.0)
    bench.stand()
    warnings(capfd)
    for x, y, frame, word in ((nan, 1.0, 'world', 'nan'), (1.0, float('inf'), 'world', 'inf'),
                              (1.0, 1.0, 'nowhere', '"nowhere"')):
        bench.commands.clear()
        bench.send(x, y, frame)
        bench.graph.spin_until(lambda: len(bench.commands) > 20, 5.0, '20 commands')
        bench.graph.spin_until(lambda: not bench.robot.pending, 5.0, 'no goal waits')
        assert all(command == Twist() for _, command in bench.commands)
        found = warnings(capfd)
        assert len(found) == 1 and word in found[0], found
    bench.send(7.0, 6.0)
    bench.graph.spin_for(0.3)
    assert all(command == Twist() for _, command in bench.commands)
    assert warnings(capfd) == []


def test_goal_without_a_frame_is_in_the_world(bench, monkeypatch):
    """As `ros2 topic pub --once goal_pose` sends it, with nothing but a position."""
    told = []
    monkeypatch.setattr(bench.robot.get_logger(), 'info', told.append)
    bench.send(7.0, 6.0, '')
    bench.arrive(7.0, 6.0)
    assert len(told) == 1 and 'without a frame_id' in told[0]


def test_goal_too_far_to_be_reckoned_with(bench, capfd):
    """Finite in its frame but not in the world: refused, and the next goal is reached."""
    frame = Pose3D((1e308, 1e308, 0.0), (0.0, 0.0, sin(0.4), cos(0.4)))
    warnings(capfd)
    bench.robot.drive_to(frame, (1.7e308, 1.7e308, 0.0))
    found = warnings(capfd)
    assert len(found) == 1 and 'too far' in found[0] and len(found[0]) < 300
    bench.send(7.0, 6.0)
    bench.arrive(7.0, 6.0)


def test_poses_that_no_turtle_has(graph, capfd):
    """Nonsense on turtle1/pose, even as the first pose, moves neither frame nor wheel."""
    robot = graph.add_robot()
    for values in ((1e30, 5.0, 0.0, 1.0, 0.0), (-3.0, 5.0, 0.0, 1.0, 0.0),
                   (nan, 5.0, 0.0, 1.0, 0.0), (5.0, 5.0, 0.0, float('inf'), 0.0)):
        robot.on_pose(Pose(**dict(zip(
            ('x', 'y', 'theta', 'linear_velocity', 'angular_velocity'), values))))
    assert robot.odometer.origin is None and robot.driver.pose is None
    assert 1 <= len(warnings(capfd)) <= 5


def test_a_second_turtle_is_warned_of_once(bench, capfd):
    """Whoever starts a second graph in this domain is told."""
    robot, before = bench.robot, bench.robot.turtles
    bench.graph.spin_until(lambda: robot.turtles == 1, 10.0, 'the robot knows of its turtle')
    assert before <= 1 and not [line for line in warnings(capfd) if 'second robot' in line]
    bench.witness.create_publisher(Pose, 'turtle1/pose', 10)
    bench.graph.spin_until(lambda: robot.turtles == 2, 10.0, 'the robot knows of another turtle')
    robot.look_for_company()
    (warning,) = [line for line in warnings(capfd) if 'second robot' in line]
    assert '2 nodes publish /turtle1/pose' in warning


def test_odom_of_somebody_else_does_not_stay(bench, capfd):
    """The robot has the last word on where its odom frame is."""
    heard = bench.witness.record_transforms('odom', '/tf_static')
    foreign = transform_message('world', 'odom')
    foreign.transform.translation.x = 99.0
    broadcaster = StaticTransformBroadcaster(bench.witness)
    bench.graph.spin_until(lambda: bench.witness.count_subscribers('/tf_static') >= 2, 5.0,
                           'the robot listens')
    broadcaster.sendTransform(foreign)
    bench.graph.spin_until(
        lambda: heard and heard[-1][1].transform == bench.robot.world_to_odom.transform, 5.0,
        'odom is where it was')
    assert [line for line in warnings(capfd) if 'Somebody else broadcasts "odom"' in line]


def test_goal_outside_the_arena_is_clamped(bench, capfd):
    """The robot goes as far as the wall, and says so."""
    bench.teleport(10.0, 5.0, 0.0)
    warnings(capfd)
    bench.send(14.0, 6.0)
    bench.arrive(11.088889, 6.0)
    found = [line for line in warnings(capfd) if 'outside the arena' in line]
    assert len(found) == 1 and '(14, 6)' in found[0]


def test_tilt(bench, capfd):
    """The platform's joint is the last finite angle heard."""
    def platform():
        return bench.joints[-1][1].position[2]

    assert list(bench.joints[-1][1].name) == ['stem_joint', 'wheel_joint', 'platform_joint']
    for angle in (0.5, -7.0):
        bench.tilts.publish(Tilt(angle=angle))
        bench.graph.spin_until(lambda: platform() == angle, 5.0, f'tilted by {angle}')
    warnings(capfd)
    for bad in (nan, float('-inf')):
        bench.tilts.publish(Tilt(angle=bad))
        bench.joints.clear()
        bench.graph.spin_until(lambda: len(bench.joints) > 20, 5.0, '20 joint states')
        assert platform() == -7.0
        found = warnings(capfd)
        assert len(found) == 1 and str(bad) in found[0], found


def test_turtlesim_that_goes_and_comes_back(bench):
    """No motion is asked for while there is no turtle; with a new one the goal is reached."""
    if bench.turtlesim is None:
        pytest.skip('the real turtlesim runs as a process of its own here')
    bench.send(10.0, 10.0)
    bench.graph.spin_until(lambda: bench.pose.x > 6.5, 5.0, 'on its way')
    bench.graph.remove(bench.turtlesim)
    bench.graph.spin_until(lambda: bench.commands[-1][1] == Twist(), 2.0, 'stopped asking')
    bench.commands.clear()
    bench.graph.spin_for(0.5)
    assert len(bench.commands) > 30
    assert all(command == Twist() for _, command in bench.commands)
    wheel = bench.robot.odometer.wheel_angle
    origin = bench.robot.odometer.origin
    bench.poses.clear()
    bench.graph.add_turtlesim()
    bench.graph.spin_until(lambda: bench.poses, 10.0, 'a new turtle')
    assert bench.pose.x == pytest.approx(CENTER)
    bench.graph.spin_until(lambda: bench.robot.odometer.pose.x < 0.01, 5.0, 'seen by the robot')
    assert bench.robot.odometer.wheel_angle == wheel
    bench.arrive(10.0, 10.0)
    assert bench.robot.odometer.origin == origin
