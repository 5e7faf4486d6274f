# SPDX-License-Identifier: Apache-2.0
"""
The stand-in for the node in robot_state_publisher 3.3.4.

Publishes:
    /tf (tf2_msgs/msg/TFMessage): transforms of moving joints, one message per JointState
    /tf_static (tf2_msgs/msg/TFMessage): transforms of fixed joints, latched
    robot_description (std_msgs/msg/String): the `robot_description` parameter, latched

Subscribes:
    joint_states (sensor_msgs/msg/JointState): joint positions

ROS parameters (read-only):
    robot_description (string): the URDF of the robot; required, unless the first command-line
        argument is a URDF file
    publish_frequency (double, 20.0): maximum rate (Hz) of /tf, based on the timestamps of
        joint_states; at most 1000, or 0 for no limit
    ignore_timestamp (bool, false): whether to publish for each message, regardless of timestamps
    frame_prefix (string, empty): prefix added to all frame names
"""

from collections.abc import Iterable
from pathlib import Path
import sys
from typing import Any

from geometry_msgs.msg import TransformStamped
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile
from rclpy.utilities import remove_ros_args
from robot_state_publisher.description import FIXED, Joint, MOVING, parse
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf2_ros.buffer_core import fill, stamped
from turtle_graph.client.spinning import run_node


class RobotStatePublisher(Node):
    """Publishes the transforms of all links. The module docstring lists the ROS API."""

    def __init__(self, default_description: str = '', **node_arguments: Any) -> None:
        super().__init__('robot_state_publisher', **node_arguments)
        description, self._frequency, self._prefix, self._ignore_stamp = (
            self.declare_parameter(name, default, ParameterDescriptor(read_only=True)).value
            for name, default in (
                ('robot_description', default_description), ('publish_frequency', 20.0),
                ('frame_prefix', ''), ('ignore_timestamp', False)))
        if not description:
            raise ValueError('robot_description parameter must not be empty')
        if not 0.0 <= self._frequency <= 1000.0:
            raise ValueError(
                f'publish_frequency must be between 0 and 1000, but is {self._frequency}')

        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._joints = parse(description, self.get_logger().warning)
        self._names: list[str] = []
        self._sources: list[tuple[Joint, int, float, float, TransformStamped]] = []
        self._published: dict[str, int] = {}
        """Timestamp (ns) of the last processed position of each joint, keyed by joint name."""

        self._tf_publisher = self.create_publisher(TFMessage, '/tf', QoSProfile(depth=100))
        self._static_publisher = self.create_publisher(TFMessage, '/tf_static', latched)
        self._description_publisher = self.create_publisher(String, 'robot_description', latched)
        self._description_publisher.publish(String(data=description))
        now = self.get_clock().now().to_msg()
        fixed = [self._transform(joint) for joint in self._joints.values() if joint.kind in FIXED]
        for transform in fixed:
            transform.header.stamp = now
        self._static_publisher.publish(TFMessage(transforms=fixed))
        self.create_subscription(
            JointState, 'joint_states', self.joint_states_callback, qos_profile_sensor_data)
        self.get_logger().info('Robot initialized')

    def joint_states_callback(self, state: JointState) -> None:
        """Publish transforms of moving joints at a rate of at most `publish_frequency` (Hz)."""
        if len(state.name) != len(state.position):
            self.get_logger().error(
                'Robot state publisher ignored an invalid JointState message with '
                f'{len(state.position)} positions of the joints {state.name}')
        elif self._ignore_stamp or self._is_due(state):
            if state.name != self._names:
                self._names, self._sources = state.name, self._find_sources(state.name)
            for joint, index, factor, offset, transform in self._sources:
                fill(transform, joint.pose(factor * state.position[index] + offset))
                transform.header.stamp = state.header.stamp
            self._tf_publisher.publish(TFMessage(transforms=[row[-1] for row in self._sources]))

    def _is_due(self, state: JointState) -> bool:
        now = self.get_clock().now().nanoseconds
        stamp = state.header.stamp.sec * 1_000_000_000 + state.header.stamp.nanosec
        # As in the real node, the minimum interval is a whole number of milliseconds.
        interval = int(1000.0 / self._frequency) * 1_000_000 if self._frequency else 0
        last = min([self._published.get(name, 0) for name in state.name], default=now)
        if stamp < min(now, last) + interval:
            return False
        for name in state.name:
            self._published[name] = stamp
        return True

    def _find_sources(self, names: Iterable[str]
                      ) -> list[tuple[Joint, int, float, float, TransformStamped]]:
        """Return each moving joint with its index, factor, offset and reusable transform."""
        sources: dict[str, tuple[int, float, float]] = {}
        for index, name in enumerate(names):
            sources.setdefault(name, (index, 1.0, 0.0))
        for joint in self._joints.values():
            if joint.mimicked in sources:
                index, multiplier, offset = sources[joint.mimicked]
                sources.setdefault(joint.name, (index, joint.multiplier * multiplier,
                                                joint.multiplier * offset + joint.offset))
        moving = [(self._joints[name], source) for name, source in sorted(sources.items())
                  if name in self._joints and self._joints[name].kind in MOVING]
        return [(joint, *source, self._transform(joint)) for joint, source in moving]

    def _transform(self, joint: Joint) -> TransformStamped:
        return stamped(self._prefix + joint.parent, self._prefix + joint.child, 0,
                       joint.pose(0.0))


def make_node() -> RobotStatePublisher:
    """Create the node. The first command-line argument may be a URDF file."""
    files = [path for path in map(Path, remove_ros_args(sys.argv)[1:2]) if path.is_file()]
    return RobotStatePublisher(files[0].read_text(encoding='utf-8') if files else '')


def main() -> str | None:
    """Run the node until Ctrl-C or SIGTERM."""
    return run_node(make_node, 'robot_state_publisher')
