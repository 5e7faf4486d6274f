# SPDX-License-Identifier: Apache-2.0

"""
Run the graph in this process and in other processes, and judge it in live tests.

    with LiveGraph(domain_id) as live:
        live.add_robot()
        odom = live.record('odom', Odometry)
        live.wait_for(lambda: len(odom.messages) > 200, TIMEOUT, '200 odometry messages')
    assert all(message.child_frame_id == 'base_link' for message in odom.messages)

The nodes run while the test waits. The `domain_id` fixture in conftest.py reserves a ROS domain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
import os
import select
import signal
from time import monotonic
from typing import Any

from live_nodes import LATCHED, Listening, TIMEOUT
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSProfile
from turtle_brick.core.parameters import load
from turtle_brick_tools.graph import Graph
from turtle_graph.client.observer import Observer, PollingNode
from turtle_graph.client.processes import Process
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Record
from turtle_graph.referee.referee import RULES
from turtle_graph.referee.rules.rule import FAILED, MET, OPEN
from turtle_graph.referee.trial import FAR_OUT, IN_REACH, Program, Trial

__all__ = ['LATCHED', 'LiveGraph', 'TIMEOUT', 'add_nodes', 'observe', 'process',
           'results', 'wait_for_exits']

FETCH_PERIOD = 0.005
"""Minimum time (s) between two calls of LiveGraph.fetch()."""

RESPONSE_TIME = 3.0
"""Time (s) after which a request to a service is repeated."""

PROGRAM = Program(0.5, 2, (0.5, 0.0), (FAR_OUT, IN_REACH._replace(spare_time=0.8)), repetitions=0)
"""Requests of a short trial whose second brick can be caught even on a busy machine."""


class LiveGraph(Graph, Listening):
    """A graph that records topics, publishes messages and calls services."""

    def __init__(self, domain_id: int, **options: Any) -> None:
        super().__init__(domain_id, **options)
        self._fetch_time = 0.0
        self._clients: dict[str, Client] = {}
        self._recorder = PollingNode('recorder', context=self.context, namespace=self.namespace)
        self.listener = self.add(Node, parameters=False, node_name='listener',
                                 start_parameter_services=False)

    def __exit__(self, *_: object) -> None:
        self._recorder.destroy_node()
        super().__exit__()

    def spin_once(self) -> None:
        super().spin_once()
        if monotonic() > self._fetch_time + FETCH_PERIOD:
            self.fetch()

    def fetch(self) -> None:
        self._recorder.fetch()
        self._fetch_time = monotonic()

    def subscribe(self, message_type: Any, topic: str, add: Callable[[Any, Any], None],
                  qos: QoSProfile | int) -> None:
        self._recorder.subscribe(message_type, topic, add, qos)

    def call(self, service: str, service_type: type, request: Any = None) -> Any:
        """Call a service, and repeat the request if there is no response."""
        if service not in self._clients:
            self._clients[service] = self._recorder.create_client(service_type, service)
        client = self._clients[service]
        self.wait_for(client.service_is_ready, TIMEOUT, f'the service {service}')
        responses: list[Any] = []
        deadline = monotonic() + TIMEOUT
        while not responses:
            assert monotonic() < deadline, f'no response from {service}'
            # A node that has just started may not know this client yet.
            responses = self._recorder.call(
                client, service_type.Request() if request is None else request)
            with contextlib.suppress(TimeoutError):
                self.wait_for(lambda: responses, RESPONSE_TIME, f'a response from {service}')
        return responses[0].message


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


def wait_for_exits(descriptors: Sequence[int], timeout: float) -> None:
    """Wait for the exit of processes from os.pidfd_open(), even if init never reaps them."""
    for descriptor in descriptors:
        exited, _, _ = select.select([descriptor], [], [], timeout)
        os.close(descriptor)
        assert exited, f'a process is still running after {timeout:g} s'


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
