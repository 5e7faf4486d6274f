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
Run nodes in this process and in other processes, and record topics in live tests.

    with graph(domain_id) as live:
        live.add_robot()
        odom = live.record('odom', Odometry)
        live.wait_for(lambda: len(odom.messages) > 200, TIMEOUT, '200 odometry messages')
    assert all(message.child_frame_id == 'base_link' for message in odom.messages)

The nodes run while the test waits. The `domain_id` fixture in conftest.py reserves a ROS domain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
import signal
from time import monotonic
from typing import Any

from graph_client.observer import DEPTH, Observer, PollingNode
from graph_client.processes import Process
from graph_client.profiles import Profile
from graph_client.record import message_rate, Record
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from turtle_brick.core.parameters import load
from turtle_brick.tools.graph import Graph
from turtle_referee.referee import RULES
from turtle_referee.rules.rule import FAILED, MET, OPEN
from turtle_referee.trial import FAR_OUT, IN_REACH, Program, Trial

FETCH_PERIOD = 0.005
"""Minimum time (s) between two calls of LiveGraph.fetch()."""

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""QoS of a latched topic that stores up to ten messages."""

TIMEOUT = 120.0
"""Timeout (s) for events that occur immediately on an idle machine."""

MAX_PAUSE = 0.015
"""Maximum pause (s) between two spins. After a longer pause, 100 Hz timers may skip calls."""

CALM_TIMEOUT = 5.0
"""Time (s) after which LiveGraph.rates() stops repeating interrupted measurements."""

PROGRAM = Program(0.5, 2, (0.5, 0.0), (FAR_OUT, IN_REACH._replace(spare_time=0.8)))
"""Requests of a short trial whose second brick can be caught even on a busy machine."""


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


class LiveGraph(Graph):
    """A graph that records topics, publishes messages and calls services."""

    def __init__(self, domain_id: int, **options: Any) -> None:
        super().__init__(domain_id, **options)
        self._fetch_time = self._spin_time = 0.0
        self.is_calm = True
        """Whether all pauses between spins in the last measurement were shorter than MAX_PAUSE."""
        self._recorder = PollingNode('recorder', context=self.context, namespace=self.namespace)
        self.listener = self.add(Node, parameters=False, node_name='listener',
                                 start_parameter_services=False)

    def __exit__(self, *_: object) -> None:
        self._recorder.destroy_node()
        super().__exit__()

    def wait_for(self, predicate: Callable[[], Any], timeout: float, what: str) -> Any:
        """Spin until a predicate is true and return its value. Raise TimeoutError on timeout."""
        result: list[Any] = []

        def check() -> bool:
            last, self._spin_time = self._spin_time, monotonic()
            self.is_calm = self.is_calm and self._spin_time < last + MAX_PAUSE
            if self._spin_time > self._fetch_time + FETCH_PERIOD:
                self.fetch()
            result[:] = [predicate()]
            return bool(result[0])

        self.spin_until(check, timeout, what)
        return result[0]

    def fetch(self) -> None:
        self._recorder.fetch()
        self._fetch_time = monotonic()

    def record(self, topic: str, message_type: type, qos: QoSProfile | int = DEPTH) -> Recording:
        recording = Recording()
        self._recorder.subscribe(message_type, topic, recording.add, qos)
        return recording

    def record_transforms(self, child: str, topic: str = '/tf',
                          qos: QoSProfile | int = DEPTH) -> Recording:
        recording = Recording()

        def add(message: TFMessage, info: Mapping[str, int]) -> None:
            for transform in message.transforms:
                if transform.child_frame_id == child:
                    recording.add(transform, info)

        self._recorder.subscribe(TFMessage, topic, add, qos)
        return recording

    def rates(self, recordings: Sequence[Recording], count: int) -> list[float]:
        """
        Measure the publication rate (Hz) of `count` messages in each recording.

        During the first CALM_TIMEOUT seconds, a pause longer than MAX_PAUSE restarts the
        measurement. A later pause sets `is_calm` to False.
        """
        self.wait_for(lambda: all(recording.messages for recording in recordings), TIMEOUT,
                      'a message on each topic')
        deadline = monotonic() + CALM_TIMEOUT
        while True:
            for recording in recordings:
                recording.clear()
            self.is_calm, self._spin_time = True, monotonic()
            self.wait_for(
                lambda: not self.is_calm and monotonic() < deadline
                or all(len(recording.times) >= count for recording in recordings),
                TIMEOUT, f'{count} messages on each topic')
            if self.is_calm or monotonic() > deadline:
                return [message_rate(recording.times) for recording in recordings]

    def publisher(self, topic: str, message_type: type, qos: QoSProfile | int = 10) -> Publisher:
        publisher = self.listener.create_publisher(message_type, topic, qos)
        self.wait_for(publisher.get_subscription_count, TIMEOUT, f'a subscription to {topic}')
        return publisher

    def call(self, service: str, service_type: type, request: Any = None) -> Any:
        # An EventsExecutor can lose a response while it registers a new client.
        client = self._recorder.create_client(service_type, service)
        self.wait_for(client.service_is_ready, TIMEOUT, f'the service {service}')
        responses = self._recorder.call(
            client, service_type.Request() if request is None else request)
        self.wait_for(lambda: responses, TIMEOUT, f'a response from {service}')
        self._recorder.destroy_client(client)
        return responses[0].message


graph = LiveGraph
"""Short name for tests: `with graph(domain_id) as live`."""


def add_nodes(graph: Graph) -> dict[str, Any]:
    return {name: getattr(graph, f'add_{name}')() for name in (
        'turtlesim', 'robot_state_publisher', 'robot', 'arena', 'catcher')}


def observe(graph: Graph, log: Callable[[str], Any] = lambda text: None, **options: Any) -> Record:
    """Run a referee trial on a graph, and return the record."""
    observer = graph.add(Observer, parameters=False, profile=Profile.from_parameters(load()))
    Trial(graph, observer, log, **options).run()
    return observer.record


def results(record: Record) -> dict[str, dict[str, str]]:
    """Judge a record, and return the results grouped by mark (FAILED, OPEN or MET)."""
    found: dict[str, dict[str, str]] = {FAILED: {}, OPEN: {}, MET: {}}
    for one in RULES.judge(record):
        found[one.mark][one.name] = one.measured
    return found


class NodeProcess(Process):

    def __init__(self, command: Sequence[str], domain_id: int,
                 environment: Mapping[str, str] = {}) -> None:
        super().__init__(command, {**environment, 'ROS_DOMAIN_ID': str(domain_id),
                                   'PYTHONFAULTHANDLER': '1'})


@contextlib.contextmanager
def process(command: Sequence[str], domain_id: int, *, stop: int | None = signal.SIGINT,
            timeout: float = TIMEOUT) -> Iterator[NodeProcess]:
    """
    Run a command and check that its process exits with status 0.

    :param stop: signal that stops the program, or None to kill it without checking its status
    :param timeout: time (s) within which the program must exit after the signal
    """
    running = NodeProcess(command, domain_id)
    try:
        yield running
        if stop is not None:
            try:
                status, expected = running.stop(stop, timeout), 0
            except TimeoutError:
                # In rare cases, Fast DDS blocks a shutdown (see node_main).
                status, expected = running.stop(signal.SIGTERM, timeout), -signal.SIGTERM
            assert status == expected, (
                f'{running.command} ended with status {status}; it printed:\n{running.output}')
    finally:
        running.kill()
