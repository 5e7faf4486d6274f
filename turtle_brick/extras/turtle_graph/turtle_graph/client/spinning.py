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
"""Spin nodes until a condition holds, Ctrl-C is pressed or SIGTERM arrives."""

from collections.abc import Callable
from contextlib import AbstractContextManager
import signal
from threading import Event
from time import monotonic
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

LONGEST_WAIT = 0.02
"""Timeout (s) of each spin_once call. With varying timeouts, the executor could starve nodes."""
INTERRUPTED = Event()
"""Event that Ctrl-C and SIGTERM set after handle_interrupts has been called. Use only is_set(). A
signal during wait() could block this process because both methods of an Event use one lock."""


def handle_interrupts() -> dict[int, Any]:
    """Make Ctrl-C and SIGTERM set INTERRUPTED, and return the previous signal handlers."""
    # A KeyboardInterrupt in a callback could be lost or could break a node.
    INTERRUPTED.clear()
    return {number: signal.signal(number, lambda *_: INTERRUPTED.set())
            for number in (signal.SIGINT, signal.SIGTERM)}


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
