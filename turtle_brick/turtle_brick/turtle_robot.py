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

"""
turtle_robot: drive the turtle in turtlesim, and present it as a robot with odometry and joints.

Units and axes follow REP 103. The frames follow REP 105, with world instead of map.

Publishes at 100 Hz, even while the robot is at rest:
    cmd_vel (geometry_msgs/Twist): velocity command (m/s) in the base_link frame; zero if the
        robot is at its goal or has no goal, or if no turtle pose has arrived for 0.25 s. The
        launch files remap this topic to turtle1/cmd_vel, the command topic of turtlesim.
    odom (nav_msgs/Odometry): pose of base_link in the odom frame, and the latest command as the
        twist; published while turtle poses arrive, that is, until none has arrived for 1 s
    joint_states (sensor_msgs/JointState): positions (rad) of these joints:
        stem_joint: direction of the last nonzero velocity command
        wheel_joint: angle of the wheel, which follows the motion along the stem's direction and
            not the commanded speed, because a wheel that does not slip stands still at a wall
        platform_joint: angle received on the tilt topic

Broadcasts:
    odom -> base_link, at 100 Hz: same pose as on the odom topic; base_link is on the ground
    world -> odom, static: first pose of the turtle, including its heading

Subscribes:
    turtle1/pose (turtlesim/Pose): current pose (m, rad) of the turtle, at 62.5 Hz
    goal_pose (geometry_msgs/PoseStamped): goal of the robot in the world, odom or base_link frame;
        the orientation is ignored because the robot is omnidirectional
    tilt (turtle_brick_interfaces/Tilt): angle (rad) of the platform about its y axis

Parameters, read-only (turtle_robot declares all parameters in config/turtle.yaml and uses these):
    max_velocity (float, m/s): maximum translational speed of the robot
    wheel_radius (float, m): radius of the wheel, which determines the angle of its joint
"""

from math import isfinite
from time import monotonic
from typing import Any

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import JointState
from tf2_ros import StaticTransformBroadcaster, TransformBroadcaster
from turtle_brick.core.driving import COMMAND_PERIOD, Driver
from turtle_brick.core.geometry import from_yaw, Pose, Pose2D
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.time_steps import NS_PER_SECOND, StepClock
from turtle_brick.core.turtlesim_arena import nearest_in_arena, TurtlePose
from turtle_brick.ros.node_main import declare_parameters, run_node
from turtle_brick.ros.tf import (BASE_LINK, BEST_EFFORT, due_time, ODOM, set_transform,
                                 transform_message, WARNING_PERIOD, WORLD)
from turtle_brick_interfaces.msg import Tilt
from turtlesim.msg import Pose as TurtlePoseMessage

POSE_LIFETIME = 1.0
"""Maximum age (s) of a turtle pose published as odometry. Gaps up to 1 s are due to load."""


class TurtleRobot(Node):
    """Drive the turtle, and publish odometry, joint states and transforms."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__('turtle_robot', **node_options)
        parameters = declare_parameters(self)
        self.driver = Driver(parameters.max_velocity)
        self.odometer = Odometer(parameters.wheel_radius)
        self.tilt_angle = 0.0

        self.tf_broadcaster = TransformBroadcaster(self)
        self.static_broadcaster = StaticTransformBroadcaster(self)

        # Reusing these messages saves 15 % of the processor time of this node.
        self.twist = Twist()
        self.joints = JointState(name=['stem_joint', 'wheel_joint', 'platform_joint'])
        self.transform = transform_message(ODOM, BASE_LINK)
        self.odometry = Odometry(child_frame_id=BASE_LINK)
        self.odometry.header.frame_id = ODOM

        self.cmd_vel_publisher = self.create_publisher(Twist, 'cmd_vel', 10)
        self.odom_publisher = self.create_publisher(Odometry, 'odom', 10)
        self.joint_publisher = self.create_publisher(JointState, 'joint_states', 10)
        self.create_subscription(TurtlePoseMessage, 'turtle1/pose', self.on_pose, BEST_EFFORT)
        self.create_subscription(PoseStamped, 'goal_pose', self.on_goal, 10)
        self.create_subscription(Tilt, 'tilt', self.on_tilt, 10)

        # Like turtlesim, this timer ignores simulated time. The node makes up for missed
        # cycles because the delay in the turtlesim queue is predictable only if the queue is full.
        self.cycles = StepClock(round(COMMAND_PERIOD * NS_PER_SECOND))
        self.timer = self.create_timer(
            COMMAND_PERIOD, self.on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def on_pose(self, message: TurtlePoseMessage) -> None:
        """Update the pose of the turtle. The first pose defines the odom frame."""
        pose = TurtlePose(message.x, message.y, message.theta,
                          message.linear_velocity, message.angular_velocity)
        position = (pose.x, pose.y)
        if not all(map(isfinite, pose)) or position != nearest_in_arena(*position):
            self.get_logger().warning(
                f'Ignored a pose that is invalid or outside the arena: ({pose.x:g}, {pose.y:g}), '
                f'heading {pose.theta:g} rad, speed {pose.linear_velocity:g} m/s',
                throttle_duration_sec=WARNING_PERIOD)
            return
        now = monotonic()
        self.driver.observe(now, pose)
        is_first = self.odometer.origin is None
        self.odometer.observe(now, pose, self.driver.stem_angle)
        if is_first:
            origin = Pose2D(pose.x, pose.y, pose.theta)
            self.static_broadcaster.sendTransform(transform_message(
                WORLD, ODOM, upright(origin), self.get_clock().now().to_msg()))
            self.get_logger().info(
                f'The turtle starts at ({pose.x:.3f}, {pose.y:.3f}), heading {pose.theta:.3f} '
                'rad. This pose defines odom.')

    def on_goal(self, message: PoseStamped) -> None:
        """Drive to a goal, or to the nearest point in the arena if the goal is outside."""
        try:
            goal = self.goal_in_world(message)
        except ValueError as error:
            self.get_logger().warning(
                f'Ignored a goal because {error}', throttle_duration_sec=WARNING_PERIOD)
            return
        x, y = nearest_in_arena(*goal)
        if (x, y) != goal:
            self.get_logger().warning(
                f'The goal ({goal[0]:.4g}, {goal[1]:.4g}) is outside the arena. '
                f'Driving to ({x:.3f}, {y:.3f}) instead.', throttle_duration_sec=WARNING_PERIOD)
        self.driver.drive_to(x, y)

    def goal_in_world(self, message: PoseStamped) -> tuple[float, float]:
        """Return a goal (m) in the world frame, or raise ValueError if the goal is not valid."""
        frame = message.header.frame_id or WORLD
        frame_pose, origin, pose = Pose2D(0.0, 0.0, 0.0), self.odometer.origin, self.odometer.pose
        if frame not in (WORLD, ODOM, BASE_LINK):
            raise ValueError(f'its frame is "{frame[:40]}". Use "{WORLD}", "{ODOM}" or '
                             f'"{BASE_LINK}".')
        if frame != WORLD:
            if origin is None or pose is None:
                raise ValueError(f'turtlesim has not published a pose, so "{frame}" is unknown')
            frame_pose = origin if frame == ODOM else origin.compose(pose)
        position = message.pose.position
        x, y, z = upright(frame_pose).transform((position.x, position.y, position.z))
        if not isfinite(x + y + z):
            raise ValueError('it is not finite: ({:g}, {:g}, {:g})'.format(
                position.x, position.y, position.z))
        return (x, y)

    def on_tilt(self, message: Tilt) -> None:
        """Set the angle of the platform."""
        if not isfinite(message.angle):
            self.get_logger().warning(
                f'Ignored the tilt {message.angle} rad because it is not finite',
                throttle_duration_sec=WARNING_PERIOD)
            return
        self.tilt_angle = message.angle

    def on_timer(self) -> None:
        """Execute all due command cycles."""
        now = monotonic()
        time = round(now * NS_PER_SECOND)
        for _ in self.cycles.due(time, due_time(self.timer, time)):
            self.cycle(now)

    def cycle(self, now: float) -> None:
        """
        Publish the velocity command, the joint states and the odometry.

        :param now: monotonic time (s), by which turtlesim executes commands. All timestamps are
            from the node's clock, which may be simulated.
        """
        stamp = self.get_clock().now().to_msg()
        velocity = self.driver.command(now)
        self.twist.linear.x, self.twist.linear.y = velocity
        self.cmd_vel_publisher.publish(self.twist)

        self.joints.header.stamp = stamp
        self.joints.position = [
            self.driver.stem_angle, self.odometer.wheel_angle, self.tilt_angle]
        self.joint_publisher.publish(self.joints)

        if self.odometer.pose is None:
            return
        if now - self.driver.pose_time > POSE_LIFETIME:
            self.get_logger().warning('turtlesim no longer publishes poses',
                                      throttle_duration_sec=WARNING_PERIOD)
            return
        self.transform.header.stamp = stamp
        set_transform(self.transform.transform, upright(self.odometer.pose))
        self.tf_broadcaster.sendTransform(self.transform)

        self.odometry.header.stamp = stamp
        pose = self.odometry.pose.pose
        pose.position.x, pose.position.y = self.odometer.pose.x, self.odometer.pose.y
        pose.orientation = self.transform.transform.rotation
        self.odometry.twist.twist = self.twist
        self.odom_publisher.publish(self.odometry)


def upright(pose: Pose2D) -> Pose:
    """Convert a pose in the plane to a three-dimensional pose."""
    return Pose((pose.x, pose.y, 0.0), from_yaw(pose.yaw))


def main(args: list[str] | None = None) -> None:
    """Run turtle_robot until Ctrl-C or SIGTERM."""
    run_node(TurtleRobot, args)
