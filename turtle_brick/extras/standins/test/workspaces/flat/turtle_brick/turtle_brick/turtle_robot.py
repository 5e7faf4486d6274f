# SPDX-License-Identifier: Apache-2.0
"""A node that reports the height of the platform and then exits."""

import rclpy
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros.buffer import Buffer
from tf2_ros.transform_listener import TransformListener
from tf_transformations import euler_from_quaternion, quaternion_from_euler
from turtle_brick_interfaces.msg import Tilt  # noqa: F401
from turtlesim.msg import Pose


class TurtleRobot(Node):
    """A robot that does not move."""

    def __init__(self):
        super().__init__('turtle_robot')
        self.buffer = Buffer()
        self.listener = TransformListener(self.buffer, self)
        self.create_subscription(Pose, 'turtle1/pose', self.pose_callback, 10)

    def pose_callback(self, pose):
        if not self.buffer.can_transform('base_link', 'platform', Time()):
            return
        transform = self.buffer.lookup_transform('base_link', 'platform', Time())
        yaw = euler_from_quaternion(quaternion_from_euler(0.0, 0.0, pose.theta))[2]
        self.get_logger().info(f'height {transform.transform.translation.z}, yaw {yaw}')
        raise SystemExit


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TurtleRobot())
