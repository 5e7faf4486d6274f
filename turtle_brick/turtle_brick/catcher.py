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
catcher: make the robot catch a brick, carry it to the arena's center, and tip it off the platform.

Publishes:
    goal_pose (geometry_msgs/PoseStamped): goal of the robot in the world frame
    tilt (turtle_brick_interfaces/Tilt): angle of the platform (rad)
    catcher_marker (visualization_msgs/Marker): the text "Unreachable" above an unreachable brick,
        shown for 3 s once per fall
    catcher_state (std_msgs/String, latched): current state: waiting, approaching, carrying,
        tilting or leveling
    catcher_decision (std_msgs/String, latched): once per fall, either "reachable: ..." or
        "unreachable: ..." with the reason

Subscribes:
    /tf, /tf_static: poses of the brick and the robot

Parameters, read-only (the catcher declares all parameters in config/turtle.yaml and uses these):
    max_velocity (float, m/s): maximum translational speed of the robot
    command_latency (float, s): maximum time from a decision until the arena sees the robot move
    platform_height (float, m): height of the level platform's top above the ground
    platform_radius (float, m): distance from the platform's axis within which a brick lands
    gravity_accel (float, m/s^2): acceleration of a falling brick
    brick_size (three floats, m): length, width and height of the brick; only the height is used
    tilt_angle (float, rad): angle of the platform for tipping off a brick
"""

from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from std_msgs.msg import String
from tf2_ros import Buffer
from turtle_brick.core.catch_logic import Catcher, UPDATE_PERIOD
from turtle_brick.core.geometry import Color
from turtle_brick.core.reachability import Decision
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.ros.node_main import declare_parameters, run_node
from turtle_brick.ros.tf import (BRICK, GuardedListener, LATCHED, latest_world_to,
                                 nanoseconds_of, PLATFORM, pose_of, recent_world_to, WORLD)
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker

COMMANDS = QoSProfile(depth=1)
"""QoS for goals and tilt commands. With a depth of 1, a lost command does not delay newer ones."""

TEXT_HEIGHT = 0.6
"""Height (m) of the letters in the "Unreachable" marker."""

TEXT_COLOR: Color = (1.0, 0.15, 0.1, 1.0)

TEXT_LIFETIME = 3
"""Lifetime (s) of the "Unreachable" marker."""


class CatcherNode(Node):
    """Make the robot catch falling bricks."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__('catcher', **node_options)
        self.parameters = declare_parameters(self)
        self.catcher = Catcher(self.parameters)

        self.tf_buffer = Buffer()
        self.tf_listener = GuardedListener(self.tf_buffer, self, self.on_transform)

        self.goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', COMMANDS)
        self.tilt_publisher = self.create_publisher(Tilt, 'tilt', COMMANDS)
        self.marker_publisher = self.create_publisher(Marker, 'catcher_marker', 10)
        self.state_publisher = self.create_publisher(String, 'catcher_state', LATCHED)
        self.decision_publisher = self.create_publisher(String, 'catcher_decision', LATCHED)
        self.publish_state()
        self.create_timer(UPDATE_PERIOD, self.on_timer)

    def on_timer(self) -> None:
        """Update the catcher."""
        self.update(self.get_clock().now().nanoseconds)

    def on_transform(self, transform: TransformStamped, now: int) -> None:
        """Record a transform of the brick, and update the catcher if a fall begins."""
        if transform.child_frame_id != BRICK:
            return
        position = pose_of(transform.transform).position
        parent = transform.header.frame_id
        if parent != WORLD:
            world_to_parent = latest_world_to(self.tf_buffer, parent)
            if world_to_parent is None:
                return
            position = pose_of(world_to_parent.transform).transform(position)
        self.catcher.brick.observe(
            nanoseconds_of(transform.header.stamp), position, is_attached=parent == PLATFORM)
        if self.catcher.is_update_due(now):
            self.update(now)

    def update(self, now: int) -> None:
        """Update the catcher at `now` (ns), and publish its commands, state and decision."""
        self.observe_robot(now)
        catcher, state, decision = self.catcher, self.catcher.state, self.catcher.decision
        commands = catcher.update(now)
        if commands.goal is not None:
            self.publish_goal(*commands.goal, now)
        if commands.tilt_angle is not None:
            self.tilt_publisher.publish(Tilt(angle=commands.tilt_angle))
        if catcher.decision is not None and catcher.decision is not decision:
            self.publish_decision(catcher.decision, now)
        if catcher.state is not state:
            self.publish_state()
            self.get_logger().info(f'The state is now {catcher.state.value}: {catcher.reason}')
        time = catcher.robot.response.late_time
        if time:
            self.get_logger().warning(
                f'The robot needed {time:.2f} s to respond to a goal, but command_latency is '
                f'{self.parameters.command_latency:g} s, so bricks may be missed. Set '
                f'command_latency to at least {time:.2f} in turtle.yaml.', once=True)

    def observe_robot(self, now: int) -> None:
        """Record the latest transform of the platform, or None if the robot is unavailable."""
        transform = recent_world_to(self.tf_buffer, PLATFORM, now)
        if transform is None or not self.has_subscribers():
            self.catcher.robot.observe(now, None)
        else:
            if self.catcher.robot.state is None:
                self.get_logger().info('Found the robot. Waiting for the brick to fall')
            self.catcher.robot.observe(nanoseconds_of(transform.header.stamp),
                                       Platform(pose_of(transform.transform)))

    def has_subscribers(self) -> bool:
        """Return whether a robot subscribes to goal_pose and tilt."""
        return (self.goal_publisher.get_subscription_count() > 0
                and self.tilt_publisher.get_subscription_count() > 0)

    def publish_goal(self, x: float, y: float, now: int) -> None:
        """Publish a goal (m) in the world frame, stamped with `now` (ns)."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.header.stamp = Time(nanoseconds=now).to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        self.goal_publisher.publish(goal)

    def publish_state(self) -> None:
        """Publish the current state."""
        self.state_publisher.publish(String(data=self.catcher.state.value))

    def publish_decision(self, decision: Decision, now: int) -> None:
        """Publish and log a decision, and show "Unreachable" if the brick is unreachable."""
        self.decision_publisher.publish(String(data=decision.summary))
        if not decision.reachable:
            self.publish_marker(decision, now)
        x, y, _ = decision.fall.position
        self.get_logger().info(f'The brick at ({x:.4g}, {y:.4g}) is {decision.summary}')

    def publish_marker(self, decision: Decision, now: int) -> None:
        """Show the text "Unreachable" above the brick."""
        marker = Marker(ns='catcher', type=Marker.TEXT_VIEW_FACING, action=Marker.ADD,
                        text='Unreachable')
        marker.header.frame_id = WORLD
        marker.header.stamp = Time(nanoseconds=now).to_msg()
        x, y, z = decision.fall.position
        marker.pose.position.x, marker.pose.position.y = x, y
        marker.pose.position.z = z + TEXT_HEIGHT
        marker.scale.z = TEXT_HEIGHT
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = TEXT_COLOR
        marker.lifetime.sec = TEXT_LIFETIME
        self.marker_publisher.publish(marker)


def main(args: list[str] | None = None) -> None:
    """Run the catcher until Ctrl-C or SIGTERM."""
    run_node(CatcherNode, args)
