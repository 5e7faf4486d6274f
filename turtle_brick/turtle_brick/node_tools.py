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

"""What every node of the package shares: its parameters and the body of its main()."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from collections.abc import Sequence
from dataclasses import fields
import gc
import os
from pathlib import Path
import re
import sys
from tempfile import mkdtemp
from tempfile import TemporaryFile
from time import monotonic
from typing import Any

from rcl_interfaces.msg import FloatingPointRange
from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy._rclpy_pybind11 import UnknownROSArgsError
from rclpy.context import Context
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.exceptions import NotInitializedException
from rclpy.executors import Executor
from rclpy.executors import ExternalShutdownException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from turtle_brick.interrupts import INTERRUPTS
from turtle_brick.parameters import default_path
from turtle_brick.parameters import from_mapping
from turtle_brick.parameters import meaning
from turtle_brick.parameters import MissingParameterError
from turtle_brick.parameters import ParameterError
from turtle_brick.parameters import Parameters

SLEEP_TIME = 0.1
"""How long (s) a node without any work sleeps before it looks whether it is to end. Without a
limit the EventsExecutor of the wheels never sleeps: its wait until the end of time is over at
once, again and again."""


def declare_parameters(node: Node) -> Parameters:
    """
    Declare the package's parameters on a node, read-only, and return their values.

    The values come from the node's parameter overrides (a parameter file, `-p name:=value`); there
    are no defaults. Integers are as good as floating-point numbers.

    :param node: The node, on which none of them is declared yet.
    :return: The values.
    :raises ParameterError: A value is missing or inadmissible.
    """
    # With what the node does not know, for which rclpy has no public way.
    given = dict(getattr(node, '_parameter_overrides', {}))
    for entry in fields(Parameters):
        # Untyped at first, so that an inadmissible value meets our rules and not rclpy's.
        untyped = node.declare_parameter(
            entry.name, None, ParameterDescriptor(dynamic_typing=True))
        given.pop(entry.name, None)
        if untyped.value is not None:
            given[entry.name] = untyped.value
        node.undeclare_parameter(entry.name)
    try:
        parameters = from_mapping(given, node.get_logger().warning)
    except MissingParameterError as error:
        raise MissingParameterError(
            f'{error}; add --ros-args --params-file {default_path()}') from None
    for entry in fields(Parameters):
        rule = meaning(entry)
        descriptor = ParameterDescriptor(
            description=rule.description,
            additional_constraints=f'{entry.name} must be {rule.expectation()}',
            read_only=True)
        if rule.length == 1:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=rule.lower, to_value=rule.upper, step=0.0)]
        node.declare_parameter(
            entry.name, getattr(parameters, entry.name), descriptor, ignore_override=True)
    return parameters


def due_instant(timer: Timer, now: int) -> int:
    """
    Return the instant at which a timer was due whose callback runs now.

    :param timer: The timer.
    :param now: The present instant of its clock (ns).
    :return: The instant (ns), a multiple of its period after the others, and not after `now`.
    """
    return now - max(timer.timer_period_ns - timer.time_until_next_call(), 0)


class Warner:
    """
    Log warnings, few of each kind in a while: whoever sends nonsense sends it often.

    The logger's own throttle looks up who called it first, each time, which takes a quarter of a
    millisecond: a thousand bad messages would hold a node up.
    """

    PERIOD = 10.0
    """The time (s) in which the number of warnings of a kind is limited."""

    def __init__(self, node: Node, limit: int = 1) -> None:
        """
        Begin with the next warning.

        :param node: The node whose warnings they are.
        :param limit: How many of a kind there may be in a period.
        """
        self._node = node
        self._limit = limit
        self._given: dict[str, list[float]] = {}

    def warn(self, kind: str, sentence: str) -> None:
        """Log a warning, unless there have been enough of its kind lately."""
        now = monotonic()
        given = self._given.setdefault(kind, [])
        while given and now - given[0] > self.PERIOD:
            del given[0]
        if len(given) < self._limit:
            given.append(now)
            self._node.get_logger().warning(sentence)


class PollingNode(Node):
    """
    A node that fetches what comes often, instead of being woken by each message of it.

    No executor knows of what is fetched, so that it can also be given up at any time: an
    EventsExecutor may not survive that subscriptions and publishers of a living node go, unless
    they have no event callbacks (https://github.com/ros2/rclpy/issues/1644).
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        """
        Fetch nothing yet.

        :param name: The name of the node.
        :param node_options: Passed on to rclpy.node.Node.
        """
        # First, since Node itself asks for its subscriptions, and may make some.
        self._polled: dict[Subscription, Callable[[Any, dict[str, int]], None]] = {}
        super().__init__(name, **node_options)

    def poll(self, message_type: type, topic: str, hear: Callable[[Any, dict[str, int]], None],
             qos: QoSProfile, raw: bool = False) -> Subscription:
        """
        Subscribe to what will be fetched.

        :param message_type: The type of the messages.
        :param topic: Their topic.
        :param hear: Called by `fetch` with each message, and with what rmw knows of its way:
            source_timestamp and received_timestamp, in ns of the system's clock.
        :param qos: How to subscribe; its depth is how many messages wait to be fetched.
        :param raw: Whether messages stay serialized.
        """
        subscription = self.create_subscription(
            message_type, topic, _ignore, qos, raw=raw,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False))
        self._polled[subscription] = hear
        return subscription

    def fetch(self) -> None:
        """Hear all that has come since the last time, topic by topic."""
        for subscription, hear in self._polled.items():
            with subscription.handle:
                while (taken := subscription.handle.take_message(
                        subscription.msg_type, subscription.raw)) is not None:
                    hear(*taken)

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Return what an executor is to wait for: not what is fetched."""
        return (one for one in super().subscriptions if one not in self._polled)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Give up a subscription, fetched or not."""
        self._polled.pop(subscription, None)
        return super().destroy_subscription(subscription)


def _ignore(message: Any) -> None:
    """Stand in for the callback of a subscription that is fetched."""


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
    Let the garbage collector pass over all that there is by now: it stays to the end.

    Else it goes through every module and message type again and again, for some tens of
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


def run(node_type: Callable[[], Node], args: Sequence[str] | None = None) -> int:
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
