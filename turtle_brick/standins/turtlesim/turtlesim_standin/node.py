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
A node that stands in for turtlesim_node of turtlesim 1.8.2, for machines that lack it.

Its motion is turtle_brick.core.turtlesim_kinematics, which is held to recordings of the real node.

Publishes, for each turtle, every 16 ms:
    <turtle>/pose (turtlesim/msg/Pose): where it is and how it has been told to move

Subscribes, for each turtle:
    <turtle>/cmd_vel (geometry_msgs/msg/Twist): velocity; one message is taken per 16 ms, from a
        queue that keeps the last seven

Serves, for each turtle:
    <turtle>/teleport_absolute (turtlesim/srv/TeleportAbsolute): jump to a pose
    <turtle>/teleport_relative (turtlesim/srv/TeleportRelative): turn, then jump ahead
    <turtle>/set_pen (turtlesim/srv/SetPen): answer, with a warning that there is no canvas

Serves:
    spawn (turtlesim/srv/Spawn): add a turtle
    kill (turtlesim/srv/Kill): remove a turtle
    reset (std_srvs/srv/Empty): begin again with turtle1 in the center
    clear (std_srvs/srv/Empty): answer, with a warning that there is no canvas

ROS parameters:
    holonomic (bool, false): whether turtles obey sideways velocities; may change at any time

There is no window and no canvas. Left out are therefore color_sensor, the parameters background_r,
background_g and background_b; and the action rotate_absolute.
"""

from collections.abc import Callable
from gc import freeze
from signal import alarm, pthread_sigmask, SIG_BLOCK, SIGINT, SIGTERM, sigtimedwait
from typing import Any

from geometry_msgs.msg import Twist
from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidTopicNameException, ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.validate_topic_name import validate_topic_name
from std_srvs.srv import Empty
from turtle_brick.core.turtlesim_kinematics import QUEUE_DEPTH, TICK, Turtle, TurtlePose, TurtleSim
from turtlesim.msg import Pose
from turtlesim.srv import Kill, SetPen, Spawn, TeleportAbsolute, TeleportRelative


def answering(act: Callable[[Any], None]) -> Callable[[Any, Any], Any]:
    """Return a service's callback that does something with the request."""
    def answer(request: Any, response: Any) -> Any:
        act(request)
        return response

    return answer


class TurtleTopics:
    """The topics and services of one turtle."""

    def __init__(self, node: Node, name: str, turtle: Turtle) -> None:
        """Open those of the turtle with a name."""
        self._node = node
        # As in turtlesim. A tick takes one command, so the commands that wait here wait there.
        qos = QoSProfile(depth=QUEUE_DEPTH)
        # Without event callbacks, since these go with their turtle while the node lives on, which
        # an EventsExecutor may not survive (https://github.com/ros2/rclpy/issues/1644).
        self._publisher = node.create_publisher(
            Pose, f'{name}/pose', qos,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False))
        self._subscription = node.create_subscription(
            Twist, f'{name}/cmd_vel',
            lambda twist: turtle.command(twist.linear.x, twist.linear.y, twist.angular.z), qos,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False))
        self._services = [
            node.create_service(TeleportAbsolute, f'{name}/teleport_absolute', answering(
                lambda to: turtle.teleport_absolute(to.x, to.y, to.theta))),
            node.create_service(TeleportRelative, f'{name}/teleport_relative', answering(
                lambda by: turtle.teleport_relative(by.linear, by.angular))),
            node.create_service(SetPen, f'{name}/set_pen', answering(
                lambda _: node.get_logger().warning('There is no canvas here to draw on'))),
        ]

    def publish(self, pose: TurtlePose) -> None:
        """Publish a pose."""
        self._publisher.publish(Pose(**pose._asdict()))

    def close(self) -> None:
        """Close them; the turtle is gone."""
        self._node.destroy_publisher(self._publisher)
        self._node.destroy_subscription(self._subscription)
        for service in self._services:
            self._node.destroy_service(service)


class TurtleSimNode(Node):
    """Turtlesim without its window; the module's documentation lists its interface."""

    def __init__(self, **node_arguments: Any) -> None:
        """Start with turtle1 in the arena's center."""
        super().__init__('turtlesim', **node_arguments)
        self.declare_parameter('holonomic', False, ParameterDescriptor(
            description='If true, then turtles will be holonomic'))
        self._sim = TurtleSim(self.get_parameter('holonomic').value, self._now())
        self._topics: dict[str, TurtleTopics] = {}
        self.add_post_set_parameters_callback(self._parameters_changed)
        self.get_logger().info(
            f'Starting turtlesim with node name {self.get_fully_qualified_name()}')
        self._open('turtle1')
        self.create_service(Empty, 'reset', answering(self._reset))
        self.create_service(Empty, 'clear', answering(
            lambda _: self.get_logger().warning('There is no canvas here to clear')))
        self.create_service(Spawn, 'spawn', self._spawn)
        self.create_service(Kill, 'kill', answering(self._kill))
        # turtlesim ticks by Qt's timer, which knows nothing of simulated time.
        self.create_timer(TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _now(self) -> float:
        """Read the node's clock."""
        return self.get_clock().now().nanoseconds * 1e-9

    def _tick(self) -> None:
        """Move every turtle by one time step and publish where it is."""
        for name, pose in self._sim.tick(self._now()).items():
            clamped = self._sim.turtles[name].clamped
            if clamped:
                self.get_logger().warning('Oh no! I hit the wall! '
                                          '(Clamping from [x=%f, y=%f])' % clamped)
            self._topics[name].publish(pose)

    def _parameters_changed(self, parameters: list[Parameter]) -> None:
        """Apply parameters that have been set."""
        for parameter in parameters:
            if parameter.name == 'holonomic':
                self._sim.holonomic = parameter.value

    def _open(self, name: str) -> None:
        """Announce a new turtle and open its topics."""
        turtle = self._sim.turtles[name]
        self._topics[name] = TurtleTopics(self, name, turtle)
        self.get_logger().info('Spawning turtle [%s] at x=[%f], y=[%f], theta=[%f]'
                               % (name, *turtle.pose[:3]))

    def _spawn(self, request: Spawn.Request, response: Spawn.Response) -> Spawn.Response:
        """Add a turtle."""
        try:
            validate_topic_name(f'{request.name or "turtle"}/pose')
        except InvalidTopicNameException as error:
            self.get_logger().error(f'A turtle cannot be named [{request.name}]: {error}')
            return response
        response.name = self._sim.spawn(
            request.x, request.y, request.theta, request.name, self._now())
        if response.name:
            self._open(response.name)
        else:
            self.get_logger().error(f'A turtle named [{request.name}] already exists')
        return response

    def _kill(self, request: Kill.Request) -> None:
        """Remove a turtle."""
        if self._sim.kill(request.name):
            self._topics.pop(request.name).close()
        else:
            self.get_logger().error(
                f'Tried to kill turtle [{request.name}], which does not exist')

    def _reset(self, _: Empty.Request) -> None:
        """Begin again with turtle1 in the arena's center."""
        self.get_logger().info('Resetting turtlesim.')
        self._sim.reset(self._now())
        for topics in self._topics.values():
            topics.close()
        self._topics.clear()
        self._open('turtle1')


def main(args: list[str] | None = None) -> str | None:
    """Run the node until Ctrl-C or SIGTERM, which wait until they are looked for."""
    signals = {SIGINT, SIGTERM}
    pthread_sigmask(SIG_BLOCK, signals)
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = TurtleSimNode()
    except (ParameterException, RuntimeError) as error:
        rclpy.try_shutdown()
        return f'turtlesim: {error}'
    executor = EventsExecutor()
    executor.add_node(node)
    # Otherwise the garbage collector delays ticks by some tens of milliseconds.
    freeze()
    while not sigtimedwait(signals, 0):
        executor.spin_once(timeout_sec=0.1)
    alarm(4)  # Fast DDS may wait for ever
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return None
