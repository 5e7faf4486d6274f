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
Run nodes in this process, and record, publish and call what a test needs.

    with LiveNodes(domain_id) as live:
        live.add(TurtleRobot)
        odom = live.record('odom', Odometry)
        live.wait_for(lambda: len(odom.messages) > 200, TIMEOUT, '200 odometry messages')
    assert all(message.child_frame_id == 'base_link' for message in odom.messages)

The nodes run while the test waits. The `domain_id` fixture in conftest.py reserves a ROS domain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import monotonic
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from tf2_msgs.msg import TFMessage
from turtle_brick.core.parameters import default_path

DEPTH = 2000
"""Queue size of each subscription, sufficient for several seconds of messages."""

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""QoS of a latched topic that stores up to ten messages."""

TIMEOUT = 120.0
"""Timeout (s) for events that occur immediately on an idle machine."""


class Recording:
    """The messages received on a topic, in order of arrival."""

    def __init__(self) -> None:
        self.messages: list[Any] = []
        self.times: list[float] = []
        """System time (s) at which each message was published."""

    def add(self, message: Any, info: Mapping[str, int]) -> None:
        self.times.append(info['source_timestamp'] * 1e-9)
        self.messages.append(message)

    def clear(self) -> None:
        del self.messages[:], self.times[:]

    @property
    def last(self) -> Any:
        return self.messages[-1] if self.messages else None

    def rate(self) -> float:
        """
        Return how many messages per second (Hz) were published.

        On a busy machine, messages may be late but never early. The rate is therefore measured
        between the least delayed messages in the first third and in the last third.
        """
        count = len(self.times)
        period = (self.times[-1] - self.times[0]) / (count - 1)
        lateness = [time - number * period for number, time in enumerate(self.times)]
        first = min(range(count // 3), key=lateness.__getitem__)
        last = min(range(count - count // 3, count), key=lateness.__getitem__)
        return (last - first) / (self.times[last] - self.times[first])


class Listening:
    """Base class for recording topics, publishing messages and waiting for events."""

    listener: Node
    """Node that publishes the messages and has no parameters."""

    def spin_once(self) -> None:
        """Execute pending callbacks, and wait briefly if there are none."""
        raise NotImplementedError

    def subscribe(self, message_type: Any, topic: str, add: Callable[[Any, Any], None],
                  qos: QoSProfile | int) -> None:
        """Call `add` with each message and its publication time."""
        raise NotImplementedError

    def wait_for(self, predicate: Callable[[], Any], timeout: float, what: str) -> Any:
        """Spin until a predicate is true and return its value. Raise TimeoutError on timeout."""
        deadline = monotonic() + timeout
        while not (result := predicate()):
            if monotonic() > deadline:
                raise TimeoutError(f'{what}: not within {timeout:g} s')
            self.spin_once()
        return result

    def require_rate(self, recordings: Sequence[Recording], rate: float, tolerance: float,
                     predicate: Callable[[], Any] = lambda: True) -> None:
        """
        Record until, for 3 s, each recording had a given rate (Hz) and the predicate was true.

        On an overloaded machine, a node may be late for seconds, but no node that has another rate
        ever has this one for 3 s.
        """
        measured = []
        while len(measured) < 10:
            measured.append(self.rates(recordings))
            if all(abs(found - rate) <= tolerance for found in measured[-1]) and predicate():
                return
        raise AssertionError(f'The rates were {measured} Hz instead of {rate:g} Hz')

    def rates(self, recordings: Sequence[Recording], seconds: float = 3.0) -> list[float]:
        """Return the publication rate (Hz) of each recording during the next seconds."""
        self.wait_for(lambda: all(recording.messages for recording in recordings), TIMEOUT,
                      'a message on each topic')
        for recording in recordings:
            recording.clear()
        end = monotonic() + seconds
        self.wait_for(lambda: monotonic() > end, seconds + TIMEOUT, f'the next {seconds:g} s')
        return [recording.rate() for recording in recordings]

    def record(self, topic: str, message_type: type, qos: QoSProfile | int = DEPTH) -> Recording:
        recording = Recording()
        self.subscribe(message_type, topic, recording.add, qos)
        return recording

    def record_transforms(self, child: str, topic: str = '/tf',
                          qos: QoSProfile | int = DEPTH) -> Recording:
        recording = Recording()

        def add(message: TFMessage, info: Mapping[str, int]) -> None:
            for transform in message.transforms:
                if transform.child_frame_id == child:
                    recording.add(transform, info)

        self.subscribe(TFMessage, topic, add, qos)
        return recording

    def publisher(self, topic: str, message_type: type, qos: QoSProfile | int = 10) -> Publisher:
        publisher = self.listener.create_publisher(message_type, topic, qos)
        self.wait_for(publisher.get_subscription_count, TIMEOUT, f'a subscription to {topic}')
        return publisher


class LiveNodes(Listening):
    """Nodes that run in one process and communicate with all nodes in a ROS domain."""

    def __init__(self, domain_id: int) -> None:
        self.context = Context()
        rclpy.init(args=[], context=self.context, domain_id=domain_id,
                   signal_handler_options=SignalHandlerOptions.NO)
        self.executor: Executor = SingleThreadedExecutor(context=self.context)
        self.nodes: list[Node] = []
        self.listener = self.add(Node, parameters=False, node_name='listener',
                                 start_parameter_services=False)

    def __enter__(self) -> LiveNodes:
        return self

    def __exit__(self, *_: object) -> None:
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.context.try_shutdown()

    def add(self, node_type: type[Any], *ros_arguments: str, parameters: bool = True,
            **options: Any) -> Any:
        """
        Add a node and pass `options` to its constructor.

        :param ros_arguments: arguments after --ros-args, such as '-r', 'cmd_vel:=turtle1/cmd_vel'
        :param parameters: whether the node receives the parameter file
        """
        arguments = ['--ros-args', *ros_arguments]
        if parameters:
            arguments += ['--params-file', str(default_path())]
        node = node_type(context=self.context, cli_args=arguments, use_global_arguments=False,
                         **options)
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def spin_once(self) -> None:
        self.executor.spin_once(timeout_sec=0.02)

    def subscribe(self, message_type: Any, topic: str, add: Callable[[Any, Any], None],
                  qos: QoSProfile | int) -> None:
        def on_message(message: Any, info: Mapping[str, int]) -> None:
            add(message, info)

        self.listener.create_subscription(message_type, topic, on_message, qos)
