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

from collections import deque
from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import Transform, TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException, TransformListener
from turtle_brick.core.geometry import FARTHEST, IDENTITY, Pose
from turtle_brick.core.time_steps import NANOSECONDS, nanoseconds_of
from turtle_brick.ros.throttling import Warner

WORLD = 'world'
ODOM = 'odom'
BASE_LINK = 'base_link'
PLATFORM = 'platform'
BRICK = 'brick'

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For what seldom changes and late joiners need."""

OLDEST = 500_000_000
"""Age (ns) above which a transform no longer tells where a moving frame is."""

AHEAD = 5_000_000_000
"""How far (ns) ahead of a node's clock the stamp of a transform may be. tf2 drops what is 10 s
older than the latest transform of a frame: one from far ahead would shut out all that follow."""

ECHO = NANOSECONDS
"""Time (ns) for which transforms may arrive that were stamped before the clock was set back. Those
whose stamps are nearer to the time before are left out: in a buffer they would be the latest."""

PAST = 10_000_000_000
"""Age (ns) above which tf2 drops a transform, each with a message in the log."""

STEADY = 50
"""Transforms per second on /tf from which on a frame counts as moving, whatever /tf_static says;
one with fewer stays where /tf_static says."""

LENGTH_TOLERANCE = 0.01
"""Largest deviation of the square of a quaternion's length from 1, as in tf2."""

LATEST = Time()
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


def latest(buffer: Buffer, frame: str) -> TransformStamped | None:
    """Return the latest transform from the world to a frame, None if there is none yet."""
    try:
        return buffer.lookup_transform(WORLD, frame, LATEST)
    except TransformException:
        return None


def recent(buffer: Buffer, frame: str, now: int) -> Pose | None:
    """
    Return the latest pose of a moving frame in the world.

    :param buffer: what is known
    :param frame: the frame
    :param now: the present instant (ns)
    :return: The pose, None if it is unknown or older than OLDEST.
    """
    transform = latest(buffer, frame)
    if transform is None:
        return None
    age = now - nanoseconds_of(transform.header.stamp)
    return pose_of(transform.transform) if -AHEAD <= age <= OLDEST else None


class Guard:
    """
    Refuse transforms that would do a buffer lasting harm.

    Anybody may publish transforms. A stamp from the future, a static frame replaced by a moving
    one or a frame torn off the world would hide what comes after.
    """

    def __init__(self) -> None:
        """Know no frames yet."""
        self._parents: dict[str, str] = {}
        self._static: dict[str, bool] = {}
        self._claims: dict[str, deque[int]] = {}
        self._now = 0
        self._jump = 0
        self._echo_ends = 0

    def admit(self, transform: TransformStamped, static: bool, now: int) -> str:
        """
        Check a transform, and remember its frames if it can be used.

        :param transform: the transform
        :param static: whether it came on /tf_static
        :param now: the present instant (ns)
        :return: What is wrong, in words that name frames and value; empty if it can be used.
        """
        reason = self._check(transform, static, now)
        if reason:
            return (f'the transform from "{transform.header.frame_id[:40]}" to '
                    f'"{transform.child_frame_id[:40]}" {reason}')
        return ''

    def _check(self, transform: TransformStamped, static: bool, now: int) -> str:
        """Admit a transform, or return what is wrong with it, without its frames."""
        place, turn = transform.transform.translation, transform.transform.rotation
        if not abs(place.x) + abs(place.y) + abs(place.z) <= FARTHEST:
            return f'leads to ({place.x:g}, {place.y:g}, {place.z:g})'
        x, y, z, w = turn.x, turn.y, turn.z, turn.w
        if not abs(x * x + y * y + z * z + w * w - 1.0) <= LENGTH_TOLERANCE:
            return f'has the quaternion ({x:g}, {y:g}, {z:g}, {w:g}), which is no unit quaternion'
        stamp = transform.header.stamp
        if stamp.sec < 0 or stamp.nanosec >= NANOSECONDS:
            return f'has the stamp {stamp.sec} s {stamp.nanosec} ns, which is no time'
        age = now - nanoseconds_of(stamp)
        self._notice_jump(now)
        if not static and not -self._ahead(now) <= age <= PAST:
            return f'has a stamp that is {abs(age) * 1e-9:g} s {"old" if age > 0 else "ahead"}'
        parent = transform.header.frame_id.removeprefix('/')
        child = transform.child_frame_id.removeprefix('/')
        if not parent or not child:
            return 'names no frame'
        if child == WORLD:
            return f'gives "{WORLD}" a parent, but it is the root of all frames'
        self._count(child, static, now)
        steady = self._is_steady(child, now)
        if self._static.get(child, static) is not static and steady is static:
            return f'came on {_topic(static)}, but the frame is known from {_topic(not static)}'
        if self._parents.get(child) != parent:
            above = self._up_from(parent)
            known = self._static.get(child) if static else WORLD in self._up_from(child)
            if known and WORLD not in above:
                return f'would tear "{child}" off'
            if static and not known and child in above:
                # A static transform comes only once. The loop is the fault of the moving frames:
                # forget their parents, which come again if they are right.
                for frame in above[:above.index(child)]:
                    if not self._static[frame]:
                        del self._parents[frame]
                above = self._up_from(parent)
            if child in above:
                return 'would close a loop'
            self._parents[child] = parent
        self._static[child] = static
        return ''

    def _notice_jump(self, now: int) -> None:
        """Notice that the clock was set back."""
        if self._now - now > OLDEST:
            self._jump, self._echo_ends = self._now - now, now + ECHO
        self._now = now

    def _ahead(self, now: int) -> int:
        """Return how far (ns) ahead a stamp may be: less for a while after time went back."""
        return min(AHEAD, self._jump // 2) if now < self._echo_ends else AHEAD

    def _count(self, frame: str, static: bool, now: int) -> None:
        """Count a transform of a frame, if it came on /tf, once per message."""
        claims = self._claims.setdefault(frame, deque(maxlen=STEADY))
        if not static and (not claims or now != claims[-1]):
            claims.append(now)

    def _is_steady(self, frame: str, now: int) -> bool:
        """Tell whether a frame comes on /tf as often as a moving one."""
        claims = self._claims[frame]
        return len(claims) == STEADY and now - claims[0] <= NANOSECONDS

    def _up_from(self, frame: str) -> list[str]:
        """Return a frame and all above it."""
        way = [frame]
        while way[-1] in self._parents:
            way.append(self._parents[way[-1]])
        return way


def _topic(static: bool) -> str:
    return '/tf_static' if static else '/tf'


class Intake:
    """Fill a buffer with the transforms that the Guard lets pass."""

    def __init__(self, buffer: Buffer, complain: Callable[[str, str], Any],
                 jitter: int = 0) -> None:
        """
        Begin with an empty buffer.

        :param buffer: what to fill
        :param complain: called with the topic of a transform that is left out, and a sentence why
        :param jitter: how far back (ns) the time may go without the clock having been set back
        """
        self._buffer = buffer
        self._complain = complain
        self._jitter = jitter
        self._guard = Guard()
        self._now = 0

    def take_in(self, message: TFMessage, static: bool, now: int) -> list[TransformStamped]:
        """Fill the buffer with the transforms that can be used now (ns), and return them."""
        if now < self._now - self._jitter:
            self._buffer.clear()  # Else transforms from before the jump would stay the latest.
        self._now = now
        keep = self._buffer.set_transform_static if static else self._buffer.set_transform
        taken = []
        for transform in message.transforms:
            refusal = self._guard.admit(transform, static, now)
            if refusal:
                self._complain(_topic(static), f'Left out: {refusal}')
            else:
                keep(transform, 'default_authority')
                taken.append(transform)
        return taken


class GuardedListener(TransformListener):
    """A TransformListener that leaves out, with a warning, what the Guard refuses."""

    def __init__(self, buffer: Buffer, node: Node,
                 on_transform: Callable[[TransformStamped], Any] | None = None) -> None:
        """
        Listen to /tf and /tf_static.

        :param buffer: what to fill
        :param node: the node to listen with
        :param on_transform: called with each transform of /tf, in order, once its message is in
            the buffer; also with those that arrive together because the machine was busy
        """
        warner = Warner(node)
        self._intake = Intake(buffer, lambda _, sentence: warner.warn('transform', sentence))
        self._on_transform = on_transform
        super().__init__(buffer, node)

    def callback(self, data: TFMessage) -> None:
        """Take in a message of /tf."""
        for transform in self._take_in(data, False):
            if self._on_transform is not None:
                self._on_transform(transform)

    def static_callback(self, data: TFMessage) -> None:
        """Take in a message of /tf_static."""
        self._take_in(data, True)

    def _take_in(self, data: TFMessage, static: bool) -> list[TransformStamped]:
        return self._intake.take_in(data, static, self.node.get_clock().now().nanoseconds)
