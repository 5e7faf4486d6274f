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

"""What the nodes share about TF: names of frames, transform messages, and listeners."""

from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import Transform, TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException, TransformListener
from turtle_brick.core.geometry import IDENTITY, MAX_COORDINATE, Pose
from turtle_brick.core.time_steps import nanoseconds_of, NS_PER_SECOND
from turtle_brick.ros.node_main import Warner

WORLD = 'world'
ODOM = 'odom'
BASE_LINK = 'base_link'
PLATFORM = 'platform'
BRICK = 'brick'

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For what seldom changes and late joiners need."""

BEST_EFFORT = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For subscriptions to what only the latest value of counts: a message that got lost does not hold
back those that follow. Room for the transforms of 0.2 s: three nodes broadcast 450 per second."""

MAX_AGE_NS = 500_000_000
"""Age (ns) above which a transform no longer tells where a moving frame is."""

MAX_AHEAD_NS = NS_PER_SECOND
"""How far (ns) ahead of a node's clock the stamp of a transform may be. tf2 drops what is 10 s
older than the latest transform of a frame: one from far ahead would shut out all that follow."""

BUFFER_DURATION_NS = 10_000_000_000
"""Age (ns) above which tf2 drops a transform, each with a message in the log."""

LENGTH_TOLERANCE = 0.01
"""Largest deviation of the square of a quaternion's length from 1."""

LATEST_TIME = Time()
"""The time that asks tf2 for the latest transform."""


def transform_message(parent: str, child: str, pose: Pose = Pose((0.0, 0.0, 0.0), IDENTITY),
                      stamp: TimeMessage | None = None) -> TransformStamped:
    """Return the message that the frame `child` has a pose in the frame `parent`."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    if stamp is not None:
        message.header.stamp = stamp
    set_transform(message.transform, pose)
    return message


def set_transform(transform: Transform, pose: Pose) -> None:
    """Write a pose into a transform message."""
    translation, rotation = transform.translation, transform.rotation
    translation.x, translation.y, translation.z = pose.position
    rotation.x, rotation.y, rotation.z, rotation.w = pose.orientation


def pose_of(transform: Transform) -> Pose:
    """Return the pose in a transform message."""
    translation, rotation = transform.translation, transform.rotation
    return Pose((translation.x, translation.y, translation.z),
                (rotation.x, rotation.y, rotation.z, rotation.w))


def latest_transform(buffer: Buffer, frame: str) -> TransformStamped | None:
    """Return the latest transform from the world to a frame, None if there is none yet."""
    try:
        return buffer.lookup_transform(WORLD, frame, LATEST_TIME)
    except TransformException:
        return None


def recent_pose(buffer: Buffer, frame: str, now: int) -> Pose | None:
    """
    Return the latest pose of a moving frame in the world.

    :param buffer: what is known
    :param frame: the frame
    :param now: the present instant (ns)
    :return: The pose, None if it is unknown or older than MAX_AGE_NS.
    """
    transform = latest_transform(buffer, frame)
    if transform is None:
        return None
    age = now - nanoseconds_of(transform.header.stamp)
    return pose_of(transform.transform) if -MAX_AHEAD_NS <= age <= MAX_AGE_NS else None


def rejection_reason(transform: TransformStamped, static: bool, now: int) -> str:
    """
    Tell whether a transform would do a buffer, or who reads it, harm that stays.

    Anybody may publish transforms, and what else is wrong with one is put right by the next.

    :param transform: the transform
    :param static: whether it came on /tf_static
    :param now: the present instant (ns)
    :return: What is wrong with it, in words that name the value; empty if it can be used.
    """
    place, turn = transform.transform.translation, transform.transform.rotation
    if not abs(place.x) + abs(place.y) + abs(place.z) <= MAX_COORDINATE:
        return f'leads to ({place.x:g}, {place.y:g}, {place.z:g})'
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    if not abs(x * x + y * y + z * z + w * w - 1.0) <= LENGTH_TOLERANCE:
        return f'has the quaternion ({x:g}, {y:g}, {z:g}, {w:g}), which is no unit quaternion'
    stamp = transform.header.stamp
    if stamp.sec < 0 or stamp.nanosec >= NS_PER_SECOND:
        return f'has the stamp {stamp.sec} s {stamp.nanosec} ns, which is no time'
    age = now - nanoseconds_of(stamp)
    if not static and not -MAX_AHEAD_NS <= age <= BUFFER_DURATION_NS:
        return f'has a stamp that is {abs(age) * 1e-9:g} s {"old" if age > 0 else "ahead"}'
    if transform.child_frame_id.removeprefix('/') == WORLD:
        return f'gives "{WORLD}" a parent, but it is the root of all frames'
    return ''


class GuardedListener(TransformListener):
    """A TransformListener that leaves out, with a warning, what would do lasting harm."""

    def __init__(self, buffer: Buffer, node: Node,
                 on_transform: Callable[[TransformStamped, int], Any] = lambda *_: None) -> None:
        """
        Listen to /tf, best effort, and to /tf_static.

        :param buffer: what to fill
        :param node: the node to listen with
        :param on_transform: called with each transform of /tf, in order, once its message is in
            the buffer, and with the instant (ns) at which that came; also with those that arrive
            together because the machine was busy
        """
        self._warner = Warner(node)
        self._on_transform = on_transform
        self._last = 0
        super().__init__(buffer, node, qos=BEST_EFFORT)

    def callback(self, data: TFMessage) -> None:
        """Take in a message of /tf."""
        now = self._now()
        for transform in self.store(data, False, now):
            self._on_transform(transform, now)

    def static_callback(self, data: TFMessage) -> None:
        """Take in a message of /tf_static."""
        self.store(data, True, self._now())

    def store(self, message: TFMessage, static: bool, now: int) -> list[TransformStamped]:
        """Fill the buffer with the transforms that can be used now (ns), and return them."""
        if now < self._last:
            self.buffer.clear()  # Else transforms from before the jump would stay the latest.
        self._last = now
        keep = self.buffer.set_transform_static if static else self.buffer.set_transform
        taken = []
        for transform in message.transforms:
            harm = rejection_reason(transform, static, now)
            if harm:
                self._warner.warn('/tf_static' if static else '/tf', (
                    f'Left out: the transform from "{transform.header.frame_id[:40]}" to '
                    f'"{transform.child_frame_id[:40]}" {harm}'))
            else:
                keep(transform, 'default_authority')
                taken.append(transform)
        return taken

    def _now(self) -> int:
        """Return the present instant (ns)."""
        return self.node.get_clock().now().nanoseconds
