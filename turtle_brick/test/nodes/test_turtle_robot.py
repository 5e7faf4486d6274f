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

"""Test turtle_robot's rates, frames, goals and responses to invalid messages."""

from itertools import cycle
from math import cos, dist, inf, nan, sin
from time import monotonic

from driven import record_published
from geometry_msgs.msg import PoseStamped, Twist
from live_nodes import LATCHED, TIMEOUT
from nav_msgs.msg import Odometry
import pytest
from sensor_msgs.msg import JointState
from turtle_brick.core.geometry import from_yaw
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick.turtle_robot import POSE_LIFETIME, TurtleRobot
from turtle_brick_interfaces.msg import Tilt
from turtlesim.msg import Pose as TurtlePoseMessage


def goal_at(x, y, frame='world'):
    goal = PoseStamped()
    goal.header.frame_id = frame
    goal.pose.position.x, goal.pose.position.y = x, y
    return goal


@pytest.fixture
def robot(live):
    """Return a turtle_robot node that has received turtle poses at (3, 4) and (8, 2)."""
    robot = live.add(TurtleRobot, '-r', 'cmd_vel:=turtle1/cmd_vel')
    robot.on_pose(TurtlePoseMessage(x=3.0, y=4.0, theta=1.0))
    robot.on_pose(TurtlePoseMessage(x=8.0, y=2.0, theta=-2.0))
    return robot


@pytest.fixture
def warned(capfd):
    return lambda: [line for line in capfd.readouterr().err.splitlines() if '[WARN]' in line]


def test_all_outputs_have_100_hz_at_rest_and_in_motion(live, turtlesim):
    """Odometry messages contain the latest velocity command and the pose in the odom frame."""
    live.add(TurtleRobot, '-r', 'cmd_vel:=turtle1/cmd_vel')
    poses = live.record('turtle1/pose', TurtlePoseMessage)
    commands = live.record('turtle1/cmd_vel', Twist)
    odometry = live.record('odom', Odometry)
    joints = live.record('joint_states', JointState)
    base_link = live.record_transforms('base_link')
    odom = live.record_transforms('odom', '/tf_static')
    goals, tilts = live.publisher('goal_pose', PoseStamped), live.publisher('tilt', Tilt)
    outputs = [commands, odometry, joints, base_link]
    live.require_rate(outputs, 100.0, 1.0)
    tilts.publish(Tilt(angle=-7.0))
    corners = cycle([(1.0, 1.0), (10.0, 1.0), (10.0, 10.0), (1.0, 10.0)])
    timer = live.listener.create_timer(0.8, lambda: goals.publish(goal_at(*next(corners))))
    live.wait_for(lambda: poses.last.linear_velocity > 0.0, TIMEOUT, 'the robot drives')
    live.require_rate(outputs, 100.0, 1.0, lambda: sum(
        command != Twist() for command in commands.messages) > 250)
    live.listener.destroy_timer(timer)
    for topic in ('turtle1/cmd_vel', 'odom', 'joint_states'):
        assert live.listener.count_publishers(topic) == 1, topic
    assert len(odom.messages) <= 1
    assert list(joints.last.name) == ['stem_joint', 'wheel_joint', 'platform_joint']
    assert joints.last.position[2] == -7.0 and not joints.last.velocity
    transforms = {(transform.header.stamp.sec, transform.header.stamp.nanosec): transform
                  for transform in base_link.messages}
    for message in odometry.messages[10:90]:  # The first and last transforms may be missing.
        transform = transforms[message.header.stamp.sec, message.header.stamp.nanosec]
        assert (message.header.frame_id, message.child_frame_id) == ('odom', 'base_link') == (
            transform.header.frame_id, transform.child_frame_id)
        pose, place = message.pose.pose, transform.transform.translation
        assert pose.orientation == transform.transform.rotation
        assert (pose.position.x, pose.position.y, pose.position.z) == (place.x, place.y, 0.0)
    twists = [message.twist.twist for message in odometry.messages]
    assert all(command in twists for command in commands.messages[10:90])
    goals.publish(goal_at(4.0, 3.0))
    live.wait_for(lambda: dist((poses.last.x, poses.last.y), (4.0, 3.0)) < 0.005
                  and commands.messages[-20:] == 20 * [Twist()], TIMEOUT, 'the robot arrives')


def test_odom_is_the_first_pose_including_its_heading(live, robot):
    statics = live.record_transforms('odom', '/tf_static', LATCHED)
    live.wait_for(lambda: statics.messages, TIMEOUT, 'world -> odom for a late joiner')
    (transform,) = statics.messages
    assert transform.header.frame_id == 'world'
    place, turn = transform.transform.translation, transform.transform.rotation
    assert (place.x, place.y, place.z) == pytest.approx((3.0, 4.0, 0.0))
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx(from_yaw(1.0))
    odometry = record_published(robot.odom_publisher)
    robot.cycle(monotonic())
    place, turn = odometry[-1].pose.pose.position, odometry[-1].pose.pose.orientation
    assert (place.x, place.y) == pytest.approx(
        (5.0 * cos(1.0) - 2.0 * sin(1.0), -5.0 * sin(1.0) - 2.0 * cos(1.0)))
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx(from_yaw(-3.0))
    assert robot.odometer.wheel_angle == 0.0


def test_odometry_ends_with_a_warning_when_turtlesim_dies(robot, warned):
    """A catcher must not rely on a robot whose pose is unknown."""
    odometry, transforms = record_published(robot.odom_publisher), []
    robot.tf_broadcaster.sendTransform = transforms.append
    last = robot.driver.pose_time
    robot.cycle(last + POSE_LIFETIME - 0.001)
    assert (len(odometry), len(transforms), warned()) == (1, 1, [])
    robot.cycle(last + POSE_LIFETIME + 0.001)
    assert (len(odometry), len(transforms)) == (1, 1)
    assert 'no longer publishes poses' in warned()[0]


def test_goals_in_each_frame(robot):
    for goal, point in (
            (goal_at(1.0, -1.0, 'odom'),
             (3.0 + cos(1.0) + sin(1.0), 4.0 + sin(1.0) - cos(1.0))),
            (goal_at(1.0, 0.5, 'base_link'),
             (8.0 + cos(2.0) + 0.5 * sin(2.0), 2.0 - sin(2.0) + 0.5 * cos(2.0))),
            (goal_at(6.0, 7.0, 'world'), (6.0, 7.0)),
            (goal_at(7.0, 6.0, ''), (7.0, 6.0))):  # `ros2 topic pub` sends an empty frame_id.
        robot.on_goal(goal)
        assert robot.driver.goal == pytest.approx(point)


def test_invalid_messages_are_ignored_with_a_warning(live, warned):
    """Invalid messages have no effect. A goal outside the arena is clamped to its edge."""
    robot = live.add(TurtleRobot, '-r', 'cmd_vel:=turtle1/cmd_vel')
    robot.on_pose(TurtlePoseMessage(x=8.0, y=2.0))
    robot.on_tilt(Tilt(angle=0.5))
    robot.on_goal(goal_at(5.0, 5.0))
    warned()
    for callback, messages, words in (
            ('on_goal', (goal_at(nan, 1.0), goal_at(1.0, inf),
                         goal_at(1.7e308, 1.7e308, 'base_link'), goal_at(1.0, 1.0, 'map')),
             ('(nan, 1, 0)', '(1, inf, 0)', 'not finite', 'Use "world", "odom" or "base_link"')),
            ('on_tilt', (Tilt(angle=nan), Tilt(angle=-inf)), ('tilt nan', 'tilt -inf')),
            ('on_pose', (TurtlePoseMessage(x=1e30, y=5.0), TurtlePoseMessage(x=-3.0, y=5.0),
                         TurtlePoseMessage(x=nan, y=5.0), TurtlePoseMessage(linear_velocity=inf)),
             ('(1e+30, 5)', '(-3, 5)', '(nan, 5)', 'speed inf'))):
        for message, word in zip(messages, words):
            robot.get_logger().contexts.clear()  # Do not throttle the next warning.
            getattr(robot, callback)(message)
            (warning,) = warned()
            assert 'Ignored' in warning and word in warning
    assert (robot.driver.goal, robot.tilt_angle) == ((5.0, 5.0), 0.5)
    assert (robot.driver.pose.x, robot.driver.pose.y) == (8.0, 2.0)
    robot.on_goal(goal_at(14.0, 6.0))
    (warning,) = warned()
    assert 'outside the arena' in warning and '(14, 6)' in warning
    assert robot.driver.goal == (ARENA_SIZE, 6.0)


def test_robot_stands_still_without_a_turtle(live):
    robot = live.add(TurtleRobot, '-r', 'cmd_vel:=turtle1/cmd_vel')
    commands = record_published(robot.cmd_vel_publisher)
    odometry = record_published(robot.odom_publisher)
    robot.on_goal(goal_at(1.0, 1.0))
    robot.on_goal(goal_at(1.0, 1.0, 'base_link'))
    robot.cycle(monotonic())
    assert robot.driver.goal == (1.0, 1.0) and commands == [Twist()] and not odometry


def test_tilt_sets_any_finite_angle(robot):
    for angle in (1.5, -5.0):
        robot.on_tilt(Tilt(angle=angle))
        assert robot.tilt_angle == angle
