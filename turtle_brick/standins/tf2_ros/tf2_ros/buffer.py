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
"""The buffer of transforms that a node asks."""

from collections.abc import Callable
from threading import RLock

from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.task import Future
from rclpy.time import Time
from tf2_msgs.srv import FrameGraph
from tf2_ros.buffer_core import BufferCore, nanoseconds_of
from tf2_ros.buffer_interface import BufferInterface
from tf2_ros.exceptions import TransformException

AnyTime = Time | TimeMsg


class Buffer(BufferCore, BufferInterface):
    """
    A buffer of transforms that can wait for them.

    Given a node, it serves tf2_frames (tf2_msgs/srv/FrameGraph), a description of the frames, and
    forgets everything when the node's clock jumps back.
    """

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None
                 ) -> None:
        """
        Make an empty buffer.

        :param cache_time: How far each frame's transforms go back; 10 s if None.
        :param node: The node that serves tf2_frames and whose clock counts; none if None.
        """
        super().__init__(cache_time)
        self._new_data_callbacks: list[Callable[[], None]] = []
        self._callbacks_lock = RLock()
        if node is not None:
            self.srv = node.create_service(FrameGraph, 'tf2_frames', self._get_frames)
            self.clock = node.get_clock()
        else:
            self.clock = Clock()
        threshold = JumpThreshold(min_forward=None, min_backward=Duration(seconds=-1),
                                  on_clock_change=True)
        self.jump_handle = self.clock.create_jump_callback(
            threshold, post_callback=self.time_jump_callback)

    def time_jump_callback(self, time_jump: TimeJump) -> None:
        """
        Forget everything, since the clock has jumped back.

        :param time_jump: By how much.
        """
        get_logger('tf2_buffer').warning('Detected jump back in time. Clearing tf buffer.')
        self.clear()

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """
        Add a transform; one that cannot be used is ignored with a message in the log.

        :param transform: The pose of a child frame in a frame at a time.
        :param authority: Who says so.
        """
        super().set_transform(transform, authority)
        if self._new_data_callbacks:
            self._call_new_data_callbacks()

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """
        Add a transform that holds at all times.

        :param transform: The pose of a child frame in a frame.
        :param authority: Who says so.
        """
        super().set_transform_static(transform, authority)
        if self._new_data_callbacks:
            self._call_new_data_callbacks()

    def lookup_transform(self, target_frame: str, source_frame: str, time: AnyTime,
                         timeout: Duration = Duration()) -> TransformStamped:
        """
        Get a transform.

        :param target_frame: The frame to transform into.
        :param source_frame: The frame to transform from.
        :param time: The time; zero for the latest common one.
        :param timeout: How long to wait for it.
        :return: The pose of the source frame in the target frame.
        :raises TransformException: There is none.
        """
        if timeout.nanoseconds:
            self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: AnyTime
                                     ) -> TransformStamped:
        """
        Get a transform as soon as there is one.

        :param target_frame: The frame to transform into.
        :param source_frame: The frame to transform from.
        :param time: The time; zero for the latest common one.
        :return: The pose of the source frame in the target frame.
        """
        return await self.wait_for_transform_async(target_frame, source_frame, time)

    def lookup_transform_full(self, target_frame: str, target_time: AnyTime, source_frame: str,
                              source_time: AnyTime, fixed_frame: str,
                              timeout: Duration = Duration()) -> TransformStamped:
        """
        Get a transform between two times.

        :param target_frame: The frame to transform into.
        :param target_time: The time at which that is taken; zero for the latest.
        :param source_frame: The frame to transform from.
        :param source_time: The time at which that is taken; zero for the latest.
        :param fixed_frame: A frame that does not move in between.
        :param timeout: How long to wait for it.
        :return: The pose that the source frame had, in the target frame at its time.
        :raises TransformException: There is none.
        """
        if timeout.nanoseconds:
            self.can_transform_full(
                target_frame, target_time, source_frame, source_time, fixed_frame, timeout)
        return self.lookup_transform_full_core(
            target_frame, target_time, source_frame, source_time, fixed_frame)

    async def lookup_transform_full_async(self, target_frame: str, target_time: AnyTime,
                                          source_frame: str, source_time: AnyTime,
                                          fixed_frame: str) -> TransformStamped:
        """
        Get a transform between two times as soon as there is one.

        :param target_frame: The frame to transform into.
        :param target_time: The time at which that is taken; zero for the latest.
        :param source_frame: The frame to transform from.
        :param source_time: The time at which that is taken; zero for the latest.
        :param fixed_frame: A frame that does not move in between.
        :return: The pose that the source frame had, in the target frame at its time.
        """
        return await self.wait_for_transform_full_async(
            target_frame, target_time, source_frame, source_time, fixed_frame)

    def can_transform(self, target_frame: str, source_frame: str, time: AnyTime,
                      timeout: Duration = Duration(), return_debug_tuple: bool = False
                      ) -> bool | tuple[bool, str]:
        """
        Tell whether there is a transform.

        :param target_frame: The frame to transform into.
        :param source_frame: The frame to transform from.
        :param time: The time; zero for the latest common one.
        :param timeout: How long to wait for it.
        :param return_debug_tuple: Whether to say why not, too.
        :return: Whether there is; with the reason, if that is wanted.
        """
        return self._can(
            lambda: self.can_transform_core(target_frame, source_frame, time),
            timeout, return_debug_tuple)

    def can_transform_full(self, target_frame: str, target_time: AnyTime, source_frame: str,
                           source_time: AnyTime, fixed_frame: str,
                           timeout: Duration = Duration(), return_debug_tuple: bool = False
                           ) -> bool | tuple[bool, str]:
        """
        Tell whether there is a transform between two times.

        :param target_frame: The frame to transform into.
        :param target_time: The time at which that is taken; zero for the latest.
        :param source_frame: The frame to transform from.
        :param source_time: The time at which that is taken; zero for the latest.
        :param fixed_frame: A frame that does not move in between.
        :param timeout: How long to wait for it.
        :param return_debug_tuple: Whether to say why not, too.
        :return: Whether there is; with the reason, if that is wanted.
        """
        return self._can(
            lambda: self.can_transform_full_core(
                target_frame, target_time, source_frame, source_time, fixed_frame),
            timeout, return_debug_tuple)

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: AnyTime
                                 ) -> Future:
        """
        Wait for a transform without blocking.

        :param target_frame: The frame to transform into.
        :param source_frame: The frame to transform from.
        :param time: The time; zero for the latest common one.
        :return: A future whose result is the transform.
        """
        return self._future(
            lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def wait_for_transform_full_async(self, target_frame: str, target_time: AnyTime,
                                      source_frame: str, source_time: AnyTime, fixed_frame: str
                                      ) -> Future:
        """
        Wait for a transform between two times without blocking.

        :param target_frame: The frame to transform into.
        :param target_time: The time at which that is taken; zero for the latest.
        :param source_frame: The frame to transform from.
        :param source_time: The time at which that is taken; zero for the latest.
        :param fixed_frame: A frame that does not move in between.
        :return: A future whose result is the transform.
        """
        return self._future(
            lambda: self.lookup_transform_full_core(
                target_frame, target_time, source_frame, source_time, fixed_frame))

    def _can(self, ask: Callable[[], tuple[bool, str]], timeout: Duration, with_reason: bool
             ) -> bool | tuple[bool, str]:
        """
        Ask whether there is a transform, and wait for it.

        :param ask: What to ask.
        :param timeout: How long to wait for a yes.
        :param with_reason: Whether to say why not, too.
        :return: Whether there is; with the reason, if that is wanted.
        """
        nanoseconds = nanoseconds_of(timeout)
        if nanoseconds:
            self._wait_for(lambda: ask()[0], nanoseconds * 1e-9)
        answer = ask()
        return answer if with_reason else answer[0]

    def _future(self, lookup: Callable[[], TransformStamped]) -> Future:
        """
        Make a future for a transform.

        :param lookup: Gets the transform, or raises TransformException.
        :return: A future that is done as soon as there is the transform.
        """
        future = Future()

        def try_again() -> None:
            """Look the transform up, if nobody has done so or lost interest yet."""
            if future.done():
                return
            try:
                transform = lookup()
            except TransformException:
                return
            future.set_result(transform)

        with self._callbacks_lock:
            try_again()
            if not future.done():
                self._new_data_callbacks.append(try_again)
                future.add_done_callback(lambda _: self._forget(try_again))
        return future

    def _forget(self, callback: Callable[[], None]) -> None:
        """
        Stop to call somebody.

        :param callback: Whom.
        """
        with self._callbacks_lock:
            self._new_data_callbacks.remove(callback)

    def _call_new_data_callbacks(self) -> None:
        """Tell everybody who waits that there is a new transform."""
        with self._callbacks_lock:
            for callback in tuple(self._new_data_callbacks):
                callback()

    def _get_frames(self, request: FrameGraph.Request, response: FrameGraph.Response
                    ) -> FrameGraph.Response:
        """
        Describe the frames.

        :param request: Nothing.
        :param response: The description.
        :return: The response.
        """
        response.frame_yaml = self.all_frames_as_yaml()
        return response
