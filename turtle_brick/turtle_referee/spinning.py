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
"""What lets a node work while somebody waits."""

from collections.abc import Callable
import signal
from time import monotonic
from typing import Any, Protocol

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

LONGEST_WAIT = 0.02
"""How long (s) the executor waits for work, and a Ctrl-C with it."""


class Spins(Protocol):
    """Lets nodes work: a `Spinner`, or a graph with more nodes."""

    def spin_until(self, condition: Callable[[], Any], timeout: float, what: str) -> None:
        """Let nodes work until a condition holds; TimeoutError after a time (s)."""

    def spin_for(self, seconds: float) -> None:
        """Let nodes work for a time (s)."""


class Spinner:
    """One node, spun while somebody waits; Ctrl-C or SIGTERM end that as KeyboardInterrupt."""

    def __init__(self, make_node: Callable[..., Node], namespace: str = '') -> None:
        """
        Make the node.

        :param make_node: its class, or anything that makes it of a node's keyword arguments
        :param namespace: that it is in
        """
        self.context = Context()
        rclpy.init(args=['--ros-args', '--log-level', 'warn'], context=self.context,
                   signal_handler_options=SignalHandlerOptions.NO)
        self.node: Any = make_node(context=self.context, namespace=namespace,
                                   use_global_arguments=False)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._interrupted = False
        # An interrupt in the middle of a callback would be swallowed, or tear it.
        self._handlers = {number: signal.signal(number, self._interrupt)
                          for number in (signal.SIGINT, signal.SIGTERM)}

    def __enter__(self) -> 'Spinner':
        """Return the spinner; on leaving it, the node ends."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the node."""
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def _interrupt(self, number: int, frame: object) -> None:
        self._interrupted = True

    def spin_until(self, condition: Callable[[], Any], timeout: float, what: str) -> None:
        """Let the node work until a condition holds; TimeoutError after a time (s)."""
        deadline = monotonic() + timeout
        while not condition():
            if monotonic() > deadline:
                raise TimeoutError(f'{what}: not within {timeout:g} s')
            self._work()

    def spin_for(self, seconds: float) -> None:
        """Let the node work for a time (s)."""
        end = monotonic() + seconds
        while monotonic() < end:
            self._work()

    def _work(self) -> None:
        if self._interrupted:
            raise KeyboardInterrupt
        self._executor.spin_once(timeout_sec=LONGEST_WAIT)
