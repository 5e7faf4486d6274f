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
Live tests: a graph of one's own in this process, nodes in processes, what is heard of them.

    with graph(domain_id) as live:
        live.add_robot()
        odom = live.record('odom', Odometry)
        live.wait_for(lambda: len(odom.messages) > 200, 20.0, '200 odometry messages')
    assert all(message.child_frame_id == 'base_link' for message in odom.messages)

The nodes work while the test waits. The fixture `domain_id` (conftest.py) gives a test a ROS
domain that nobody else is in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
import signal
from time import monotonic
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from turtle_brick.tools.graph import Graph
from turtle_referee.graph_client.observer import DEPTH, PollingNode
from turtle_referee.graph_client.processes import Process
from turtle_referee.graph_client.record import message_rate

FETCH_PERIOD = 0.005
"""How often (s) one looks at what has come."""

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""To hear the last messages of a latched topic, however many publish it, or to latch some."""

TIMEOUT = 30.0
"""How long (s) something may take that comes at once on a quiet machine."""

ENDED = (0, -signal.SIGALRM)
"""The status of what was asked to end: the second one where the middleware kept it from ending."""


class Recording:
    """The messages of a topic, in the order of their arrival."""

    def __init__(self) -> None:
        """Start with none."""
        self.messages: list[Any] = []
        self.times: list[float] = []
        """When each message was published, by the system's clock (s)."""

    def keep(self, message: Any, info: Mapping[str, int]) -> None:
        """Keep a message."""
        self.times.append(info['source_timestamp'] * 1e-9)
        self.messages.append(message)

    def clear(self) -> None:
        """Forget what has arrived so far."""
        del self.messages[:], self.times[:]

    @property
    def last(self) -> Any:
        """Return the latest message, or None if there is none."""
        return self.messages[-1] if self.messages else None


class LiveGraph(Graph):
    """A graph with somebody in it who listens and asks."""

    def __init__(self, domain_id: int, **options: Any) -> None:
        """Start in a ROS domain; see Graph."""
        super().__init__(domain_id, **options)
        self._fetched = 0.0
        self._ears = PollingNode('ears', context=self.context, namespace=self.namespace)
        self.listener = self.add(Node, parameters=False, node_name='listener',
                                 start_parameter_services=False)
        """Who publishes and asks."""

    def close(self) -> None:
        """End every node."""
        self._ears.destroy_node()
        super().close()

    def wait_for(self, predicate: Callable[[], Any], timeout: float, what: str) -> Any:
        """
        Let the nodes work until something is so, and return what the predicate then returns.

        :param timeout: how long (s) at most
        :raises TimeoutError: It was not so in time; the message says what was waited for.
        """
        found: list[Any] = []

        def look() -> bool:
            if monotonic() > self._fetched + FETCH_PERIOD:
                self.hear()
            found[:] = [predicate()]
            return bool(found[0])

        self.spin_until(look, timeout, what)
        return found[0]

    def hear(self) -> None:
        """Add to the recordings what has come."""
        self._ears.fetch()
        self._fetched = monotonic()

    def record(self, topic: str, message_type: type, qos: QoSProfile | int = DEPTH) -> Recording:
        """Record a topic from now on, while the nodes work; deep, so that nothing is lost."""
        recording = Recording()
        self._ears.subscribe(message_type, topic, recording.keep, qos)
        return recording

    def record_transforms(self, child: str, topic: str = '/tf',
                          qos: QoSProfile | int = DEPTH) -> Recording:
        """Record the transforms to a frame from now on, as they come on /tf or /tf_static."""
        recording = Recording()

        def keep(message: TFMessage, info: Mapping[str, int]) -> None:
            for transform in message.transforms:
                if transform.child_frame_id == child:
                    recording.keep(transform, info)

        self._ears.subscribe(TFMessage, topic, keep, qos)
        return recording

    def rates(self, recordings: Sequence[Recording], count: int) -> list[float]:
        """Return how often (Hz) the next messages of recordings are published, so many of each."""
        self.wait_for(lambda: all(recording.messages for recording in recordings), TIMEOUT,
                      'all to be heard')
        for recording in recordings:
            recording.clear()
        self.wait_for(lambda: all(len(recording.times) >= count for recording in recordings),
                      TIMEOUT, f'{count} messages on each topic')
        return [message_rate(recording.times) for recording in recordings]

    def publisher(self, topic: str, message_type: type, qos: QoSProfile | int = 10) -> Publisher:
        """Make a publisher that somebody hears."""
        publisher = self.listener.create_publisher(message_type, topic, qos)
        self.wait_for(publisher.get_subscription_count, TIMEOUT, f'somebody to hear {topic}')
        return publisher

    def call(self, service: str, service_type: type, request: Any = None) -> Any:
        """Return a service's response."""
        client = self.listener.create_client(service_type, service)
        self.wait_for(client.service_is_ready, TIMEOUT, f'the service {service}')
        future = client.call_async(service_type.Request() if request is None else request)
        self.wait_for(future.done, TIMEOUT, f'an answer of {service}')
        self.listener.destroy_client(client)
        return future.result()


graph = LiveGraph
"""What tests call it: `with graph(domain_id) as live`."""


class NodeProcess(Process):
    """A process in a ROS domain, with what it prints."""

    def __init__(self, command: Sequence[str], domain_id: int,
                 environment: Mapping[str, str] = {}) -> None:
        """Start a program with its arguments, and with further variables."""
        super().__init__(command, {**environment, 'ROS_DOMAIN_ID': str(domain_id),
                                   'PYTHONFAULTHANDLER': '1'})


@contextlib.contextmanager
def process(command: Sequence[str], domain_id: int, *, stop: int | None = signal.SIGINT,
            timeout: float = TIMEOUT) -> Iterator[NodeProcess]:
    """
    Run a program with its arguments, and see that it ends as it should.

    :param stop: the signal that ends it; None if the test has ended it or does not care
    :param timeout: how long (s) it may take to end
    """
    running = NodeProcess(command, domain_id)
    try:
        yield running
        if stop is not None:
            status = running.stop(stop, timeout)
            assert status in ENDED, (
                f'{running.command} ended with status {status}; it printed:\n{running.output}')
    finally:
        running.kill()
