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

from typing import Callable
from typing import Optional

from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import Transform
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from tf2_ros import TransformException
from tf2_ros import TransformListener
from turtle_brick.geometry import Pose

WORLD = 'world'
ODOM = 'odom'
BASE_LINK = 'base_link'
PLATFORM = 'platform'
BRICK = 'brick'

OLDEST = 500_000_000
"""Age (ns) at which a transform no longer tells where a moving frame is."""

LATEST = Time()
"""The time that asks tf2 for the latest transform."""


def set_stamp(stamp: TimeMessage, nanoseconds: int) -> None:
    """Write an instant (ns) into a message's stamp."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, 1_000_000_000)


def nanoseconds_of(stamp: TimeMessage) -> int:
    """Return the instant (ns) of a message's stamp."""
    return stamp.sec * 1_000_000_000 + stamp.nanosec


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


def latest(buffer: Buffer, frame: str, time: Time = LATEST) -> Optional[TransformStamped]:
    """
    Return the latest transform from the world to a frame, or that at a time.

    Args:
        buffer: what is known of the frames
        frame: the frame
        time: the time; if the frame is not known then, the latest transform is as good

    Returns:
        The transform, None where there is none yet.
    """
    try:
        return buffer.lookup_transform(WORLD, frame, time)
    except TransformException:
        return None if time is LATEST else latest(buffer, frame)


def is_old(transform: TransformStamped, now: int) -> bool:
    """Tell whether a transform no longer says where a moving frame is at an instant (ns)."""
    return now - nanoseconds_of(transform.header.stamp) > OLDEST


def recent(buffer: Buffer, frame: str, now: int) -> Optional[Pose]:
    """Return the pose of a frame in the world, None unless it is known from the last 0.5 s."""
    transform = latest(buffer, frame)
    if transform is None or is_old(transform, now):
        return None
    return pose_of(transform.transform)


class OthersListener(TransformListener):
    """A TransformListener that does not hear what its own node says of a frame."""

    def __init__(self, buffer: Buffer, node: Node, own: str) -> None:
        """
        Listen to /tf and /tf_static.

        Args:
            buffer: what to fill
            node: the node to listen with
            own: the frame that this node broadcasts, each time in a message of its own

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


class FrameListener(TransformListener):
    """A TransformListener that also says when a frame has moved."""

    def __init__(self, buffer: Buffer, node: Node, frame: str,
                 on_news: Callable[[TransformStamped], None]) -> None:
        """
        Listen to /tf and /tf_static.

        Args:
            buffer: what to fill
            node: the node to listen with
            frame: the frame whose news matter
            on_news: called with each transform of the frame, in order, the buffer up to date: also
                those that a busy machine made come together

        """
        self._frame = frame
        self._on_news = on_news
        super().__init__(buffer, node)

    def callback(self, data: TFMessage) -> None:
        """Take in a message of /tf."""
        super().callback(data)
        for transform in data.transforms:
            if transform.child_frame_id == self._frame:
                self._on_news(transform)
