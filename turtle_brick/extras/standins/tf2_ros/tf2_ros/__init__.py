# SPDX-License-Identifier: Apache-2.0
"""
The pure Python stand-in for the tf2_ros module from tf2_ros_py 0.36.4.

The callbacks of TransformListener run in the executor of its node. The README for the stand-ins
lists missing features.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
import sys
from threading import Thread
from typing import Any, NoReturn

from geometry_msgs.msg import TransformStamped
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from tf2_msgs.msg import TFMessage
from tf2_ros.buffer_core import (AnyTime, BufferCore, ConnectivityException,
                                 ExtrapolationException, InvalidArgumentException, LookupException,
                                 TimeoutException, TransformException)

__all__ = [
    'Buffer', 'BufferCore', 'ConnectivityException', 'ExtrapolationException',
    'InvalidArgumentException', 'LookupException', 'StaticTransformBroadcaster',
    'TimeoutException', 'TransformBroadcaster', 'TransformException', 'TransformListener',
    'TransformRegistration', 'TypeException',
]

for name in ('buffer', 'buffer_client', 'buffer_interface', 'static_transform_broadcaster',
             'transform_broadcaster', 'transform_listener'):  # submodules of the real package
    sys.modules[f'{__name__}.{name}'] = globals()[name] = sys.modules[__name__]


def missing(name: str) -> str:
    """Return an error message that explains why a name is missing from this stand-in."""
    return (f'{name} is not in the stand-in for tf2_ros: check its spelling, use another feature, '
            'or install the real ROS 2 Jazzy')


def __getattr__(name: str) -> NoReturn:
    raise (ImportError if name[:1].isupper() else AttributeError)(missing(name))


class TypeException(Exception):
    """Raised for a message type that no imported module can transform."""


class TransformRegistration:
    """The functions that transform stamped messages, keyed by message type."""

    _functions: dict[type, Callable[[Any, TransformStamped], Any]] = {}

    def add(self, key: type, callback: Callable[[Any, TransformStamped], Any]) -> None:
        self._functions[key] = callback

    def get(self, key: type) -> Callable[[Any, TransformStamped], Any]:
        if key not in self._functions:
            raise TypeException(f'Type {key} is not loaded or supported')
        return self._functions[key]


class Buffer(BufferCore):
    """A transform buffer that can wait for transforms."""

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None) -> None:
        super().__init__(cache_time)
        self._futures: dict[Future, tuple[str, str, AnyTime]] = {}
        """Arguments of wait_for_transform_async, keyed by unfinished future."""

    def __getattr__(self, name: str) -> NoReturn:
        raise AttributeError(missing(f'Buffer.{name}'))

    def lookup_transform(self, target_frame: str, source_frame: str, time: AnyTime,
                         timeout: Duration = Duration()) -> TransformStamped:
        """
        Return the pose of the source frame in the target frame.

        :param time: time of the transform, or zero for the latest common time
        :param timeout: maximum time to wait for the transform
        :raises TransformException: if the transform is unavailable
        """
        if timeout != Duration():
            self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def transform(self, object_stamped: Any, target_frame: str, timeout: Duration = Duration(),
                  new_type: type | None = None) -> Any:
        """
        Return a stamped message in the target frame.

        :raises TypeException: if no imported module, such as tf2_geometry_msgs, has registered the
            message type
        :raises TransformException: if the transform is unavailable
        """
        function = TransformRegistration().get(type(object_stamped))
        if new_type not in (None, type(object_stamped)):
            raise TypeException(missing('A new_type that differs from the type of the message'))
        header = object_stamped.header
        return function(object_stamped, self.lookup_transform(
            target_frame, header.frame_id, header.stamp, timeout))

    def can_transform(self, target_frame: str, source_frame: str, time: AnyTime,
                      timeout: Duration = Duration(), return_debug_tuple: bool = False
                      ) -> bool | tuple[bool, str]:
        """Return whether a transform becomes available within a timeout."""
        def answer() -> tuple[bool, str]:
            return self.can_transform_core(target_frame, source_frame, time)

        if not isinstance(timeout, Duration):
            raise TypeError(f'timeout is {timeout!r}, but must be an rclpy.duration.Duration')
        with self._changed:
            self._changed.wait_for(lambda: answer()[0], timeout.nanoseconds * 1e-9)
            return answer() if return_debug_tuple else answer()[0]

    def _insert(self, transform: TransformStamped, authority: str, static: bool) -> None:
        super()._insert(transform, authority, static)
        self._complete_futures()

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: AnyTime
                                 ) -> Future:
        future = Future()
        with self._changed:
            self._futures[future] = target_frame, source_frame, time
        self._complete_futures()
        return future

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: AnyTime
                                     ) -> TransformStamped:
        await self.wait_for_transform_async(target_frame, source_frame, time)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def _complete_futures(self) -> None:
        with self._changed:
            for future, arguments in list(self._futures.items()):
                if self.can_transform_core(*arguments)[0]:
                    del self._futures[future]
                    future.set_result(self.lookup_transform_core(*arguments))


class TransformListener:
    """Subscriptions to /tf and /tf_static that fill a transform buffer."""

    def __init__(self, buffer: Buffer, node: Node, *, spin_thread: bool = False,
                 qos: QoSProfile | int | None = None, static_qos: QoSProfile | int | None = None
                 ) -> None:
        self.buffer = buffer
        self.node = node
        # The reentrant group lets transforms arrive while another callback waits for a transform.
        self.group = ReentrantCallbackGroup()
        self.tf_sub = node.create_subscription(
            TFMessage, '/tf', self.callback, qos or QoSProfile(depth=100),
            callback_group=self.group)
        self.tf_static_sub = node.create_subscription(
            TFMessage, '/tf_static', self.static_callback, static_qos or QoSProfile(
                depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL), callback_group=self.group)
        if spin_thread:
            Thread(target=self._spin, daemon=True).start()

    def _spin(self) -> None:
        executor = SingleThreadedExecutor(context=self.node.context)
        executor.add_node(self.node)
        with suppress(ExternalShutdownException):
            executor.spin()

    def unregister(self) -> None:
        self.node.destroy_subscription(self.tf_sub)
        self.node.destroy_subscription(self.tf_static_sub)

    def callback(self, data: TFMessage) -> None:
        for transform in data.transforms:
            self.buffer.set_transform(transform, 'default_authority')

    def static_callback(self, data: TFMessage) -> None:
        for transform in data.transforms:
            self.buffer.set_transform_static(transform, 'default_authority')


def as_list(transform: TransformStamped | Iterable[TransformStamped]) -> list[TransformStamped]:
    return list(transform) if hasattr(transform, '__iter__') else [transform]


class TransformBroadcaster:
    """A publisher of transforms on /tf."""

    def __init__(self, node: Node, qos: QoSProfile | int | None = None) -> None:
        self.pub_tf = node.create_publisher(TFMessage, '/tf', qos or QoSProfile(depth=100))

    def sendTransform(self, transform: TransformStamped | Iterable[TransformStamped]) -> None:
        self.pub_tf.publish(TFMessage(transforms=as_list(transform)))


class StaticTransformBroadcaster:
    """
    A latched publisher of transforms on /tf_static.

    Every message contains all transforms sent so far, so that late subscribers receive them. Only
    the first transform of each child frame is published, as in tf2_ros_py 0.36.4.
    """

    def __init__(self, node: Node, qos: QoSProfile | int | None = None) -> None:
        self.pub_tf = node.create_publisher(TFMessage, '/tf_static', qos or QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.net_message = TFMessage()
        self._child_frame_ids: set[str] = set()

    def sendTransform(self, transform: TransformStamped | Iterable[TransformStamped]) -> None:
        for item in as_list(transform):
            if item.child_frame_id not in self._child_frame_ids:
                self._child_frame_ids.add(item.child_frame_id)
                self.net_message.transforms.append(item)
        self.pub_tf.publish(self.net_message)
