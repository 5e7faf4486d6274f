# SPDX-License-Identifier: Apache-2.0
"""The node with which a command joins the ROS graph."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
import contextlib
import ctypes
import os
import re
import signal
from time import CLOCK_MONOTONIC, monotonic
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from ros2cli.helpers import Unsupported

SPIN_TIME = 0.02
"""Maximum duration (s) of a spin. Signals and conditions are checked after every spin."""

KNOWN, FOUND, MISSING, LIMIT = 40, 25, 100, 400
"""
Time limits for discovery, counted in spins because each spin takes longer on a busy machine.

Participants announce themselves every 0.3 s (fastdds.xml) and when a new participant appears.
Discovery ends when the graph is complete and has not changed for KNOWN spins, or FOUND spins if a
command requires only one node, topic or service. If the graph is incomplete or nothing is found,
discovery ends after MISSING spins without a change. Discovery never takes more than LIMIT spins.
"""

LEAVE_TIMEOUT = 10
"""Timeout (s) for leaving the graph. Fast DDS hangs at the end of 1 in 700 commands."""

joined: list[GraphNode] = []
"""List that contains the node of this command until leave() destroys the node."""

_signals: list[int] = []
"""Received signal numbers, stored because rclpy may lose exceptions raised in signal handlers."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of all verbs that join the graph."""
    parser.add_argument(
        '--spin-time', type=float,
        help='Spin time in seconds to wait for discovery (only applies when not using an already '
        'running daemon)')
    parser.add_argument('-s', '--use-sim-time', action=Unsupported, nargs=0,
                        help='Enable ROS simulation time')


class GraphNode(Node):
    """A node for one command. The node stops spinning after Ctrl-C or SIGTERM."""

    def __init__(self, name: str | None) -> None:
        """Create the node, which is hidden unless a name is given."""
        super().__init__(name or f'_ros2cli_{os.getpid()}', start_parameter_services=bool(name))
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        _signals.clear()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda number, frame: _signals.append(int(number)))

    def destroy_node(self) -> None:
        """Destroy the node and its executor."""
        self._executor.shutdown()
        super().destroy_node()

    def spin_until(self, condition: Callable[[], Any], timeout: float = float('inf')) -> bool:
        """Spin until a condition is true or a timeout (s) expires. Return False on timeout."""
        deadline = monotonic() + timeout
        while not condition():
            if monotonic() >= deadline:
                return False
            self._spin_once()
        return True

    def _spin_once(self) -> None:
        self._executor.spin_once(timeout_sec=SPIN_TIME)
        if _signals:
            raise KeyboardInterrupt(_signals.pop(0))

    def result(self, future: Any) -> Any:
        """Spin until a future is done, and return its result."""
        self.spin_until(future.done)
        return future.result()

    def discover(self, found: Callable[[GraphNode], Any] | None = None) -> None:
        """Spin until the graph (or found(self), if `found` is given) no longer changes."""
        state: Any = None
        unchanged = 0
        for _ in range(LIMIT):
            previous = state
            if found is None:
                state = (self.node_names(), self.topic_types(), self.service_types())
                exists, duration = bool(state[0]), KNOWN
            else:
                state = found(self)
                exists, duration = bool(state), FOUND
            unchanged = unchanged + 1 if state == previous else 0
            required = duration if exists else MISSING
            if unchanged >= required and (unchanged >= MISSING or is_complete(self)):
                return
            self._spin_once()

    def node_names(self, hidden: bool = False) -> list[str]:
        """Return the sorted full names of the nodes."""
        return sorted(f'{namespace.rstrip("/")}/{name}'
                      for name, namespace in self.get_node_names_and_namespaces()
                      if hidden or not name.startswith('_'))

    def topic_types(self, hidden: bool = True) -> dict[str, list[str]]:
        """Return the types of all topics, keyed by name."""
        return visible(self.get_topic_names_and_types(), hidden)

    def service_types(self, hidden: bool = True) -> dict[str, list[str]]:
        """Return the types of all services, keyed by name."""
        return visible(self.get_service_names_and_types(), hidden)


def is_complete(graph: Any) -> bool:
    """Return whether all services and the nodes of all DDS participants have been discovered."""
    known = participants(graph.get_publishers_info_by_topic('ros_discovery_info', no_mangle=True))
    named = participants(end for end in graph.get_publishers_info_by_topic('/parameter_events')
                         if not end.node_name.startswith('_NODE_NAME_UNKNOWN_'))
    if not known <= named:
        return False
    try:
        return all(has_all_services(graph, *node)
                   for node in graph.get_node_names_and_namespaces())
    except NodeNameNonExistentError:  # A node has just left the graph.
        return False


def participants(publishers: Iterable[Any]) -> set[bytes]:
    """Return the identifiers of the DDS participants that own the given publishers."""
    return {bytes(publisher.endpoint_gid)[:12] for publisher in publishers}


def has_all_services(graph: Any, name: str, namespace: str) -> bool:
    """Return whether each service of a node has a request topic and a response topic."""
    written, read = (
        {match[1] for topic, _ in get(name, namespace, no_demangle=True)
         if (match := re.fullmatch('r[qr](/.*)(Request|Reply)', topic))}
        for get in (graph.get_publisher_names_and_types_by_node,
                    graph.get_subscriber_names_and_types_by_node))
    return written == read and (bool(written) or name.startswith('_'))


@contextlib.contextmanager
def open_graph(found: Callable[[GraphNode], Any] | None = None, name: str | None = None,
               ros_args: Sequence[str] = ()) -> Iterator[GraphNode]:
    """
    Yield a node that has discovered the graph. This node exists until leave() is called.

    :param found: function that returns the part of the graph that the command requires
    :param name: name of the node, which is hidden by default
    """
    rclpy.init(args=['--ros-args', *ros_args], signal_handler_options=SignalHandlerOptions.NO)
    joined.append(GraphNode(name))
    joined[-1].discover(found)
    yield joined[-1]


def leave(status: int) -> None:
    """Leave the graph, or end this process with a given status if Fast DDS blocks."""
    while joined:
        exit_after(LEAVE_TIMEOUT, status)
        joined.pop().destroy_node()
        rclpy.try_shutdown()


def exit_after(seconds: float, status: int) -> None:
    """End this process after a timeout (s), even if C++ code blocks all Python threads."""
    libc, timer = ctypes.CDLL('librt.so.1'), ctypes.c_void_p()  # Loading librt also loads libc.
    # When the timer expires, call _exit(status) in a new thread (SIGEV_THREAD = 2).
    event = (ctypes.c_int64 * 8)(status, 2 << 32, ctypes.cast(
        libc._exit, ctypes.c_void_p).value or 0)
    libc.timer_create(CLOCK_MONOTONIC, event, ctypes.byref(timer))
    time = divmod(int(seconds * 1e9), 10 ** 9)
    libc.timer_settime(timer, 0, (ctypes.c_int64 * 4)(0, 0, *time), None)


def visible(names_and_types: Iterable[tuple[str, list[str]]],
            hidden: bool) -> dict[str, list[str]]:
    """Return topic or service types keyed by name, including hidden names if `hidden` is true."""
    return {name: types for name, types in names_and_types
            if hidden or not topic_or_service_is_hidden(name)}
