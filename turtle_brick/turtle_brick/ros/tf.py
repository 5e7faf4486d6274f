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

"""Frame names, QoS profiles, times, transform messages, lookups and a TF listener."""

from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import Transform, TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rclpy.timer import Timer
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException, TransformListener
from turtle_brick.core.geometry import IDENTITY, MAX_COORDINATE, Pose
from turtle_brick.core.time_steps import NS_PER_SECOND

# world --> odom --> base_link --> stem --> wheel
#   |                      '-----> post --> platform
#   '------> brick (a child of platform while it rides)
WORLD = 'world'
ODOM = 'odom'
BASE_LINK = 'base_link'
PLATFORM = 'platform'
BRICK = 'brick'

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""QoS for infrequent messages that late-joining subscribers must also receive."""

BEST_EFFORT = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
"""QoS for state subscriptions. With best effort, a lost message does not delay later messages. The
queue of 100 messages holds 0.2 s of traffic at 450 messages per second."""

MAX_AGE_NS = 500_000_000
"""Age (ns) beyond which the transform of a moving frame is ignored."""

MAX_AHEAD_NS = NS_PER_SECOND
"""Maximum time (ns) by which a timestamp may be ahead of the clock. A timestamp far in the future
would make tf2 discard all other transforms, because they would be more than 10 s older."""

BUFFER_DURATION_NS = 10_000_000_000
"""Age (ns), relative to a frame's newest transform, beyond which tf2 discards a transform."""

LENGTH_TOLERANCE = 0.01
"""Maximum deviation of a valid quaternion's squared length from 1."""

LATEST_TIME = Time()
"""Time value for which tf2 returns the latest transform."""

WARNING_PERIOD = 10.0
"""Minimum time (s) between two warnings of the same kind."""


def due_time(timer: Timer, now: int) -> int:
    """Return the time (ns) at which the current callback of a timer was due."""
    return now - max(timer.timer_period_ns - timer.time_until_next_call(), 0)


def nanoseconds_of(stamp: TimeMessage) -> int:
    """Convert a timestamp to nanoseconds."""
    return stamp.sec * NS_PER_SECOND + stamp.nanosec


def transform_message(parent: str, child: str, pose: Pose = Pose((0.0, 0.0, 0.0), IDENTITY),
                      stamp: TimeMessage | None = None) -> TransformStamped:
    """Return a message with the pose of the `child` frame in the `parent` frame."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    if stamp is not None:
        message.header.stamp = stamp
    set_transform(message.transform, pose)
    return message


def set_transform(transform: Transform, pose: Pose) -> None:
    """Write a pose to a transform message."""
    translation, rotation = transform.translation, transform.rotation
    translation.x, translation.y, translation.z = pose.position
    rotation.x, rotation.y, rotation.z, rotation.w = pose.orientation


def pose_of(transform: Transform) -> Pose:
    """Convert a transform message to a pose."""
    translation, rotation = transform.translation, transform.rotation
    return Pose((translation.x, translation.y, translation.z),
                (rotation.x, rotation.y, rotation.z, rotation.w))


def latest_world_to(buffer: Buffer, frame: str) -> TransformStamped | None:
    """Return the latest transform from world to a frame, or None if the transform is unknown."""
    try:
        return buffer.lookup_transform(WORLD, frame, LATEST_TIME)
    except TransformException:
        return None


def recent_world_to(buffer: Buffer, frame: str, now: int) -> TransformStamped | None:
    """
    Return the latest transform from world to a moving frame.

    :param now: current time (ns)
    :return: transform, or None if unknown, too old (MAX_AGE_NS) or too far ahead (MAX_AHEAD_NS)
    """
    transform = latest_world_to(buffer, frame)
    age = 0 if transform is None else now - nanoseconds_of(transform.header.stamp)
    return transform if -MAX_AHEAD_NS <= age <= MAX_AGE_NS else None


def rejection_reason(transform: TransformStamped, static: bool, now: int) -> str:
    """
    Return the reason for rejecting a transform, or an empty string if the transform is valid.

    Only transforms that would corrupt the TF buffer are rejected.

    :param static: whether the transform was received on /tf_static
    :param now: current time (ns)
    """
    translation, rotation = transform.transform.translation, transform.transform.rotation
    x, y, z = translation.x, translation.y, translation.z
    if not abs(x) + abs(y) + abs(z) <= MAX_COORDINATE:
        return f'has the translation ({x:g}, {y:g}, {z:g})'
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    if not abs(x * x + y * y + z * z + w * w - 1.0) <= LENGTH_TOLERANCE:
        return f'has the rotation ({x:g}, {y:g}, {z:g}, {w:g}), which is not a unit quaternion'
    stamp = transform.header.stamp
    if stamp.sec < 0 or stamp.nanosec >= NS_PER_SECOND:
        return f'has the invalid stamp {stamp.sec} s {stamp.nanosec} ns'
    age = now - nanoseconds_of(stamp)
    if not static and not -MAX_AHEAD_NS <= age <= BUFFER_DURATION_NS:
        return f'has a timestamp that is {abs(age) * 1e-9:g} s {"old" if age > 0 else "ahead"}'
    if transform.child_frame_id.removeprefix('/') == WORLD:
        return f'has the child "{WORLD}", which must not have a parent'
    return ''


class GuardedListener(TransformListener):
    """A TransformListener that rejects harmful transforms and logs a warning."""

    def __init__(self, buffer: Buffer, node: Node,
                 on_transform: Callable[[TransformStamped, int], Any] = lambda *_: None) -> None:
        """
        Subscribe to /tf (best effort) and /tf_static, and fill a TF buffer.

        :param on_transform: callback that receives each stored transform from /tf and its time of
            arrival (ns), called after all transforms in the message are stored
        """
        self._on_transform = on_transform
        self._is_static: dict[str, bool] = {}
        """For each child frame, whether its first transform was static."""
        self._last = 0
        self._next_warning = 0
        """Earliest time (ns) of the next warning about an ignored transform."""
        super().__init__(buffer, node, qos=BEST_EFFORT)

    def callback(self, data: TFMessage) -> None:
        """Store the valid transforms from a /tf message, and call `on_transform` for each one."""
        now = self.node.get_clock().now().nanoseconds
        for transform in self.store(data, False, now):
            self._on_transform(transform, now)

    def static_callback(self, data: TFMessage) -> None:
        """Store the valid transforms from a /tf_static message."""
        self.store(data, True, self.node.get_clock().now().nanoseconds)

    def store(self, message: TFMessage, static: bool, now: int) -> list[TransformStamped]:
        """Store and return all valid transforms in a message received at `now` (ns)."""
        if now < self._last:
            # The clock was set back, so all stored transforms may be in the future.
            self.buffer.clear()
            self._next_warning = 0
        self._last = now
        store = self.buffer.set_transform_static if static else self.buffer.set_transform
        stored = []
        for transform in message.transforms:
            reason = (rejection_reason(transform, static, now)
                      or self._frame_change(transform, static))
            if not reason:
                store(transform, 'default_authority')
                stored.append(transform)
            elif now >= self._next_warning:
                # throttle_duration_sec takes 0.2 ms per call, too long for high message rates.
                self._next_warning = now + round(WARNING_PERIOD * NS_PER_SECOND)
                self.node.get_logger().warning(
                    f'Ignored the transform from "{transform.header.frame_id[:40]}" to '
                    f'"{transform.child_frame_id[:40]}", because it {reason}')
        return stored

    def _frame_change(self, transform: TransformStamped, static: bool) -> str:
        """Return the reason for rejecting a transform that makes a frame static or moving."""
        child = transform.child_frame_id.removeprefix('/')
        if self._is_static.setdefault(child, static) == static:
            return ''
        return ('would turn a moving frame into a static one' if static else
                'would turn a static frame into a moving one')
