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
"""What lets nodes work while somebody waits, until Ctrl-C."""

from collections.abc import Callable
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
"""How long (s) the executor waits for work, and a Ctrl-C with it. The same each time: with another
timeout a SingleThreadedExecutor forgets whose turn it is, and under load the first node would have
every turn."""

INTERRUPTED = Event()  # set by Ctrl-C and SIGTERM, in a process that has called `handle_interrupts`


def handle_interrupts() -> dict[int, Any]:
    """
    Have Ctrl-C and SIGTERM wait for the end of a piece of work; return their handlers so far.

    A KeyboardInterrupt in the midst of an import or a callback may be swallowed or cost a node.
    """
    INTERRUPTED.clear()
    return {number: signal.signal(number, lambda *_: INTERRUPTED.set())
            for number in (signal.SIGINT, signal.SIGTERM)}


class Spinner:
    """Nodes of an executor that work while somebody waits."""

    executor: Executor

    def spin_until(self, condition: Callable[[], Any], timeout: float, what: str) -> None:
        """
        Let the nodes work until a condition holds, which is asked after each piece of work.

        :raises TimeoutError: it did not within a time (s), with what it is in words
        :raises KeyboardInterrupt: a signal has come that `handle_interrupts` takes
        """
        deadline = monotonic() + timeout
        while not condition():
            if monotonic() > deadline:
                raise TimeoutError(f'{what}: not within {timeout:g} s')
            self._work()

    def spin_for(self, seconds: float) -> None:
        """Let the nodes work for a time (s)."""
        end = monotonic() + seconds
        while monotonic() < end:
            self._work()

    def _work(self) -> None:
        """Do one piece of work, or wait for it for a while."""
        self.executor.spin_once(timeout_sec=LONGEST_WAIT)
        if INTERRUPTED.is_set():
            raise KeyboardInterrupt


class NodeSpinner(Spinner):
    """One node, spun while somebody waits; Ctrl-C or SIGTERM end that as KeyboardInterrupt."""

    def __init__(self, make_node: Callable[..., Node], namespace: str = '') -> None:
        """Make the node: by its class, or what else takes a node's keyword arguments."""
        self._context = Context()
        rclpy.init(args=['--ros-args', '--log-level', 'warn'], context=self._context,
                   signal_handler_options=SignalHandlerOptions.NO)
        self.node: Any = make_node(context=self._context, namespace=namespace,
                                   use_global_arguments=False)
        self.executor = SingleThreadedExecutor(context=self._context)
        self.executor.add_node(self.node)
        self._handlers = handle_interrupts()

    def __enter__(self) -> 'NodeSpinner':
        """Return the spinner; on leaving it, the node ends."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the node."""
        self.executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
