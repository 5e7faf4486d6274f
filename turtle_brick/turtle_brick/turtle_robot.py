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
turtle_robot: makes turtlesim's turtle a robot with odometry, joints and a goal to drive to.

Units and axes are those of REP 103, the frames those of REP 105, with world in the place of map.

Publishes, each 100 times per second, whether the robot moves or not:
    cmd_vel (geometry_msgs/Twist): velocity in the robot's own frame (m/s); zero at rest, without
        a goal and before the first pose of the turtle
    odom (nav_msgs/Odometry): pose of base_link in odom, twist as commanded; from the first pose on
    joint_states (sensor_msgs/JointState): stem_joint, wheel_joint, platform_joint: positions (rad)
        and velocities (rad/s). At rest the stem turns to the direction of a command as soon as
        that is published, in motion it points along the motion; the wheel turns at forward speed /
        wheel_radius; stem and platform are in their new positions at once

Broadcasts:
    odom -> base_link, 100 times per second, equal to the odometry; base_link is on the ground
    world -> odom, static: the first pose of the turtle, heading included; it never changes

Subscribes:
    turtle1/pose (turtlesim/Pose): where the turtle is
    goal_pose (geometry_msgs/PoseStamped): where to drive, in any frame that TF connects with the
        world; the robot is omnidirectional and ignores the goal's orientation
    tilt (turtle_brick_interfaces/Tilt): angle of the platform (rad)
    /tf, /tf_static: from the first goal on in another frame than world, odom and base_link

Parameters, read-only:
    max_velocity (double, m/s): greatest speed of the robot
    wheel_radius (double, m): radius of the wheel, which rolls without slipping
"""

from math import isfinite
from time import monotonic, monotonic_ns
from typing import Any

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import JointState
from tf2_ros import Buffer, StaticTransformBroadcaster, TransformBroadcaster, TransformException
from turtle_brick.core.driving import COMMAND_PERIOD, Driver
from turtle_brick.core.geometry import from_yaw, Pose, Pose2D, Vector
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import RobotParameters
from turtle_brick.core.time_steps import due_time, NS_PER_SECOND, StepClock
from turtle_brick.core.turtlesim_kinematics import TurtlePose, within_arena
from turtle_brick.ros.node_main import init, spin, Warner
from turtle_brick.ros.node_parameters import declare_parameters
from turtle_brick.ros.tf import (BASE_LINK, BEST_EFFORT, GuardedListener, LATEST_TIME, ODOM,
                                 pose_of, set_transform, transform_message, WORLD)
from turtle_brick_interfaces.msg import Tilt
from turtlesim.msg import Pose as TurtlePoseMessage

FRAME_PATIENCE = 1.0
"""Time (s) for which a goal waits until its frame is known."""


class TurtleRobot(Node):
    """Bridge between turtlesim and the interfaces of a robot."""

    def __init__(self, **node_options: Any) -> None:
        """
        Start at rest, with a level platform.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: a parameter is missing or inadmissible
        """
        super().__init__('turtle_robot', **node_options)
        parameters = declare_parameters(self, RobotParameters)
        self.driver = Driver(parameters.max_velocity)
        self.odometer = Odometer(parameters.wheel_radius)
        self.tilt_angle = 0.0
        self.warner = Warner(self)
        self.pending: tuple[str, Vector, float] | None = None
        """A goal whose frame is not known yet: frame, point (m), and until when (s) it waits."""

        self.tf_buffer = Buffer()
        self.tf_listener: GuardedListener | None = None
        self.tf_broadcaster = TransformBroadcaster(self)
        self.static_broadcaster = StaticTransformBroadcaster(self)

        # Made once: made anew in each cycle they take 15 % more of this node's processor time.
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

        # turtlesim ticks by the wall clock, whatever /clock says, so what steers it does too.
        # Missed cycles are made up for: turtlesim's queue is then full and predictable again.
        self.cycles = StepClock(round(COMMAND_PERIOD * NS_PER_SECOND))
        self.timer = self.create_timer(
            COMMAND_PERIOD, self.on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def on_pose(self, message: TurtlePoseMessage) -> None:
        """Note where the turtle is; the first pose places the odom frame."""
        pose = TurtlePose(message.x, message.y, message.theta,
                          message.linear_velocity, message.angular_velocity)
        place = (pose.x, pose.y)
        if not all(map(isfinite, pose)) or place != within_arena(*place):
            self.warner.warn(
                'pose', f'Ignored a pose that no turtle has: ({pose.x:g}, {pose.y:g}), heading '
                f'{pose.theta:g} rad, at {pose.linear_velocity:g} m/s')
            return
        now = monotonic()
        self.driver.observe(now, pose)
        first = self.odometer.origin is None
        self.odometer.observe(now, pose)
        if first:
            origin = Pose2D(pose.x, pose.y, pose.theta)
            self.static_broadcaster.sendTransform(transform_message(
                WORLD, ODOM, upright(origin), self.get_clock().now().to_msg()))
            self.get_logger().info(f'The turtle is at ({pose.x:.3f}, {pose.y:.3f}), '
                                   f'heading {pose.theta:.3f} rad: this is where odom is')

    def on_goal(self, message: PoseStamped) -> None:
        """Drive to a goal, once its frame is known; ignore one that is not finite."""
        position = message.pose.position
        point = (position.x, position.y, position.z)
        if not all(isfinite(value) for value in point):
            self.warner.warn(
                'finite', 'Ignored the goal ({:g}, {:g}, {:g}): it is not finite'.format(*point))
            return
        frame = message.header.frame_id
        if not frame:
            frame = WORLD
            self.get_logger().info(f'A goal without a frame_id is taken to be in "{WORLD}"')
        known = self.pose_of_frame(frame)
        if known is not None:
            self.pending = None
            self.drive_to(known, point)
            return
        if self.tf_listener is None:
            # Not from the start: hearing all transforms adds 70 % to this node's processor time.
            self.tf_listener = GuardedListener(self.tf_buffer, self)
        self.pending = (frame, point, monotonic() + FRAME_PATIENCE)
        self.try_pending_goal(*self.pending)

    def try_pending_goal(self, name: str, point: Vector, deadline: float) -> None:
        """Drive to the goal that waits for its frame; after the deadline (s) give it up."""
        try:
            transform = self.tf_buffer.lookup_transform(WORLD, name, LATEST_TIME).transform
        except TransformException as error:
            if monotonic() > deadline:
                self.pending = None
                self.warner.warn(
                    'frame', f'Ignored a goal in the frame "{name[:40]}": {str(error)[:200]}')
            return
        self.pending = None
        self.drive_to(pose_of(transform), point)

    def drive_to(self, frame: Pose, point: Vector) -> None:
        """Drive to a point (m) of a frame whose pose in the world is given."""
        goal = frame.transform(point)[:2]
        if not all(map(isfinite, goal)):
            self.warner.warn(
                'far', 'Ignored the goal ({:g}, {:g}, {:g}): it is too far away'.format(*point))
            return
        x, y = within_arena(*goal)
        if (x, y) != goal:
            self.warner.warn(
                'outside', f'The goal ({goal[0]:.4g}, {goal[1]:.4g}) is outside the arena: '
                f'driving to ({x:.3f}, {y:.3f})')
        self.get_logger().debug(f'Driving to ({x:.3f}, {y:.3f})')
        self.driver.drive_to(x, y)

    def on_tilt(self, message: Tilt) -> None:
        """Set the platform's angle, if it is finite."""
        if not isfinite(message.angle):
            self.warner.warn('tilt', f'Ignored a tilt of {message.angle} rad')
            return
        self.tilt_angle = message.angle

    def on_timer(self) -> None:
        """Go through every cycle that is due."""
        if self.pending is not None:
            self.try_pending_goal(*self.pending)
        now = monotonic_ns()
        for _ in self.cycles.due(now, due_time(self.timer, now)):
            self.cycle()

    def cycle(self) -> None:
        """Publish a command, the joints' positions and where the robot is."""
        stamp = self.get_clock().now().to_msg()
        velocity = self.driver.command(monotonic())
        self.twist.linear.x, self.twist.linear.y = velocity
        self.cmd_vel_publisher.publish(self.twist)
        self.odometer.steer(velocity)

        self.joints.header.stamp = stamp
        self.joints.position = [
            self.odometer.stem_angle, self.odometer.wheel_angle, self.tilt_angle]
        self.joints.velocity = [0.0, self.odometer.wheel_velocity, 0.0]
        self.joint_publisher.publish(self.joints)

        if self.odometer.pose is None:
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

    def pose_of_frame(self, name: str) -> Pose | None:
        """Return the pose of one of the robot's own frames in the world, None of another."""
        origin, pose = self.odometer.origin, self.odometer.pose
        if name == WORLD:
            return upright(Pose2D(0.0, 0.0, 0.0))
        if origin is None or pose is None:
            return None
        return {ODOM: upright(origin), BASE_LINK: upright(origin.compose(pose))}.get(name)


def upright(pose: Pose2D) -> Pose:
    """Return a pose in the plane as a pose in space."""
    return Pose((pose.x, pose.y, 0.0), from_yaw(pose.yaw))


def main(args: list[str] | None = None) -> None:
    """Run the node until it is interrupted."""
    with init(args):
        spin(TurtleRobot())


if __name__ == '__main__':
    main()
