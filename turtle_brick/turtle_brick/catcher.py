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
catcher: make the robot catch the brick, carry it to the center, and tip it off the platform.

Publishes:
    goal_pose (geometry_msgs/PoseStamped): goal of the robot in the world frame
    tilt (turtle_brick_interfaces/Tilt): angle of the platform (rad)
    catcher_marker (visualization_msgs/Marker): the text "Unreachable" above an unreachable brick,
        shown for 3 s once per fall
    catcher_state (std_msgs/String, latched): current state: waiting, approaching, carrying,
        tilting or leveling
    catcher_decision (std_msgs/String, latched): "reachable: ..." or "unreachable: ..." with the
        reason, once per fall

Subscribes:
    /tf, /tf_static: poses of the brick and the robot (the only input)

The nodes can run on several machines because the catcher measures the message latency. The clocks
of the machines must be synchronized, for example with chrony.

Parameters, read-only:
    max_velocity (double, m/s): maximum speed of the robot
    platform_height (double, m): height of the platform's top
    platform_radius (double, m): radius of the platform
    gravity_accel (double, m/s^2): acceleration due to gravity
    brick_size (double[3], m): size of the brick along its x, y and z axes
    tilt_angle (double, rad): platform angle for tipping off the brick
"""

from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from tf2_ros import Buffer
from turtle_brick.core.catch_logic import Action, Catcher, DriveGoal, TiltCommand, UPDATE_PERIOD
from turtle_brick.core.geometry import Color
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

COMMANDS = QoSProfile(depth=1)
"""QoS for goals and tilt commands. With a depth of 1, a lost command does not delay newer ones."""

MOVING_FRAMES = (BRICK, PLATFORM, BASE_LINK)
"""Moving frames whose transforms are used to measure the message latency."""

MAX_TIMER_DELAY = 0.005
"""Delay (s) beyond which a timer callback counts as late."""

TEXT_HEIGHT = 0.6
"""Height (m) of the letters in the marker."""

TEXT_COLOR: Color = (1.0, 0.15, 0.1, 1.0)

TEXT_LIFETIME = 3
"""Lifetime (s) of the marker."""


class CatcherNode(Node):
    """Make the robot catch falling bricks."""

    def __init__(self, **node_options: Any) -> None:
        """Create a node that waits for a fall. The options are for rclpy.node.Node."""
        super().__init__('catcher', **node_options)
        self.catcher = Catcher(declare_parameters(self, CatcherParameters))
        self.is_complete = False
        """Whether the robot and the brick have been found."""
        self.ages: dict[str, float] = {}
        """Age (s) of each moving frame's latest transform when the transform arrived."""

        self.tf_buffer = Buffer()
        self.tf_listener = GuardedListener(self.tf_buffer, self, self.on_transform)

        self.goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', COMMANDS)
        self.tilt_publisher = self.create_publisher(Tilt, 'tilt', COMMANDS)
        self.marker_publisher = self.create_publisher(Marker, 'catcher_marker', 10)
        self.state_publisher = self.create_publisher(String, 'catcher_state', LATCHED)
        self.decision_publisher = self.create_publisher(String, 'catcher_decision', LATCHED)
        self.publish_state()
        self.timer = self.create_timer(UPDATE_PERIOD, self.on_timer)

    def on_transform(self, transform: TransformStamped, now: int) -> None:
        """Record a transform received at `now` (ns), and update the catcher if a fall begins."""
        stamp = nanoseconds_of(transform.header.stamp)
        if transform.child_frame_id in MOVING_FRAMES:
            self.ages[transform.child_frame_id] = (now - stamp) * SECONDS_PER_NS
        if transform.child_frame_id == BASE_LINK:
            self.catcher.latency.record_robot_stamp(stamp)
        if transform.child_frame_id != BRICK:
            return
        position = pose_of(transform.transform).position
        parent = transform.header.frame_id
        if parent != WORLD:
            world_to_parent = latest_transform(self.tf_buffer, parent)
            if world_to_parent is None:
                return
            position = pose_of(world_to_parent.transform).transform(position)
        if self.catcher.observe_brick(stamp, position, is_attached=parent == PLATFORM):
            self.update()

    def on_timer(self) -> None:
        """Record the transform ages and update the catcher."""
        now = self.get_clock().now().nanoseconds
        # Simulated time advances in steps, so it cannot be used to measure ages.
        if not self.get_parameter('use_sim_time').value:
            late = (now - due_time(self.timer, now)) * SECONDS_PER_NS > MAX_TIMER_DELAY
            self.catcher.latency.record_ages(now, self.ages.values(), late)
        self.ages.clear()
        clock_error = self.catcher.latency.clock_error(now)
        if clock_error > 0.0:
            self.get_logger().warning(
                f'Timestamps are up to {clock_error:.3f} s in the future because the clocks of '
                'the machines disagree. The catcher may refuse reachable bricks. Synchronize the '
                'clocks, for example with chrony.', once=True)
        self.update()

    def update(self) -> None:
        """Update the catcher and publish its state and commands."""
        now = self.get_clock().now().nanoseconds
        state = self.catcher.state
        pose = recent_pose(self.tf_buffer, PLATFORM, now) if self.has_subscribers() else None
        actions = self.catcher.update(now, Platform(pose) if pose else None)
        if self.catcher.state is not state:
            self.publish_state()
            self.get_logger().info(f'The state is now {self.catcher.state.value}')
        for action in actions:
            self.publish_action(action)
        if not self.is_complete:
            self.log_missing()

    def has_subscribers(self) -> bool:
        """Return whether a robot subscribes to goal_pose and tilt."""
        return (self.goal_publisher.get_subscription_count() > 0
                and self.tilt_publisher.get_subscription_count() > 0)

    def publish_action(self, action: Action) -> None:
        """Publish a goal, a tilt command or a decision."""
        if isinstance(action, DriveGoal):
            self.publish_goal(action.x, action.y)
        elif isinstance(action, TiltCommand):
            self.tilt_publisher.publish(Tilt(angle=action.angle))
        else:
            self.publish_decision(action)

    def publish_goal(self, x: float, y: float) -> None:
        """Publish a goal (m) in the world frame."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        self.goal_publisher.publish(goal)

    def publish_state(self) -> None:
        """Publish the current state."""
        self.state_publisher.publish(String(data=self.catcher.state.value))

    def publish_decision(self, decision: Decision) -> None:
        """Publish and log a decision, and show "Unreachable" if the brick is unreachable."""
        self.decision_publisher.publish(String(data=decision.summary))
        self.get_logger().info(f'The brick at ({decision.fall.x:.4g}, {decision.fall.y:.4g}) is '
                               f'{decision.summary}')
        if not decision.reachable:
            self.publish_marker(decision)

    def publish_marker(self, decision: Decision) -> None:
        """Show the text "Unreachable" above the brick."""
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

    def log_missing(self) -> None:
        """Log the missing parts of the graph once, and report when all of them have been found."""
        missing = [f'the transform of {frame}' for frame in (PLATFORM, BRICK)
                   if latest_transform(self.tf_buffer, frame) is None]
        if not self.has_subscribers():
            missing.append('a subscriber to goal_pose and tilt')
        if missing:
            self.get_logger().info(f'Waiting for {" and ".join(missing)}', once=True)
        else:
            self.is_complete = True
            self.get_logger().info('Found the robot and the brick, waiting for a fall')


def main(args: list[str] | None = None) -> None:
    """Run the catcher until Ctrl-C or SIGTERM."""
    with init(args):
        spin(CatcherNode())


if __name__ == '__main__':
    main()
