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
Run a node as a program, and declare its parameters.

    def main(args=None):
        run_node(Arena, args)

The signal handlers of rclpy are not used because they can shut down the context during a callback.
"""

from array import array
from collections.abc import Callable
from pathlib import Path
import signal
import sys
from threading import Event

from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from turtle_brick.core.parameters import (default_path, MissingParameterError, PARAMETER_RULES,
                                          ParameterError, Parameters)

SPIN_TIMEOUT = 0.1
"""Timeout (s) for each wait in the executor. This timeout limits the shutdown delay. Without a
timeout, the EventsExecutor in the PyPI environment never sleeps."""

_shutdown_requested = Event()


def run_node(make_node: Callable[[], Node], args: list[str] | None = None,
             executor_type: Callable[[], Executor] | None = None) -> None:
    """
    Initialize rclpy, make a node, and spin it until Ctrl-C or SIGTERM.

    :param make_node: class of the node, or a function that returns the node
    :param args: command line including the program name, by default sys.argv
    :param executor_type: class of the executor, by default the result of `make_executor`
    :raises SystemExit: if an argument or a parameter is invalid (exit status 1)
    """
    signal.signal(signal.SIGINT, _request_shutdown)
    signal.signal(signal.SIGTERM, _request_shutdown)
    try:
        _init(args)
        node, executor = make_node(), (executor_type or make_executor)()
        executor.add_node(node)
        while not _shutdown_requested.is_set():
            executor.spin_once(timeout_sec=SPIN_TIMEOUT)
        executor.shutdown()
        node.destroy_node()
    except (ParameterError, InvalidParameterTypeException) as error:
        sys.exit(f'{Path((args or sys.argv)[0]).stem}: {" ".join(str(error).split())}')
    finally:
        rclpy.try_shutdown()


def make_executor(context: Context | None = None) -> Executor:
    """
    Return an experimental EventsExecutor, or a SingleThreadedExecutor if rclpy predates 7.1.4.

    A SingleThreadedExecutor uses three times as much processor time as an EventsExecutor, but it
    can also run callbacks that are coroutines (`async def`).
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


def _init(args: list[str] | None) -> None:
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise ParameterError(f'invalid ROS arguments: {error}') from None


def _request_shutdown(number: int, _: object) -> None:
    signal.signal(number, signal.SIG_IGN)  # `ros2 launch` repeats a Ctrl-C.
    if number == signal.SIGINT:
        # In tests, 1 in 700 shutdowns hung in Fast DDS. SIGTERM terminates a hung node.
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _shutdown_requested.set()


def declare_parameters(node: Node) -> Parameters:
    """
    Declare all parameters in PARAMETER_RULES as read-only, and return their values.

    There are no defaults. The values come from a parameter file or from `-p name:=value`.

    :raises ParameterError: if a value is missing or invalid
    """
    values = {}
    for name, rule in PARAMETER_RULES.items():
        # Dynamic typing allows users to write 3 for 3.0. PARAMETER_RULES rejects all other types.
        value = node.declare_parameter(name, None, ParameterDescriptor(
            description=rule.description,
            additional_constraints=f'{name} must be {rule.allowed_values()}',
            dynamic_typing=True, read_only=True)).value
        if value is not None:
            values[name] = value.tolist() if isinstance(value, array) else value
    try:
        return Parameters.from_mapping(values)
    except MissingParameterError as error:
        raise MissingParameterError(
            f'{error}. Add --ros-args --params-file {default_path()}, or if a parameter file was '
            'given, check the spelling of the names in that file, and check that it contains a '
            f'section for the node {node.get_fully_qualified_name()} or for /**.') from None
