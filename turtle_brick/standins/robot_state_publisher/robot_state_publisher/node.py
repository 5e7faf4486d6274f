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
A node that stands in for robot_state_publisher 3.3.3, for machines that lack it.

Publishes:
    /tf (tf2_msgs/msg/TFMessage): the links that joints move, after joint states
    /tf_static (tf2_msgs/msg/TFMessage): the links of fixed joints, latched
    robot_description (std_msgs/msg/String): the parameter of that name, latched

Subscribes:
    joint_states (sensor_msgs/msg/JointState): the joints' positions

ROS parameters, which do not change while it runs:
    robot_description (string): the robot's URDF; required
    publish_frequency (double, 20.0): the highest rate of /tf in Hz, at most 1000; zero sets no
        limit. It goes by the stamps of joint_states.
    ignore_timestamp (bool, false): whether to publish after every message, whatever its stamp
    frame_prefix (string, empty): what to put before the names of frames
"""

from functools import lru_cache
from gc import freeze
from signal import alarm, pthread_sigmask, SIG_BLOCK, SIGINT, SIGTERM, sigtimedwait
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile
from rclpy.signals import SignalHandlerOptions
from robot_state_publisher.description import Joint, parse
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage


class Step(NamedTuple):
    """What to do with one position of a message, by its index: fill in a joint's transform."""

    index: int
    multiplier: float  # of a joint that mimics another
    offset: float
    joint: Joint
    transform: TransformStamped


def place(stamped: TransformStamped, joint: Joint, position: float, stamp: Time
          ) -> TransformStamped:
    """Fill in a joint's transform at a position (rad or m), and return it."""
    stamped.header.stamp = stamp
    translation, rotation = stamped.transform.translation, stamped.transform.rotation
    ((translation.x, translation.y, translation.z),
     (rotation.x, rotation.y, rotation.z, rotation.w)) = joint.pose(position)
    return stamped


class RobotStatePublisher(Node):
    """Publishes the poses of a robot's links; the module's docstring lists its interface."""

    def __init__(self, **node_arguments: Any) -> None:
        """Publish the fixed links and subscribe to joint states."""
        super().__init__('robot_state_publisher', **node_arguments)
        description, self._frequency, self._prefix, self._ignore_stamp = (
            self.declare_parameter(name, default, ParameterDescriptor(read_only=True)).value
            for name, default in (('robot_description', ''), ('publish_frequency', 20.0),
                                  ('frame_prefix', ''), ('ignore_timestamp', False)))
        if not description:
            raise ValueError('robot_description parameter must not be empty')
        if not 0.0 <= self._frequency <= 1000.0:
            raise ValueError(
                f'publish_frequency must be between 0 and 1000, but is {self._frequency}')

        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._joints = parse(description)
        # The steps for some joints; a sender always has the same ones.
        self._plan = lru_cache(self._make_plan)
        # When each joint was last published, by the stamps of joint_states, in ns.
        self._published: dict[str, int] = {}
        self._last_call = 0

        self._tf_publisher = self.create_publisher(TFMessage, '/tf', QoSProfile(depth=100))
        self._static_publisher = self.create_publisher(TFMessage, '/tf_static', latched)
        self._description_publisher = self.create_publisher(String, 'robot_description', latched)
        self._description_publisher.publish(String(data=description))
        now = self.get_clock().now().to_msg()
        self._static_publisher.publish(TFMessage(transforms=[
            place(self._transform(joint), joint, 0.0, now)
            for joint in self._joints.values() if joint.is_fixed]))
        self.create_subscription(
            JointState, 'joint_states', self.joint_states_callback, qos_profile_sensor_data)
        self.get_logger().info('Robot initialized')

    def joint_states_callback(self, state: JointState) -> None:
        """Publish the moving links, unless the last message was too recent."""
        names = tuple(state.name)
        positions = state.position
        if len(names) != len(positions):
            return self.get_logger().error(
                f'Robot state publisher ignored an invalid JointState message of {names}')
        if not self._is_due(names, state):
            return
        self._tf_publisher.publish(TFMessage(transforms=[
            place(stamped, joint, multiplier * positions[index] + offset, state.header.stamp)
            for index, multiplier, offset, joint, stamped in self._plan(names)]))

    def _is_due(self, names: tuple[str, ...], state: JointState) -> bool:
        """Tell whether a message is due after the last one; if so, record it."""
        now = self.get_clock().now().nanoseconds
        published = self._published
        if now < self._last_call:
            self.get_logger().warning(
                'Moved backwards in time, re-publishing joint transforms!')
            published.clear()
        self._last_call = now
        stamp = state.header.stamp.sec * 1_000_000_000 + state.header.stamp.nanosec
        # The interval is a whole number of milliseconds, as in the real node.
        interval = int(1000.0 / self._frequency) * 1_000_000 if self._frequency else 0
        last = min([published.get(name, 0) for name in names], default=now)
        if stamp < min(now, last) + interval and not self._ignore_stamp:
            return False
        for name in names:
            published[name] = stamp
        return True

    def _make_plan(self, names: tuple[str, ...]) -> list[Step]:
        """Return the steps that publish the links of some joints."""
        sources: dict[str, tuple[int, float, float]] = {}
        for index, name in enumerate(names):
            sources.setdefault(name, (index, 1.0, 0.0))
        for joint in self._joints.values():
            followed, factor, shift = joint.mimic
            if followed in sources:
                index, multiplier, offset = sources[followed]
                sources.setdefault(
                    joint.name, (index, multiplier * factor, offset * factor + shift))
        return [Step(*source, self._joints[name], self._transform(self._joints[name]))
                for name, source in sorted(sources.items())
                if name in self._joints and self._joints[name].moves]

    def _transform(self, joint: Joint) -> TransformStamped:
        """Make the transform of a joint, to be filled in."""
        stamped = TransformStamped()
        stamped.header.frame_id = self._prefix + joint.parent
        stamped.child_frame_id = self._prefix + joint.child
        return stamped


def main(args: list[str] | None = None) -> str | None:
    """Run the node until Ctrl-C or SIGTERM, which wait until they are looked for."""
    signals = {SIGINT, SIGTERM}
    pthread_sigmask(SIG_BLOCK, signals)
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = RobotStatePublisher()
    except (ParameterException, RuntimeError, ValueError) as error:
        rclpy.try_shutdown()
        return f'robot_state_publisher: {error}'
    executor = EventsExecutor()
    executor.add_node(node)
    # Otherwise the garbage collector delays transforms by some tens of milliseconds.
    freeze()
    while not sigtimedwait(signals, 0):
        executor.spin_once(timeout_sec=0.1)
    alarm(4)  # Fast DDS may wait for ever
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return None
