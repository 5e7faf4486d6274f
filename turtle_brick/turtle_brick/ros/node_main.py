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
How a node's process begins, spins, warns and ends.

    with init(args):
        spin(Arena())

It is `rclpy.init`, `rclpy.spin` and `rclpy.shutdown` with a quiet end: rclpy's own handlers of
Ctrl-C and SIGTERM shut the context down while a callback publishes, which then prints an error.
"""

from collections import defaultdict, deque
from collections.abc import Iterator
from contextlib import contextmanager
from gc import freeze
from pathlib import Path
import signal
import sys
from threading import Event
from time import monotonic
from types import FrameType

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from turtle_brick.core.parameters import ParameterError

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""What ends a node."""

SLEEP_TIME = 0.1
"""Longest time (s) between two looks at whether to end. Without a limit the EventsExecutor of the
wheels never sleeps: it takes the end of time for the past."""

END_TIME = 5
"""Longest time (s) that the end may take: then the kernel ends the process. At its end Fast DDS
has been seen to wait for ever, in one process of 700 whose neighbors ended as well."""

_asked_to_end = Event()


@contextmanager
def init(args: list[str] | None = None) -> Iterator[None]:
    """
    Initialize rclpy, and shut it down at the end.

    :param args: the command line, with the program's name first; sys.argv if None
    :raises SystemExit: The arguments or the parameters are inadmissible; it ends the process with
        status 1 and one sentence on standard error.
    """
    for number in SIGNALS:
        signal.signal(number, _on_signal)
    try:
        try:
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        except RuntimeError as error:
            raise ParameterError(f'ROS can not use its arguments: {error}') from None
        yield
    except (ParameterError, InvalidParameterTypeException) as error:
        sys.exit(f'{Path((args or sys.argv)[0]).stem}: {" ".join(str(error).split())}')
    finally:
        rclpy.try_shutdown()


def spin(node: Node) -> None:
    """Spin a node until Ctrl-C or SIGTERM, and destroy it."""
    executor = make_executor()
    executor.add_node(node)
    freeze()  # else the garbage collector goes through every module, for tens of milliseconds
    while not _asked_to_end.is_set():
        executor.spin_once(timeout_sec=SLEEP_TIME)
    executor.shutdown()
    node.destroy_node()


def make_executor(context: Context | None = None) -> Executor:
    """
    Return rclpy's EventsExecutor, which is experimental, for nodes of a context.

    It takes a third of the processor time of the SingleThreadedExecutor, because it builds no wait
    set for each callback. To do without it, return the other one, which serves as well; so it does
    where rclpy is older than 7.1.4.
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


class Warner:
    """
    Log warnings, a limited number of each kind: bad messages may come by the thousand.

    The logger's own `throttle_duration_sec` takes up to a millisecond per call, to look up the
    caller: a thousand bad messages would delay a node.
    """

    PERIOD, LIMIT = 10.0, 5
    """In how long (s) there may be how many warnings of a kind."""

    def __init__(self, node: Node) -> None:
        """Begin without any warning of a node."""
        self._logger = node.get_logger()
        self._given: defaultdict[str, deque[float]] = defaultdict(lambda: deque(maxlen=self.LIMIT))

    def warn(self, kind: str, sentence: str) -> None:
        """Log a warning, unless the limit of its kind is reached."""
        now, given = monotonic(), self._given[kind]
        if len(given) < self.LIMIT or now - given[0] > self.PERIOD:
            given.append(now)
            self._logger.warning(sentence)


def _on_signal(number: int, frame: FrameType | None) -> None:
    """Have `spin` end; a Ctrl-C under `ros2 launch` comes twice, and only the first counts."""
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN)
    signal.alarm(END_TIME)
    _asked_to_end.set()
