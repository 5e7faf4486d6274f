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

"""What the nodes share about TF: frame names, poses as messages and back, news of a frame."""

from collections import deque
from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import Transform
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from tf2_ros import TransformException
from tf2_ros import TransformListener
from turtle_brick.geometry import FARTHEST
from turtle_brick.geometry import Pose
from turtle_brick.step_clock import NANOSECONDS
from turtle_brick.throttling import Warner

WORLD = 'world'
ODOM = 'odom'
BASE_LINK = 'base_link'
PLATFORM = 'platform'
BRICK = 'brick'

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For what does not change by the second and late joiners need."""

OLDEST = 500_000_000
"""Age (ns) at which a transform no longer tells where a moving frame is."""

AHEAD = 5_000_000_000
"""How far (ns) ahead of a node's clock the stamp of a transform may be. One from farther ahead
would outlast all that come after it: tf2 forgets what is 10 s older than its latest, and so hears
nothing else of that frame until its time comes."""

ECHO = NANOSECONDS
"""How long (ns) after a clock was set back transforms may come that were stamped before. They are
those whose stamps are nearer to the time before: in a buffer they would be the latest."""

PAST = 10_000_000_000
"""Age (ns) at which tf2 refuses a transform, with a message in the log for each."""

STEADY = 50
"""Transforms per second on /tf with which a frame is taken to move, whatever /tf_static says; one
with less is taken to stand where /tf_static says, if it says so."""

LENGTH_TOLERANCE = 0.01
"""How much the square of a quaternion's length may differ from 1, as tf2 has it."""

LATEST = Time()
"""The time that asks tf2 for the latest transform."""


def set_stamp(stamp: TimeMessage, nanoseconds: int) -> None:
    """Write an instant (ns) into a message's stamp."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, NANOSECONDS)


def nanoseconds_of(stamp: TimeMessage) -> int:
    """Return the instant (ns) of a message's stamp."""
    return stamp.sec * NANOSECONDS + stamp.nanosec


def set_transform(transform: Transform, pose: Pose) -> None:
    """Write a pose into a transform message."""
    translation, rotation = transform.translation, transform.rotation
    translation.x, translation.y, translation.z = pose.position
    rotation.x, rotation.y, rotation.z, rotation.w = pose.orientation


def pose_of(transform: Transform) -> Pose:
    """Return the pose that a transform message holds."""
    translation, rotation = transform.translation, transform.rotation
    return Pose((translation.x, translation.y, translation.z),
                (rotation.x, rotation.y, rotation.z, rotation.w))


def between(parent: str, child: str) -> TransformStamped:
    """Return a message for the transform from one frame to another, to be filled in."""
    message = TransformStamped()
    message.header.frame_id = parent
    message.child_frame_id = child
    return message


def latest(buffer: Buffer, frame: str) -> TransformStamped | None:
    """Return the latest transform from the world to a frame, None where there is none yet."""
    try:
        return buffer.lookup_transform(WORLD, frame, LATEST)
    except TransformException:
        return None


def is_old(transform: TransformStamped, now: int) -> bool:
    """Tell whether a transform no longer says where a moving frame is at an instant (ns)."""
    return not -AHEAD <= now - nanoseconds_of(transform.header.stamp) <= OLDEST


def recent(buffer: Buffer, frame: str, now: int) -> Pose | None:
    """Return the pose of a frame in the world, None unless it is known from the last 0.5 s."""
    transform = latest(buffer, frame)
    if transform is None or is_old(transform, now):
        return None
    return pose_of(transform.transform)


class Guard:
    """
    Tell which transforms a buffer can take without going blind for what comes after them.

    Anybody may publish transforms, and one that is bad can do lasting harm: a stamp from the
    future, a static frame replaced by a moving one, a frame that is torn off the world.
    """

    def __init__(self) -> None:
        """Know no frames yet."""
        self._parents: dict[str, str] = {}
        self._static: dict[str, bool] = {}
        self._claims: dict[str, deque[int]] = {}
        self._now = 0
        self._jump = 0
        self._echo_ends = 0

    def refusal(self, transform: TransformStamped, static: bool, now: int) -> str:
        """
        Say what is wrong with a transform.

        :param transform: the transform
        :param static: whether it came on /tf_static
        :param now: the present instant (ns)
        :return: What is wrong, in words that name frames and value; empty if it can be used.
        """
        reason = self._reason(transform, static, now)
        if reason:
            return (f'the transform from "{transform.header.frame_id[:40]}" to '
                    f'"{transform.child_frame_id[:40]}" {reason}')
        return ''

    def _reason(self, transform: TransformStamped, static: bool, now: int) -> str:
        """Say what is wrong with a transform, without naming it."""
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
        if not static and not -self._ahead(now) <= age <= PAST:
            return f'has a stamp that is {abs(age) * 1e-9:g} s {"old" if age > 0 else "ahead"}'
        parent = transform.header.frame_id.removeprefix('/')
        child = transform.child_frame_id.removeprefix('/')
        if not parent or not child:
            return 'names no frame'
        if child == WORLD:
            return f'puts "{WORLD}" somewhere, from where everything is measured'
        steady = self._is_steady(child, static, now)
        if self._static.get(child, static) is not static and steady is static:
            return f'came on {_topic(static)}, but the frame is known from {_topic(not static)}'
        if self._parents.get(child) != parent:
            above = self._up_from(parent)
            known = self._static.get(child) if static else WORLD in self._up_from(child)
            if known and WORLD not in above:
                return f'would tear "{child}" off'
            if static and not known and child in above:
                # It is said once: a loop is the fault of what moves, which is said again if true.
                for frame in above[:above.index(child)]:
                    if not self._static[frame]:
                        del self._parents[frame]
                above = self._up_from(parent)
            if child in above:
                return 'would close a loop'
            self._parents[child] = parent
        self._static[child] = static
        return ''

    def _ahead(self, now: int) -> int:
        """Return how far (ns) ahead a stamp may be now (ns): not for long where time went back."""
        if self._now - now > OLDEST:
            self._jump, self._echo_ends = self._now - now, now + ECHO
        self._now = now
        return min(AHEAD, self._jump // 2) if now < self._echo_ends else AHEAD

    def _is_steady(self, frame: str, static: bool, now: int) -> bool:
        """Tell whether a frame is broadcast on /tf so often that it moves, this time counted."""
        claims = self._claims.setdefault(frame, deque(maxlen=STEADY))
        if not static and (not claims or now != claims[-1]):  # One message counts once.
            claims.append(now)
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
    """Fills a buffer that nobody can spoil; also when the clock is set back."""

    def __init__(self, buffer: Buffer, complain: Callable[[str, str], Any],
                 jitter: int = 0) -> None:
        """
        Begin with an empty buffer.

        :param buffer: what to fill
        :param complain: told of which topic a transform is left out, and why, in a sentence
        :param jitter: how far back (ns) the time may go without having been set back
        """
        self._buffer = buffer
        self._complain = complain
        self._jitter = jitter
        self._guard = Guard()
        self._now = 0

    def take_in(self, message: TFMessage, static: bool, now: int) -> list[TransformStamped]:
        """Fill the buffer with the transforms that can be used now (ns), and return them."""
        if now < self._now - self._jitter:
            self._buffer.clear()  # What was to come would outlast what comes now.
        self._now = now
        keep = self._buffer.set_transform_static if static else self._buffer.set_transform
        taken = []
        for transform in message.transforms:
            refusal = self._guard.refusal(transform, static, now)
            if refusal:
                self._complain(_topic(static), f'Left out: {refusal}')
            else:
                keep(transform, 'default_authority')
                taken.append(transform)
        return taken


class GuardedListener(TransformListener):
    """A TransformListener whose buffer nobody can spoil; also when the clock is set back."""

    def __init__(self, buffer: Buffer, node: Node) -> None:
        """
        Listen to /tf and /tf_static.

        :param buffer: what to fill
        :param node: the node to listen with
        """
        warner = Warner(node)
        self._intake = Intake(buffer, lambda _, sentence: warner.warn('transform', sentence))
        super().__init__(buffer, node)

    def callback(self, data: TFMessage) -> None:
        """Take in a message of /tf."""
        self.take_in(data, False)

    def static_callback(self, data: TFMessage) -> None:
        """Take in a message of /tf_static."""
        self.take_in(data, True)

    def take_in(self, data: TFMessage, static: bool) -> list[TransformStamped]:
        """Fill the buffer with the transforms that can be used, and return them."""
        return self._intake.take_in(data, static, self.node.get_clock().now().nanoseconds)


class OthersListener(GuardedListener):
    """A listener that does not hear what its own node says of a frame."""

    def __init__(self, buffer: Buffer, node: Node, own: str) -> None:
        """
        Listen to /tf and /tf_static.

        :param buffer: what to fill
        :param node: the node to listen with
        :param own: the frame that this node broadcasts, each time in a message of its own
        """
        self._own = own
        self.news = False
        """Whether anything has come since somebody last set this to False."""
        super().__init__(buffer, node)

    def callback(self, data: TFMessage) -> None:
        """Take in a message of /tf."""
        if data.transforms and data.transforms[0].child_frame_id == self._own:
            return
        self.news = True
        super().callback(data)


class FrameListener(GuardedListener):
    """A listener that also says when a frame has moved."""

    def __init__(self, buffer: Buffer, node: Node, frame: str,
                 on_news: Callable[[TransformStamped], None]) -> None:
        """
        Listen to /tf and /tf_static.

        :param buffer: what to fill
        :param node: the node to listen with
        :param frame: the frame whose news matter
        :param on_news: called with each transform of the frame, in order, the buffer up to date:
            also those that a busy machine made come together
        """
        self._frame = frame
        self._on_news = on_news
        super().__init__(buffer, node)

    def callback(self, data: TFMessage) -> None:
        """Take in a message of /tf."""
        for transform in self.take_in(data, False):
            if transform.child_frame_id == self._frame:
                self._on_news(transform)
