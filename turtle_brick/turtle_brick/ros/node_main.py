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
How a node's process begins, spins and ends.

    with init(args):
        executor = make_executor()
        executor.add_node(Arena())
        spin(executor)
"""

from collections.abc import Iterator
from contextlib import contextmanager
import gc
import os
from pathlib import Path
import sys
from tempfile import mkdtemp, TemporaryFile

import rclpy
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.executors import Executor, ExternalShutdownException
from rclpy.signals import SignalHandlerOptions
from turtle_brick.core.parameters import ParameterError
from turtle_brick.ros.interrupts import INTERRUPTS
from turtle_brick.ros.rcl_errors import ARGUMENT_ERRORS, sentence, SHUTDOWN_ERRORS

SLEEP_TIME = 0.1
"""Longest time (s) between two looks at whether to end. Without a limit the EventsExecutor of the
wheels never sleeps: it takes the end of time for the past."""


@contextmanager
def init(args: list[str] | None = None) -> Iterator[None]:
    """
    Initialize rclpy, and shut it down at the end.

    Ctrl-C, SIGTERM and a shutdown of the context end what is inside without a word.

    :param args: the command line, with the program's name first; sys.argv if None
    :raises SystemExit: The arguments or the parameters are inadmissible; it ends the process with
        status 1 and one sentence on standard error.
    """
    program = Path((args or sys.argv)[0]).stem
    INTERRUPTS.take_over()
    find_log_dir()
    try:
        # A signal waits until `spin` looks for it: nothing in rclpy is interrupted halfway.
        with INTERRUPTS.held():
            try:
                rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
            except ARGUMENT_ERRORS as error:
                raise ParameterError(sentence(error)) from None
            yield
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (ParameterError, InvalidParameterTypeException) as error:
        sys.exit(f'{program}: {" ".join(str(error).split())}')
    except SHUTDOWN_ERRORS:
        if rclpy.ok():
            raise
    finally:
        INTERRUPTS.ignore()
        rclpy.try_shutdown()


def spin(executor: Executor) -> None:
    """Spin nodes until Ctrl-C, SIGTERM or a shutdown, and destroy them."""
    nodes = executor.get_nodes()
    spare_collector()
    try:
        while rclpy.ok() and not INTERRUPTS.came:
            executor.spin_once(timeout_sec=SLEEP_TIME)
    finally:
        executor.shutdown()
        for node in nodes:
            node.destroy_node()


def spare_collector() -> None:
    """
    Let the garbage collector leave out the objects that exist by now: they stay to the end.

    Otherwise it goes through every module and message type again and again, for tens of
    milliseconds each time, and the timers are late.
    """
    gc.collect()
    gc.freeze()


def find_log_dir() -> None:
    """Have rcl log to a temporary directory if it can't write to its own."""
    home = Path(os.environ.get('HOME') or os.devnull)
    own = os.environ.get('ROS_LOG_DIR') or Path(os.environ.get('ROS_HOME') or home / '.ros', 'log')
    try:
        own = Path(own).expanduser()
        own.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=own).close()
    except (OSError, RuntimeError):
        os.environ['ROS_LOG_DIR'] = mkdtemp(prefix='ros_log_')
