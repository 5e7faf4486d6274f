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
"""Run a program's node until Ctrl-C or SIGTERM."""

from collections.abc import Callable
import os
import signal
from threading import Event

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions


def run_node(make_node: Callable[[], Node], program: str, args: list[str] | None = None
             ) -> str | None:
    """
    Create a node, spin the node until Ctrl-C or SIGTERM, and destroy the node.

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


def handle_signals(handler: Callable[..., object]) -> None:
    """Make SIGINT and SIGTERM call a handler."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)
