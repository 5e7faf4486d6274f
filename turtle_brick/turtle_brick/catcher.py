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
    tilt (turtle_brick_interfaces/Tilt): angle of the platform
    catcher_marker (visualization_msgs/Marker): the text "Unreachable" near a brick that can't be
        caught, for 3 s, once per fall

Subscribes:
    /tf, /tf_static: the frames brick and platform, from which alone it knows what happens

Parameters: those of config/turtle.yaml, read-only; it uses max_velocity, platform_height,
platform_radius, platform_thickness, gravity_accel, brick_size and tilt_angle.
"""

import sys
from typing import Any

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from tf2_ros import Buffer
from turtle_brick.catching import Catcher
from turtle_brick.catching import Drive
from turtle_brick.catching import PERIOD
from turtle_brick.catching import Tilt
from turtle_brick.frames import BRICK
from turtle_brick.frames import FrameListener
from turtle_brick.frames import latest
from turtle_brick.frames import nanoseconds_of
from turtle_brick.frames import PLATFORM
from turtle_brick.frames import pose_of
from turtle_brick.frames import recent
from turtle_brick.frames import WORLD
from turtle_brick.geometry import Vector
from turtle_brick.node_parameters import declare_parameters
from turtle_brick.reaching import Decision
from turtle_brick.spinning import run
from turtle_brick_interfaces.msg import Tilt as TiltMessage
from visualization_msgs.msg import Marker

TEXT_HEIGHT = 0.6
"""Height of the letters (m)."""

TEXT_COLOR = (1.0, 0.15, 0.1, 1.0)

TEXT_LIFETIME = 3
"""For which "Unreachable" is shown (s)."""


class CatcherNode(Node):
    """Have the robot catch falling bricks."""

    def __init__(self, **node_options: Any) -> None:
        """
        Wait for a brick to fall.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: a parameter is missing or inadmissible
        """
        super().__init__('catcher', **node_options)
        self.catcher = Catcher(declare_parameters(self))
        self.waiting = False
        self.complete = False

        self.tf_buffer = Buffer(node=self)
        self.tf_listener = FrameListener(self.tf_buffer, self, BRICK, self.on_brick)

        self.goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self.tilt_publisher = self.create_publisher(TiltMessage, 'tilt', 10)
        self.marker_publisher = self.create_publisher(Marker, 'catcher_marker', 10)
        self.create_timer(PERIOD, self.update)

    def on_brick(self, transform: TransformStamped) -> None:
        """Look at where the brick was; act at once if it has begun to fall."""
        position = pose_of(transform.transform).position
        parent = transform.header.frame_id
        if parent != WORLD:
            above = latest(self.tf_buffer, parent)
            if above is None:
                return
            position = pose_of(above.transform).transform(position)
        if self.catcher.see_brick(nanoseconds_of(transform.header.stamp), position, parent):
            self.update()

    def update(self) -> None:
        """Let the catcher decide, and publish what it wants."""
        now = self.get_clock().now().nanoseconds
        state = self.catcher.state
        platform = recent(self.tf_buffer, PLATFORM, now) if self.is_heard() else None
        for action in self.catcher.update(now, platform):
            if isinstance(action, Drive):
                self.drive_to(action.x, action.y)
            elif isinstance(action, Tilt):
                self.tilt_publisher.publish(TiltMessage(angle=action.angle))
            else:
                self.explain(action)
                if not action.reachable:
                    self.say_unreachable(action.fall.position)
        if self.catcher.state is not state:
            self.get_logger().info(f'Now {self.catcher.state.value}')
        if not self.complete:
            self.wait_quietly()

    def is_heard(self) -> bool:
        """Tell whether there is a robot that hears what it is told; else nothing is promised."""
        return all(publisher.get_subscription_count() > 0
                   for publisher in (self.goal_publisher, self.tilt_publisher))

    def drive_to(self, x: float, y: float) -> None:
        """Send the robot to a point of the world (m)."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 1.0
        self.goal_publisher.publish(goal)

    def say_unreachable(self, position: Vector) -> None:
        """Show the verdict near the brick."""
        marker = Marker()
        marker.header.frame_id = WORLD
        marker.header.stamp = self.get_clock().now().to_msg()
        marker.ns = 'catcher'
        marker.type = Marker.TEXT_VIEW_FACING
        marker.action = Marker.ADD
        marker.text = 'Unreachable'
        x, y, z = position
        marker.pose.position.x, marker.pose.position.y = x, y
        marker.pose.position.z = z + TEXT_HEIGHT
        marker.pose.orientation.w = 1.0
        marker.scale.z = TEXT_HEIGHT
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = TEXT_COLOR
        marker.lifetime.sec = TEXT_LIFETIME
        self.marker_publisher.publish(marker)

    def explain(self, decision: Decision) -> None:
        """Say why, and by how much, a brick can be caught or not."""
        place = f'The brick falls at ({decision.fall.x:.4g}, {decision.fall.y:.4g})'
        if decision.reachable:
            self.get_logger().info(
                f'{place} and can be caught: down in {decision.available:.3f} s, the robot, '
                f'{decision.distance:.2f} m away, needs {decision.needed:.3f} s')
        else:
            self.get_logger().info(f'{place}: unreachable, {decision.reason}')

    def wait_quietly(self) -> None:
        """Say once what is missing, and once that nothing is any more."""
        missing = [f'the transform of {frame}' for frame in (PLATFORM, BRICK)
                   if latest(self.tf_buffer, frame) is None]
        if not self.is_heard():
            missing.append('a robot that hears goal_pose and tilt')
        if missing and not self.waiting:
            self.waiting = True
            self.get_logger().info(f'Waiting for {" and ".join(missing)}')
        if not missing:
            self.complete = True
            self.get_logger().info('Robot and brick are in sight: waiting for a fall')


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to stop."""
    return run(CatcherNode, args)


if __name__ == '__main__':
    sys.exit(main())
