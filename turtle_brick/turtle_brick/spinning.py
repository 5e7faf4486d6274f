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

"""The body of every node's main(): init, executor, spin, and a quiet end."""

from collections.abc import Callable
import gc
import os
from pathlib import Path
import re
import sys
from tempfile import mkdtemp
from tempfile import TemporaryFile

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy._rclpy_pybind11 import UnknownROSArgsError
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.exceptions import NotInitializedException
from rclpy.executors import Executor
from rclpy.executors import ExternalShutdownException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from turtle_brick.interrupts import INTERRUPTS
from turtle_brick.parameters import ParameterError

SLEEP_TIME = 0.1
"""How long (s) a node without any work sleeps before it looks whether it is to end. Without a
limit the EventsExecutor of the wheels never sleeps: its wait until the end of time is over at
once, again and again."""


def make_executor(context: Context | None = None) -> Executor:
    """
    Return the executor that takes the least: rclpy's EventsExecutor, where there is one.

    It is in rclpy since 7.1.4 and takes a third of the processor time of the
    SingleThreadedExecutor, which is what an older rclpy gives.

    :param context: The context of its nodes; the default one if None.
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


def spare_collector() -> None:
    """
    Let the garbage collector leave out the objects that exist by now: they stay to the end.

    Otherwise it goes through every module and message type again and again, for some tens of
    milliseconds each time, and the timers wait for it.
    """
    gc.collect()
    gc.freeze()


def find_log_dir() -> None:
    """Have rcl log to a temporary directory if it can't to its own, as in a read-only home."""
    home = Path(os.environ.get('HOME') or os.devnull)
    own = os.environ.get('ROS_LOG_DIR') or Path(os.environ.get('ROS_HOME') or home / '.ros', 'log')
    try:
        own = Path(own).expanduser()
        own.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=own).close()
    except (OSError, RuntimeError):
        os.environ['ROS_LOG_DIR'] = mkdtemp(prefix='ros_log_')


def reason(error: RCLError) -> str:
    """Return what an error of rcl says, without the place in its source."""
    return re.sub(r', at [^,]*:\d+', '', str(error))


def run(node_type: Callable[[], Node], args: list[str] | None = None) -> int:
    """
    Run a node in a process of its own until Ctrl-C, SIGTERM or a shutdown: the body of a main().

    :param node_type: Makes the node.
    :param args: The command line, with the program's name first; sys.argv if None.
    :return: The exit status: 0, or 1 if the parameters or other arguments are inadmissible, which
        one sentence on standard error then explains.
    """
    program = Path((args or sys.argv)[0]).stem
    INTERRUPTS.take_over()
    find_log_dir()
    node = executor = None
    try:
        try:
            # rclpy's own handlers would shut the context down in the middle of a callback.
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        except RCLError as error:
            # Chiefly a parameter file that cannot be read.
            return _complain(program, reason(error))
        except UnknownROSArgsError as error:
            return _complain(program, f'unknown ROS arguments {error}')
        with INTERRUPTS.held():
            node = node_type()
            executor = make_executor()
            executor.add_node(node)
            spare_collector()
        while rclpy.ok():
            with INTERRUPTS.held():
                executor.spin_once(timeout_sec=SLEEP_TIME)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (ParameterError, InvalidParameterTypeException) as error:
        return _complain(program, str(error))
    except (RCLError, InvalidHandle, NotInitializedException):
        # Whatever was under way when the context was shut down fails for that reason.
        if rclpy.ok():
            raise
    finally:
        if executor is not None:
            executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
        INTERRUPTS.ignore()
    return 0


def _complain(program: str, sentence: str) -> int:
    print(f'{program}: {" ".join(sentence.split())}', file=sys.stderr)
    return 1
