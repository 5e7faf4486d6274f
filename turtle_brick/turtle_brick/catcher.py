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
catcher: has the robot catch the brick, carry it to the center of the arena and tip it off.

Publishes:
    goal_pose (geometry_msgs/PoseStamped): where the robot is to drive, in the world
    tilt (turtle_brick_interfaces/Tilt): angle of the platform (rad)
    catcher_marker (visualization_msgs/Marker): the text "Unreachable" above a brick that can't be
        caught, for 3 s, once per fall
    catcher_state (std_msgs/String, latched): the current state: waiting, approaching, carrying,
        tilting or leveling
    catcher_decision (std_msgs/String, latched): "reachable: " or "unreachable: " and the reason,
        once per fall

Subscribes:
    /tf, /tf_static: the frames brick and platform; it knows nothing else of brick and robot

How long messages and orders take it measures, so that the nodes may be on several hosts: see
`turtle_brick.core.latency`. Their clocks have to agree, as chrony or another NTP client keeps
them.

Parameters, read-only:
    max_velocity (double, m/s): greatest speed of the robot
    platform_height (double, m): height of the platform's top
    platform_radius (double, m): radius of the platform
    gravity_accel (double, m/s^2): acceleration due to gravity
    brick_size (double[3], m): size of the brick along its own x, y and z
    tilt_angle (double, rad): tilt with which the brick is tipped off
"""

from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from tf2_ros import Buffer
from turtle_brick.core.catch_logic import Catcher, DriveOrder, PERIOD, TiltOrder
from turtle_brick.core.parameters import CatcherParameters
from turtle_brick.core.reachability import Decision
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import due_time, nanoseconds_of, SECONDS_PER_NS
from turtle_brick.ros.node_main import init, spin
from turtle_brick.ros.node_parameters import declare_parameters
from turtle_brick.ros.tf import (BASE_LINK, BRICK, GuardedListener, LATCHED, latest_transform,
                                 PLATFORM, pose_of, recent_pose, WORLD)
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker

ORDERS = QoSProfile(depth=1)
"""Only the latest order counts. With a depth of 1 each one tells the subscriber that those before
it are void: one that got lost does not hold them back."""

MOVING = (BRICK, PLATFORM, BASE_LINK)
"""The frames whose transforms show how long messages take."""

ON_TIME = 0.005
"""Longest delay (s) of a call of the timer that is not late."""

TEXT_HEIGHT = 0.6
"""Height of the letters (m)."""

TEXT_COLOR = (1.0, 0.15, 0.1, 1.0)

TEXT_LIFETIME = 3
"""Time (s) for which "Unreachable" is shown."""


class CatcherNode(Node):
    """Have the robot catch falling bricks."""

    def __init__(self, **node_options: Any) -> None:
        """
        Wait for a brick to fall.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: a parameter is missing or inadmissible
        """
        super().__init__('catcher', **node_options)
        self.catcher = Catcher(declare_parameters(self, CatcherParameters))
        self.waiting = False
        """Whether it was logged what is missing."""
        self.complete = False
        """Whether robot and brick have been in sight."""
        self.warned_of_clocks = False
        """Whether it was logged that the clocks of the hosts disagree."""
        self.ages: dict[str, float] = {}
        """How old (s) the last transform of each moving frame was when it arrived."""

        self.tf_buffer = Buffer()
        self.tf_listener = GuardedListener(self.tf_buffer, self, self.on_transform)

        self.goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', ORDERS)
        self.tilt_publisher = self.create_publisher(Tilt, 'tilt', ORDERS)
        self.marker_publisher = self.create_publisher(Marker, 'catcher_marker', 10)
        self.state_publisher = self.create_publisher(String, 'catcher_state', LATCHED)
        self.decision_publisher = self.create_publisher(String, 'catcher_decision', LATCHED)
        self.publish_state()
        self.timer = self.create_timer(PERIOD, self.on_timer)

    def on_transform(self, transform: TransformStamped, now: int) -> None:
        """Note where the brick is, heard of now (ns); act at once if it has begun to fall."""
        stamp = nanoseconds_of(transform.header.stamp)
        if transform.child_frame_id in MOVING:
            self.ages[transform.child_frame_id] = (now - stamp) * SECONDS_PER_NS
        if transform.child_frame_id == BASE_LINK:
            self.catcher.latency.see_robot(stamp)
        if transform.child_frame_id != BRICK:
            return
        position = pose_of(transform.transform).position
        parent = transform.header.frame_id
        if parent != WORLD:
            above = latest_transform(self.tf_buffer, parent)
            if above is None:
                return
            position = pose_of(above.transform).transform(position)
        if self.catcher.see_brick(stamp, position, parent):
            self.update()

    def on_timer(self) -> None:
        """Note how long messages take, and let the catcher decide."""
        now = self.get_clock().now().nanoseconds
        if not self.get_parameter('use_sim_time').value:  # which passes in steps
            late = (now - due_time(self.timer, now)) * SECONDS_PER_NS > ON_TIME
            self.catcher.latency.hear(now, self.ages.values(), late)
        self.ages.clear()
        ahead = self.catcher.latency.ahead(now)
        if ahead and not self.warned_of_clocks:
            self.warned_of_clocks = True
            self.get_logger().warning(
                f'Stamps are up to {ahead:.3f} s ahead of this clock: the clocks of the hosts '
                'disagree, and bricks are refused that could be caught. chrony, or another NTP '
                'client, on each host keeps their clocks together')
        self.update()

    def update(self) -> None:
        """Let the catcher decide, and publish what it orders."""
        now = self.get_clock().now().nanoseconds
        state = self.catcher.state
        pose = recent_pose(self.tf_buffer, PLATFORM, now) if self.is_heard() else None
        platform = Platform(pose) if pose else None
        actions = self.catcher.update(now, platform)
        if self.catcher.state is not state:
            self.publish_state()
            self.get_logger().info(f'Now {self.catcher.state.value}')
        for action in actions:
            if isinstance(action, DriveOrder):
                self.drive_to(action.x, action.y)
            elif isinstance(action, TiltOrder):
                self.tilt_publisher.publish(Tilt(angle=action.angle))
            else:
                self.publish_decision(action)
        if not self.complete:
            self.log_what_is_missing()

    def is_heard(self) -> bool:
        """Tell whether a robot subscribes to the orders; else no brick is called reachable."""
        return all(publisher.get_subscription_count() > 0
                   for publisher in (self.goal_publisher, self.tilt_publisher))

    def drive_to(self, x: float, y: float) -> None:
        """Send the robot to a point of the world (m)."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        self.goal_publisher.publish(goal)

    def publish_state(self) -> None:
        """Tell what the catcher does."""
        self.state_publisher.publish(String(data=self.catcher.state.name.lower()))

    def publish_decision(self, decision: Decision) -> None:
        """Publish and log whether the brick is reachable, and show "Unreachable" if it is not."""
        self.decision_publisher.publish(String(data=decision.summary))
        self.get_logger().info(f'The brick at ({decision.fall.x:.4g}, {decision.fall.y:.4g}) is '
                               f'{decision.summary}')
        if not decision.reachable:
            self.publish_marker(decision)

    def publish_marker(self, decision: Decision) -> None:
        """Show "Unreachable" above the brick."""
        marker = Marker(ns='catcher', type=Marker.TEXT_VIEW_FACING, action=Marker.ADD,
                        text='Unreachable')
        marker.header.frame_id = WORLD
        marker.header.stamp = self.get_clock().now().to_msg()
        x, y, z = decision.fall.position
        marker.pose.position.x, marker.pose.position.y = x, y
        marker.pose.position.z = z + TEXT_HEIGHT
        marker.scale.z = TEXT_HEIGHT
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = TEXT_COLOR
        marker.lifetime.sec = TEXT_LIFETIME
        self.marker_publisher.publish(marker)

    def log_what_is_missing(self) -> None:
        """Log, once, what is missing of robot and brick; log when both are there."""
        missing = [f'the transform of {frame}' for frame in (PLATFORM, BRICK)
                   if latest_transform(self.tf_buffer, frame) is None]
        if not self.is_heard():
            missing.append('a subscriber of goal_pose and tilt')
        if missing and not self.waiting:
            self.waiting = True
            self.get_logger().info(f'Waiting for {" and ".join(missing)}')
        if not missing:
            self.complete = True
            self.get_logger().info('Found the robot and the brick, waiting for a fall')


def main(args: list[str] | None = None) -> None:
    """Run the node until it is interrupted."""
    with init(args):
        spin(CatcherNode())


if __name__ == '__main__':
    main()
