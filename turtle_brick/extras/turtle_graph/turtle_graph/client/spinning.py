# SPDX-License-Identifier: Apache-2.0
"""Spin nodes until a condition holds, Ctrl-C is pressed or SIGTERM or SIGHUP arrives."""

from collections.abc import Callable
from contextlib import AbstractContextManager
import os
import signal
from threading import Event
from time import monotonic
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

LONGEST_WAIT = 0.02
"""Timeout (s) of each spin_once call. With varying timeouts, the executor could starve nodes."""
STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end a program: Ctrl-C, `kill` and closing the terminal."""
INTERRUPTED = Event()
"""Event that STOP_SIGNALS set after handle_interrupts has been called. Use only is_set(). A signal
during wait() could block this process because both methods of an Event use one lock."""


def handle_signals(handler: Callable[..., object]) -> dict[int, Any]:
    """Make STOP_SIGNALS call a handler, and return the previous signal handlers."""
    return {number: signal.signal(number, handler) for number in STOP_SIGNALS}


def handle_interrupts() -> dict[int, Any]:
    """Make STOP_SIGNALS set INTERRUPTED, and return the previous signal handlers."""
    # A KeyboardInterrupt in a callback could be lost or could break a node.
    INTERRUPTED.clear()
    return handle_signals(lambda *_: INTERRUPTED.set())


class Spinner:
    """Base class that spins the nodes in its executor while a program waits."""

    executor: Executor

    def spin_until(self, condition: Callable[[], Any], timeout: float, what: str) -> None:
        """Spin until a condition holds, or raise TimeoutError after a timeout (s)."""
        deadline = monotonic() + timeout
        while not condition():
            if monotonic() > deadline:
                raise TimeoutError(f'{what}: not within {timeout:g} s')
            self.spin_once()

    def spin_for(self, seconds: float) -> None:
        """Spin for a duration (s)."""
        end = monotonic() + seconds
        while monotonic() < end:
            self.spin_once()

    def spin_once(self) -> None:
        """Execute pending callbacks, or wait briefly for the next one."""
        self.executor.spin_once(timeout_sec=LONGEST_WAIT)
        if INTERRUPTED.is_set():
            raise KeyboardInterrupt


class NodeSpinner(Spinner, AbstractContextManager['NodeSpinner']):
    """Context manager for one node with its own context, executor and signal handlers."""

    def __init__(self, make_node: Callable[..., Node], namespace: str = '') -> None:
        """Create a node by calling `make_node` (a node class or a function that returns one)."""
        self._context = Context()
        rclpy.init(args=['--ros-args', '--log-level', 'warn'], context=self._context,
                   signal_handler_options=SignalHandlerOptions.NO)
        self.node: Any = make_node(context=self._context, namespace=namespace,
                                   use_global_arguments=False)
        self.executor = SingleThreadedExecutor(context=self._context)
        self.executor.add_node(self.node)
        self._handlers = handle_interrupts()

    def __exit__(self, *_: object) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
        for number, handler in self._handlers.items():
            signal.signal(number, handler)


def run_node(make_node: Callable[[], Node], program: str, args: list[str] | None = None
             ) -> str | None:
    """
    Create a node, spin the node until one of STOP_SIGNALS, and destroy the node.

    :param make_node: node class, or function that returns the node
    :param program: name of the program for error messages
    :param args: command line including the program name, by default sys.argv
    :return: error message if the node cannot be created, otherwise None
    """
    stopped = Event()

    def stop(*_: object) -> None:
        stopped.set()
        # Fast DDS hangs in 1 of 700 shutdowns, so another SIGTERM ends the process immediately.
        signal.signal(signal.SIGTERM, signal.SIG_DFL)

    # On a busy machine, creating a node can take longer than ros2 launch waits before SIGKILL.
    handle_signals(lambda *_: os._exit(0))
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = make_node()
    except (ParameterException, RuntimeError, ValueError) as error:
        rclpy.try_shutdown()
        return f'{program}: {" ".join(str(error).split())}'
    handle_signals(stop)
    executor = EventsExecutor()
    executor.add_node(node)
    while not stopped.is_set():
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return None
