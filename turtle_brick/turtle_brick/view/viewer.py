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
viewer: shows the live graph in a browser, for machines without rviz2.

It draws what the topics say, 30 times per second, and does not know which nodes publish them: it
shows a graph on another machine as well.

Subscribes:
    robot_description (std_msgs/String, latched): the robot; TF places its links
    /tf, /tf_static: the poses of all frames
    walls (visualization_msgs/MarkerArray, latched): the walls of the arena
    brick_marker (visualization_msgs/Marker, latched): the brick; its text tells what it does
    catcher_marker (visualization_msgs/Marker): the text "Unreachable"
    goal_pose (geometry_msgs/PoseStamped): where the robot is sent
    tilt (turtle_brick_interfaces/Tilt): the angle of the platform (rad)
    cmd_vel or turtle1/cmd_vel (geometry_msgs/Twist), odom (nav_msgs/Odometry),
        joint_states (sensor_msgs/JointState): counted, to show their rates

Publishes, when that is asked for on the page:
    goal_pose (geometry_msgs/PoseStamped): the point of the ground that was clicked
    tilt (turtle_brick_interfaces/Tilt): the angle of the slider (rad)

Calls, when that is asked for on the page:
    place (turtle_brick_interfaces/Place), drop (std_srvs/Trigger)

Parameters, read-only:
    host (string, default 127.0.0.1): the interface on which the page is served; 0.0.0.0 for all.
        Requests have to name this host, localhost or a numeric address, or for 0.0.0.0 the name of
        this machine. Others are refused, and so are pages of other origins
    port (integer, default 8080): the TCP port of the page; 0 for any. If it is taken, the next
        free one
"""

from collections import deque
from collections.abc import Callable
from importlib.util import find_spec
from random import uniform
import sys
from time import time_ns
from typing import Any

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.client import Client
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.core.parameters import ParameterError
from turtle_brick.ros.node_main import init, spin
from turtle_brick.ros.tf import LATCHED, WORLD
from turtle_brick.ros.throttling import Warner
from turtle_brick.view.commands import Command, Drop, DropAtRandom, PlaceAt, SendTo, SetTilt
from turtle_brick.view.display import BRICK_MARKER, CATCHER_MARKER, Display, MOST_MARKERS, WALLS
from turtle_brick.view.polling import PollingNode
from turtle_brick.view.viewing import NANOSECONDS
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker, MarkerArray

VISER = 'viser==1.1.1'
"""What pip has to install for the page, as in scripts/requirements.txt."""

PERIOD = 1.0 / 30.0
"""Time (s) between two pictures."""

ANSWER_TIME = 5 * NANOSECONDS
"""How long (ns) a service may take to answer."""

RANDOM_HEIGHTS = (3.0, 9.0)
"""Least and greatest height (m) of a brick that is dropped at random."""

MARGIN = 0.5
"""Its least distance (m) to the walls."""

MOST_COMMANDS = 10
"""How many commands of the page are carried out between two pictures: the latest ones."""

LONGEST_ANSWER = 300
"""How many characters of an answer are shown."""

LOSSY = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For what is soon out of date: its publishers never wait for the viewer."""


class Listener(PollingNode):
    """
    Hear all that is to be shown of the graph, and hand it on to a display.

    Frequent messages are fetched in one go before each picture. To be woken for each of the 750
    messages per second of this graph would cost far more.
    """

    def listen(self, display: Any) -> None:
        """
        Begin to listen.

        :param display: its methods hear_... are called, like those of Display
        """
        def now(hear: Callable[..., None], *arguments: Any) -> Callable[[Any], None]:
            return lambda message: hear(*arguments, message, self.now())

        def clock() -> int:
            return self.get_clock().now().nanoseconds

        def on_static(message: TFMessage) -> None:
            display.hear_transforms(message, True, clock(), self.now())

        def on_walls(message: MarkerArray) -> None:
            for marker in message.markers[:MOST_MARKERS]:
                display.hear_marker(WALLS, marker, self.now())

        several = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for kind, topic, callback, qos in (
                (String, 'robot_description', now(display.hear_description), LATCHED),
                (TFMessage, '/tf_static', on_static, several),
                (MarkerArray, WALLS, on_walls, LATCHED),
                (Marker, BRICK_MARKER, now(display.hear_marker, BRICK_MARKER), LATCHED),
                (Marker, CATCHER_MARKER, now(display.hear_marker, CATCHER_MARKER), 10),
                (PoseStamped, 'goal_pose', now(display.hear_goal), 10),
                (Tilt, 'tilt', now(display.hear_tilt), 10)):
            self.create_subscription(kind, topic, callback, qos)

        def sent(info: dict[str, int]) -> int:
            return info['source_timestamp'] or info['received_timestamp']

        def count(topic: str) -> Callable[[Any, dict[str, int]], None]:
            return lambda _, info: display.hear_of(topic, sent(info))

        self.poll(TFMessage, '/tf', lambda message, info: display.hear_transforms(
            message, False, clock(), sent(info)), LOSSY)
        for kind, topic in ((Twist, 'cmd_vel'), (Twist, 'turtle1/cmd_vel'), (Odometry, 'odom'),
                            (JointState, 'joint_states')):
            # Only counted, hence not deserialized.
            self.poll(kind, topic, count(topic), LOSSY, raw=True)

    def now(self) -> int:
        """Return the present instant (ns) by the clock that stamps messages when they are sent."""
        return time_ns()


class Viewer(Listener):
    """Show the live graph in a browser, and carry out what is asked for there."""

    def __init__(self, **node_options: Any) -> None:
        """
        Serve the page, and begin to listen.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: the page cannot be served where the parameters say
        """
        # Here, since it needs viser, without which main and Listener have to work.
        from turtle_brick.view.web_view import AddressError, WebView
        super().__init__('viewer', **node_options)
        host = self._parameter('host', '127.0.0.1', 'The interface on which the page is served')
        port = self._parameter('port', 8080, 'The port; if it is taken, the next free one')
        self._commands: deque[Command] = deque(maxlen=MOST_COMMANDS)
        try:
            self.view = WebView(host, port, self._commands.append)
            """The page."""
        except AddressError as error:
            raise ParameterError(str(error)) from None
        self.display = Display(self.view, Buffer(), Warner(self).warn)
        """What is on it."""
        self._pending: list[tuple[Future, str, int, Callable[[Any], None]]] = []

        self._goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self._tilt_publisher = self.create_publisher(Tilt, 'tilt', 10)
        self.listen(self.display)
        self._place_client = self.create_client(Place, 'place')
        self._drop_client = self.create_client(Trigger, 'drop')
        self.create_timer(PERIOD, self._on_timer)
        if self.view.port != port != 0:
            self.get_logger().warning(f'Port {port} is taken: the page is on {self.view.port}')
        # Not on standard output, which `ros2 launch` does not show.
        print(f'Viewer: {self.view.url}', file=sys.stderr, flush=True)
        self._shown = False
        """Whether a browser has come to show the page, which is said once."""

    def destroy_node(self) -> None:
        """End the page and the node."""
        self.view.close()
        super().destroy_node()

    def _parameter(self, name: str, default: Any, description: str) -> Any:
        """Declare a parameter and return its value, which has the type of its default."""
        descriptor = ParameterDescriptor(
            description=description, read_only=True, dynamic_typing=True)
        value = self.declare_parameter(name, default, descriptor).value
        if type(value) is not type(default):
            kind = 'a whole number' if isinstance(default, int) else 'a string'
            raise ParameterError(f'{name} is {value!r}, but must be {kind}')
        return value

    def _on_timer(self) -> None:
        """Fetch the messages, carry out the commands, and draw."""
        self.fetch()
        for _ in range(len(self._commands)):
            self._do(self._commands.popleft())
        self._take_answers()
        self.display.draw(self.now())
        if not self._shown and self.view.is_shown():
            self._shown = True
            print('Viewer: a browser shows the page', file=sys.stderr, flush=True)

    def _do(self, command: Command) -> None:
        """Carry out a command of the page."""
        match command:
            case PlaceAt():
                self._place(command)
            case Drop():
                self._drop()
            case DropAtRandom():
                walls = self.display.walls()
                if walls is None:
                    self._answer('drop at random: no walls are in sight', False)
                    return
                west, east, south, north = walls
                self._place(PlaceAt(uniform(west + MARGIN, east - MARGIN),
                                    uniform(south + MARGIN, north - MARGIN),
                                    uniform(*RANDOM_HEIGHTS)), then=self._drop)
            case SetTilt():
                self._tilt_publisher.publish(Tilt(angle=command.angle))
            case SendTo():
                goal = PoseStamped()
                goal.header.frame_id = WORLD
                goal.header.stamp = self.get_clock().now().to_msg()
                goal.pose.position.x, goal.pose.position.y = command
                goal.pose.orientation.w = 1.0
                self._goal_publisher.publish(goal)

    def _place(self, point: PlaceAt, then: Callable[[], None] = lambda: None) -> None:
        """Call the service place, and do something else if it agrees."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = point
        self._call(self._place_client, request, then)

    def _drop(self) -> None:
        """Call the service drop."""
        self._call(self._drop_client, Trigger.Request(), lambda: None)

    def _call(self, client: Client, request: Any, then: Callable[[], None]) -> None:
        """Call a service, show its answer, and do something else if it agrees."""
        service = self.resolve_service_name(client.srv_name)
        name = service.rpartition('/')[2]
        if not client.service_is_ready():
            self._answer(f'{name}: nobody offers {service}', False)
            return

        def on_answer(response: Any) -> None:
            self._answer(f'{name}: {response.message}', response.success)
            if response.success:
                then()

        future = client.call_async(request)
        self._pending.append((future, name, self.now() + ANSWER_TIME, on_answer))

    def _take_answers(self) -> None:
        """Show the answers that have come, and give up on those that are late."""
        now = self.now()
        for entry in list(self._pending):
            future, name, deadline, on_answer = entry
            if future.done():
                self._pending.remove(entry)
                on_answer(future.result())
            elif now > deadline:
                self._pending.remove(entry)
                future.cancel()
                self._answer(f'{name}: no answer', False)

    def _answer(self, text: str, good: bool) -> None:
        """Show the result of a command, on the page only: there somebody has asked for it."""
        self.view.panel.show_answer(text[:LONGEST_ANSWER], good)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to stop."""
    if find_spec('viser') is None:
        print('viewer: the page in the browser is drawn by viser, which is not installed here: '
              f'pip install {VISER}', file=sys.stderr)
        return 1
    with init(args):
        spin(Viewer())
    return 0


if __name__ == '__main__':
    sys.exit(main())
