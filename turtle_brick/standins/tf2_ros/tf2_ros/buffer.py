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
from threading import Event
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.task import Future
from tf2_msgs.srv import FrameGraph
from tf2_ros.buffer_core import AnyTime, BufferCore, nanoseconds_of, TransformException


class Buffer(BufferCore):
    """
    A buffer of transforms that can wait for them.

    Given a node, it serves tf2_frames (tf2_msgs/srv/FrameGraph), a description of the frames, and
    forgets everything when the node's clock jumps back.
    """

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None) -> None:
        """Make an empty buffer in which each frame's transforms go back so far; 10 s if None."""
        super().__init__(cache_time)
        self._waiting: list[Callable[[], None]] = []
        if node is not None:
            self.srv = node.create_service(FrameGraph, 'tf2_frames', self._get_frames)
        self.clock = Clock() if node is None else node.get_clock()
        self.jump_handle = self.clock.create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(seconds=-1),
                          on_clock_change=True), post_callback=self.time_jump_callback)

    def time_jump_callback(self, time_jump: TimeJump) -> None:
        """Forget everything, since the clock has jumped back."""
        get_logger('tf2_buffer').warning('Detected jump back in time. Clearing tf buffer.')
        self.clear()

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform; one that cannot be used is ignored with a message in the log."""
        super().set_transform(transform, authority)
        self._tell_who_waits()

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform that holds at all times."""
        super().set_transform_static(transform, authority)
        self._tell_who_waits()

    def lookup_transform(self, target_frame: str, source_frame: str, time: AnyTime,
                         timeout: Duration = Duration()) -> TransformStamped:
        """
        Return the pose of the source frame in the target frame.

        :param time: The time; zero for the latest common one.
        :param timeout: How long to wait for it.
        :raises TransformException: There is none.
        """
        if timeout.nanoseconds:
            self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def lookup_transform_full(self, target_frame: str, target_time: AnyTime, source_frame: str,
                              source_time: AnyTime, fixed_frame: str,
                              timeout: Duration = Duration()) -> TransformStamped:
        """
        Return the pose that the source frame had, in the target frame at another time.

        :param fixed_frame: A frame that does not move in between.
        :param timeout: How long to wait for it.
        :raises TransformException: There is none.
        """
        if timeout.nanoseconds:
            self.can_transform_full(
                target_frame, target_time, source_frame, source_time, fixed_frame, timeout)
        return self.lookup_transform_full_core(
            target_frame, target_time, source_frame, source_time, fixed_frame)

    def can_transform(self, target_frame: str, source_frame: str, time: AnyTime,
                      timeout: Duration = Duration(), return_debug_tuple: bool = False
                      ) -> bool | tuple[bool, str]:
        """Tell whether there is a transform within a time, and if asked for, why not."""
        arguments = target_frame, source_frame, time
        self._wait(timeout, self.wait_for_transform_async, arguments)
        answer = self.can_transform_core(*arguments)
        return answer if return_debug_tuple else answer[0]

    def can_transform_full(self, target_frame: str, target_time: AnyTime, source_frame: str,
                           source_time: AnyTime, fixed_frame: str,
                           timeout: Duration = Duration(), return_debug_tuple: bool = False
                           ) -> bool | tuple[bool, str]:
        """Tell whether there is one between two times within a time, and if asked for, why not."""
        arguments = target_frame, target_time, source_frame, source_time, fixed_frame
        self._wait(timeout, self.wait_for_transform_full_async, arguments)
        answer = self.can_transform_full_core(*arguments)
        return answer if return_debug_tuple else answer[0]

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: AnyTime
                                 ) -> Future:
        """Return a future for what lookup_transform() returns."""
        return self._future(lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def wait_for_transform_full_async(self, target_frame: str, target_time: AnyTime,
                                      source_frame: str, source_time: AnyTime, fixed_frame: str
                                      ) -> Future:
        """Return a future for what lookup_transform_full() returns."""
        return self._future(lambda: self.lookup_transform_full_core(
            target_frame, target_time, source_frame, source_time, fixed_frame))

    async def lookup_transform_async(self, *arguments: str | AnyTime) -> TransformStamped:
        """Return what lookup_transform() returns, as soon as there is one."""
        return await self.wait_for_transform_async(*arguments)

    async def lookup_transform_full_async(self, *arguments: str | AnyTime) -> TransformStamped:
        """Return what lookup_transform_full() returns, as soon as there is one."""
        return await self.wait_for_transform_full_async(*arguments)

    @staticmethod
    def _wait(timeout: Duration, begin: Callable[..., Future], arguments: tuple[Any, ...]) -> None:
        """Wait for a future, if there is time for that."""
        if not nanoseconds_of(timeout):
            return
        done = Event()
        future = begin(*arguments)
        future.add_done_callback(lambda _: done.set())
        done.wait(nanoseconds_of(timeout) * 1e-9)
        future.cancel()

    def _future(self, lookup: Callable[[], TransformStamped]) -> Future:
        future = Future()

        def try_again() -> None:
            try:
                transform = lookup()
            except TransformException:
                return
            if not future.done():
                future.set_result(transform)

        def forget(_: Future) -> None:
            with self._lock:
                self._waiting.remove(try_again)

        with self._lock:
            self._waiting.append(try_again)
            future.add_done_callback(forget)
            try_again()
        return future

    def _tell_who_waits(self) -> None:
        if self._waiting:
            with self._lock:
                for try_again in tuple(self._waiting):
                    try_again()

    def _get_frames(self, request: FrameGraph.Request, response: FrameGraph.Response
                    ) -> FrameGraph.Response:
        response.frame_yaml = self.all_frames_as_yaml()
        return response
