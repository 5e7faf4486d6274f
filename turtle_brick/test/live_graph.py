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

    with graph(domain_id, TurtleRobot) as live:
        odom = live.record('odom', Odometry)
        live.wait_for(lambda: len(odom.messages) > 200, 5.0, '200 odometry messages')
    assert all(message.child_frame_id == 'base_link' for message in odom.messages)

The fixture `domain_id` (conftest.py) gives a test a ROS domain that nobody else is in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
import signal
import threading
import time
from typing import Any, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from turtle_brick.ros.node_main import make_executor, SLEEP_TIME
from turtle_referee.processes import Process

Result = TypeVar('Result')

# How often (s) a condition is looked at that nothing in the graph reports, such as a discovery.
GLANCE = 0.01


# ------------------------------------------------------------------------------ what is heard

class Recording:
    """The messages of a topic, in the order of their arrival."""

    def __init__(self, name: str) -> None:
        """
        Start with none.

        :param name: the topic's name
        """
        self.name = name
        self.messages: list[Any] = []
        self.times: list[float] = []
        """When each message arrived, by `time.monotonic` (s)."""

    def receive(self, message: Any) -> None:
        """Keep a message: the callback of the subscription."""
        self.times.append(time.monotonic())
        self.messages.append(message)

    def clear(self) -> None:
        """Forget what has arrived so far."""
        del self.messages[:], self.times[:]

    @property
    def last(self) -> Any:
        """Return the latest message, or None if there is none."""
        return self.messages[-1] if self.messages else None


class LiveGraph:
    """Nodes with a context of their own, spun in a thread, and a listener among them."""

    def __init__(self, domain_id: int, *node_factories: Callable[..., Node]) -> None:
        """
        Start the nodes and spin them.

        :param domain_id: the ROS domain
        :param node_factories: make the nodes, each called with the context as `context=`; a node's
            class is one, and so is a functools.partial of it
        """
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain_id,
                   signal_handler_options=SignalHandlerOptions.NO)
        self.executor = make_executor(self.context)
        self.nodes: list[Node] = []
        self._happened = threading.Condition()
        self._error: BaseException | None = None
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._spin, name='live graph', daemon=True)
        try:
            self.listener = self._add(
                lambda context: Node('listener', context=context, start_parameter_services=False))
            for factory in node_factories:
                self._add(factory)
        except BaseException:
            self._dispose()
            raise
        self._thread.start()

    def _add(self, factory: Callable[..., Node]) -> Node:
        node = factory(context=self.context)
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def _spin(self) -> None:
        try:
            while not self._end.is_set():
                self.executor.spin_once(timeout_sec=SLEEP_TIME)
                with self._happened:
                    self._happened.notify_all()
        except BaseException as error:  # noqa: B902 -- it is raised again where it is waited for
            with self._happened:
                self._error = error
                self._happened.notify_all()

    def _dispose(self) -> None:
        for node in self.nodes:
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()

    def close(self) -> None:
        """
        End the nodes.

        :raises RuntimeError: A callback did not return.
        """
        self._end.set()
        self.executor.create_task(lambda: None)  # something to wake up for
        self._thread.join(10.0)
        if self._thread.is_alive():
            raise RuntimeError('a callback of the graph has not returned for 10 s')
        self._dispose()

    def raise_error(self) -> None:
        """Raise, in the test, what a callback has raised in the graph's thread."""
        if self._error is not None:
            raise self._error

    def wait_for(self, predicate: Callable[[], Any], timeout: float, what: str) -> Any:
        """
        Wait until something is so.

        :param predicate: tells whether it is; asked after everything that happens in the graph
        :param timeout: how long (s) at most
        :param what: what is waited for, for the message
        :return: What the predicate returned at last, which is true.
        :raises TimeoutError: It was not so in time.
        """
        deadline = time.monotonic() + timeout
        with self._happened:
            while True:
                self.raise_error()
                found = predicate()
                if found:
                    return found
                left = deadline - time.monotonic()
                if left <= 0.0:
                    raise TimeoutError(f'waited {timeout:g} s in vain for {what}')
                self._happened.wait(min(left, GLANCE))

    def do(self, action: Callable[[], Result], timeout: float = 10.0) -> Result:
        """
        Do something in the graph's thread, between two callbacks.

        :param action: what is done
        :param timeout: how long (s) it may take to be its turn
        :return: What the action returned. What it raises, this raises.
        """
        results: list[Result] = []
        errors: list[Exception] = []

        def turn() -> None:
            try:
                results.append(action())
            except Exception as error:  # noqa: B902 -- the caller's, not the graph's
                errors.append(error)

        self.executor.create_task(turn)
        self.wait_for(lambda: results or errors, timeout, 'a turn in the thread of the graph')
        if errors:
            raise errors[0]
        return results[0]

    def record(self, topic: str, message_type: type, qos: QoSProfile | int = 200) -> Recording:
        """
        Record a topic from now on.

        :param topic: its name
        :param message_type: the type of its messages
        :param qos: the quality of service, or a depth: deep, so that a rate is not that of a
            reader which falls behind
        :return: The recording, which goes on until the graph ends.
        """
        recording = Recording(topic)
        self.do(lambda: self.listener.create_subscription(
            message_type, topic, recording.receive, qos))
        return recording

    def publisher(self, topic: str, message_type: type, qos: QoSProfile | int = 10,
                  readers: int = 1, timeout: float = 10.0) -> Publisher:
        """
        Make a publisher that is heard.

        :param topic: the topic's name
        :param message_type: the type of its messages
        :param qos: the quality of service, or a depth
        :param readers: how many subscriptions are waited for
        :param timeout: how long (s) at most
        :return: The publisher.
        :raises TimeoutError: So many do not subscribe.
        """
        publisher = self.do(lambda: self.listener.create_publisher(message_type, topic, qos))
        self.wait_for(lambda: publisher.get_subscription_count() >= readers, timeout,
                      f'{readers} to subscribe to {topic}')
        return publisher

    def call(self, service: str, service_type: type, request: Any = None,
             timeout: float = 10.0) -> Any:
        """
        Call a service.

        :param service: its name
        :param service_type: its type
        :param request: the request; an empty one if None
        :param timeout: how long (s) it may take until the service is there, and until it answers
        :return: The response.
        :raises TimeoutError: There is no such service, or no answer.
        """
        client = self.do(lambda: self.listener.create_client(service_type, service))
        self.wait_for(client.service_is_ready, timeout, f'the service {service}')
        future = client.call_async(service_type.Request() if request is None else request)
        self.wait_for(future.done, timeout, f'an answer of {service}')
        self.do(lambda: self.listener.destroy_client(client))
        return future.result()


@contextlib.contextmanager
def graph(domain_id: int, *node_factories: Callable[..., Node]) -> Iterator[LiveGraph]:
    """
    Run nodes in this process; see LiveGraph.

    :param domain_id: the ROS domain
    :param node_factories: make the nodes
    :return: The graph. When the context ends its nodes have ended, and what a callback raised is
        raised again.
    """
    live = LiveGraph(domain_id, *node_factories)
    try:
        yield live
    finally:
        live.close()
    live.raise_error()


# ------------------------------------------------------------------------- nodes in processes

class NodeProcess(Process):
    """A process in a ROS domain, with what it prints."""

    def __init__(self, command: Sequence[str], domain_id: int,
                 environment: Mapping[str, str] = {}) -> None:
        """
        Start it.

        :param command: the program and its arguments
        :param domain_id: the ROS domain it is in
        :param environment: further variables, besides those of this process
        """
        super().__init__(command, {**environment, 'ROS_DOMAIN_ID': str(domain_id),
                                   'PYTHONFAULTHANDLER': '1'})


@contextlib.contextmanager
def process(command: Sequence[str], domain_id: int, *, stop: int | None = signal.SIGINT,
            timeout: float = 10.0) -> Iterator[NodeProcess]:
    """
    Run a process and see that it ends as it should.

    :param command: the program and its arguments
    :param domain_id: the ROS domain it is in
    :param stop: the signal that ends it when the context ends; None if the test has ended it, or
        does not care how it ends
    :param timeout: how long (s) it may take to end
    :return: The process.
    :raises AssertionError: It did not end with status 0 when it was asked to.
    :raises TimeoutError: It did not end in time.
    """
    running = NodeProcess(command, domain_id)
    try:
        yield running
        if stop is not None:
            status = running.stop(stop, timeout)
            assert status == 0, (
                f'{running.command} ended with status {status}; it printed:\n{running.output}')
    finally:
        running.kill()
