# SPDX-License-Identifier: Apache-2.0
"""
The stand-in for turtlesim_node from turtlesim 1.8.2, without a window.

turtlesim_kinematics computes the motion and is tested against recordings of the real node.

Publishes these topics for each turtle every 16 ms:
    <turtle>/pose (turtlesim/msg/Pose): pose and commanded velocity
    <turtle>/color_sensor (turtlesim/msg/Color): default background color

Subscribes to this topic for each turtle:
    <turtle>/cmd_vel (geometry_msgs/msg/Twist): velocity. For each turtle, up to seven
        messages are queued, and one of them is applied every 16 ms.

Provides these services for each turtle:
    <turtle>/teleport_absolute (turtlesim/srv/TeleportAbsolute): jump to a pose
    <turtle>/teleport_relative (turtlesim/srv/TeleportRelative): turn and then jump forward
    <turtle>/set_pen (turtlesim/srv/SetPen): log a warning only

Provides this action for each turtle:
    <turtle>/rotate_absolute (turtlesim/action/RotateAbsolute): turn to a heading. A new goal or a
        velocity command aborts the previous goal.

Provides these other services:
    spawn (turtlesim/srv/Spawn): add a turtle
    kill (turtlesim/srv/Kill): remove a turtle
    reset (std_srvs/srv/Empty): restart with turtle1 in the center
    clear (std_srvs/srv/Empty): log a warning only

ROS parameters:
    holonomic (bool, false): whether turtles can move sideways
    background_r, background_g, background_b (integer, 69, 86, 255): no effect
"""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Twist
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future
from rclpy.validate_topic_name import validate_topic_name
from std_srvs.srv import Empty
from turtlesim.action import RotateAbsolute
from turtlesim.msg import Color, Pose
from turtlesim.srv import Kill, SetPen, Spawn, TeleportAbsolute, TeleportRelative
from turtlesim_standin.simulator import SimulatedTurtle, TurtleSim
from turtlesim_standin.turtlesim_arena import TICK, TurtlePose
from turtlesim_standin.turtlesim_kinematics import QUEUE_DEPTH

BACKGROUND = Color(r=69, g=86, b=255)
"""Default background color."""


def service_callback(function: Callable[[Any], None]) -> Callable[[Any, Any], Any]:
    """Return a service callback that passes the request to a function."""
    def callback(request: Any, response: Any) -> Any:
        function(request)
        return response

    return callback


class TurtleTopics:
    """The topics, services and the action of one turtle."""

    def __init__(self, node: Node, name: str, turtle: SimulatedTurtle) -> None:
        self._node = node
        self._turtle = turtle
        self._goal: ServerGoalHandle | None = None
        self._result: Future
        qos = QoSProfile(depth=QUEUE_DEPTH)
        # Event callbacks are disabled because destroying them may crash the EventsExecutor
        # (https://github.com/ros2/rclpy/issues/1644).
        self._publisher, self._color_publisher = (node.create_publisher(
            kind, f'{name}/{topic}', qos,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False))
            for kind, topic in ((Pose, 'pose'), (Color, 'color_sensor')))

        def on_command(twist: Twist) -> None:
            turtle.command(twist.linear.x, twist.linear.y, twist.angular.z)

        self._subscription = node.create_subscription(
            Twist, f'{name}/cmd_vel', on_command, qos,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False))
        self._services = [
            node.create_service(TeleportAbsolute, f'{name}/teleport_absolute', service_callback(
                lambda to: turtle.teleport_absolute(to.x, to.y, to.theta))),
            node.create_service(TeleportRelative, f'{name}/teleport_relative', service_callback(
                lambda by: turtle.teleport_relative(by.linear, by.angular))),
            node.create_service(SetPen, f'{name}/set_pen', service_callback(
                lambda _: node.get_logger().warning('this stand-in for turtlesim has no pen'))),
        ]

        self._action = ActionServer(
            node, RotateAbsolute, f'{name}/rotate_absolute', self._execute,
            handle_accepted_callback=self._accept, cancel_callback=lambda _: CancelResponse.ACCEPT)

    def _accept(self, goal: ServerGoalHandle) -> None:
        if self._goal is not None:
            self._node.get_logger().warning('Rotation goal received before a previous goal '
                                            'finished. Aborting previous goal')
            self._finish(self._goal.abort)
        self._goal = goal
        self._result = Future()
        self._turtle.rotate_to(goal.request.theta)
        goal.execute()

    async def _execute(self, _: ServerGoalHandle) -> RotateAbsolute.Result:
        return await self._result

    def _finish(self, end: Callable[[], None]) -> None:
        end()
        self._goal = None
        self._result.set_result(RotateAbsolute.Result(delta=self._turtle.delta))

    def cancel_goal_if_requested(self) -> None:
        """End a canceled rotation. This is called before every tick."""
        if self._goal is not None and self._goal.is_cancel_requested:
            self._node.get_logger().info('Rotation goal canceled')
            self._turtle.stop()
            self._finish(self._goal.canceled)

    def publish(self, pose: TurtlePose) -> None:
        """Publish the state after a tick, and report the progress of a rotation."""
        self._publisher.publish(Pose(**pose._asdict()))
        self._color_publisher.publish(BACKGROUND)
        if self._goal is None:
            return
        if self._turtle.goal is None and not self._turtle.reached:
            self._node.get_logger().warning(
                'Velocity command received during rotation goal. Aborting goal')
            return self._finish(self._goal.abort)
        self._goal.publish_feedback(RotateAbsolute.Feedback(remaining=self._turtle.remaining))
        if self._turtle.reached:
            self._node.get_logger().info('Rotation goal completed successfully')
            self._finish(self._goal.succeed)

    def close(self) -> None:
        if self._goal is not None:
            self._finish(self._goal.abort)
        self._action.destroy()
        self._node.destroy_publisher(self._publisher)
        self._node.destroy_publisher(self._color_publisher)
        self._node.destroy_subscription(self._subscription)
        for service in self._services:
            self._node.destroy_service(service)


class TurtleSimNode(Node):
    """Turtlesim without a window. The module docstring lists the ROS API."""

    def __init__(self, **node_arguments: Any) -> None:
        super().__init__('turtlesim', **node_arguments)
        self.declare_parameter('holonomic', False, ParameterDescriptor(
            description='If true, then turtles will be holonomic'))
        channel = IntegerRange(from_value=0, to_value=255, step=1)
        for letter, color in (('r', 'Red'), ('g', 'Green'), ('b', 'Blue')):
            value = getattr(BACKGROUND, letter)
            self.declare_parameter(f'background_{letter}', value, ParameterDescriptor(
                description=f'{color} channel of the background color', integer_range=[channel]))
        self._sim = TurtleSim(self.get_parameter('holonomic').value, self._now())
        self.add_post_set_parameters_callback(
            lambda _: self._sim.set_holonomic(self.get_parameter('holonomic').value))
        self._topics: dict[str, TurtleTopics] = {}
        self.get_logger().info(
            f'Starting turtlesim with node name {self.get_fully_qualified_name()}')
        self._open('turtle1')
        self.create_service(Empty, 'reset', service_callback(self._reset))
        self.create_service(Empty, 'clear', service_callback(
            lambda _: self.get_logger().warning('this stand-in for turtlesim has no pen')))
        self.create_service(Spawn, 'spawn', self._spawn)
        self.create_service(Kill, 'kill', service_callback(self._kill))
        # A steady clock is used because the Qt timer in the real turtlesim ignores simulated time.
        self.create_timer(TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _tick(self) -> None:
        for topics in self._topics.values():
            topics.cancel_goal_if_requested()
        for name, pose in self._sim.tick(self._now()).items():
            clamped = self._sim.turtles[name].clamped
            if clamped:
                self.get_logger().warning('Oh no! I hit the wall! '
                                          '(Clamping from [x=%f, y=%f])' % clamped)
            self._topics[name].publish(pose)

    def _open(self, name: str) -> None:
        turtle = self._sim.turtles[name]
        self._topics[name] = TurtleTopics(self, name, turtle)
        self.get_logger().info('Spawning turtle [%s] at x=[%f], y=[%f], theta=[%f]'
                               % (name, *turtle.pose[:3]))

    def _spawn(self, request: Spawn.Request, response: Spawn.Response) -> Spawn.Response:
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
        if self._sim.kill(request.name):
            self._topics.pop(request.name).close()
        else:
            self.get_logger().error(f'Tried to kill turtle [{request.name}], which does not exist')

    def _reset(self, _: Empty.Request) -> None:
        self.get_logger().info('Resetting turtlesim.')
        self._sim.reset(self._now())
        for topics in self._topics.values():
            topics.close()
        self._topics.clear()
        self._open('turtle1')
