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
viewer: shows the live graph in a browser, for machines that have no rviz2.

It draws what the topics say, and knows nothing of the nodes behind them: a graph on another
machine is shown just as well. Robot, walls, brick and markers are looked up 30 times per second.

Subscribes:
    robot_description (std_msgs/String, latched): the robot; every link is placed by TF
    /tf, /tf_static: where everything is
    walls (visualization_msgs/MarkerArray, latched)
    brick_marker (visualization_msgs/Marker, latched): its color tells what the brick does
    catcher_marker (visualization_msgs/Marker)
    goal_pose (geometry_msgs/PoseStamped), tilt (turtle_brick_interfaces/Tilt): what the robot is
        told to do
    cmd_vel or turtle1/cmd_vel (geometry_msgs/Twist), odom (nav_msgs/Odometry),
        joint_states (sensor_msgs/JointState): how often they come

Publishes, when it is asked to on the page:
    goal_pose (geometry_msgs/PoseStamped): the point of the ground that was clicked
    tilt (turtle_brick_interfaces/Tilt): the slider

Calls, when it is asked to on the page:
    place (turtle_brick_interfaces/Place), drop (std_srvs/Trigger)

Parameters, read-only:
    host (string, 127.0.0.1): the interface on which the page is served; 0.0.0.0 for all of them.
        The page answers under this name, localhost and any address, and for 0.0.0.0 under the
        name of this machine; to other names, and to pages of other origins, it is closed
    port (integer, 8080): the port; if it is taken, the next one that is free
"""

from collections import deque
from collections.abc import Callable
from importlib.util import find_spec
from random import uniform
import sys
from time import time_ns
from typing import Any

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.client import Client
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from rclpy.qos import ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.executor import make_executor
from turtle_brick.frames import LATCHED
from turtle_brick.frames import WORLD
from turtle_brick.parameters import ParameterError
from turtle_brick.spinning import init
from turtle_brick.spinning import spin
from turtle_brick.throttling import Warner
from turtle_brick.view.display import BRICK_MARKER
from turtle_brick.view.display import CATCHER_MARKER
from turtle_brick.view.display import Display
from turtle_brick.view.display import MOST_MARKERS
from turtle_brick.view.display import WALLS
from turtle_brick.view.polling import PollingNode
from turtle_brick.view.viewing import NANOSECONDS
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker
from visualization_msgs.msg import MarkerArray

VISER = 'viser==1.1.1'
"""What pip is to install for the page; the same as in scripts/requirements.txt."""

PERIOD = 1.0 / 30.0
"""Time (s) between two pictures."""

ANSWER_TIME = 5 * NANOSECONDS
"""How long (ns) a service may take to answer."""

RANDOM_HEIGHTS = (3.0, 9.0)
"""From which a brick is dropped at random (m)."""

MARGIN = 0.5
"""How far (m) within the walls it then is."""

MOST_COMMANDS = 10
"""How much of what is asked for on the page is done between two pictures: the latest."""

LONGEST_ANSWER = 300
"""How many characters of an answer are shown."""

LOSSY = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For what is soon out of date: nobody who publishes it ever waits for the viewer."""


class Listener(PollingNode):
    """
    Hear all that there is to be seen in the graph, and hand it on to a display.

    What comes often is fetched, all that has come since the last picture at once: being woken
    for each of the 750 messages per second of this graph costs far more.
    """

    def listen(self, display: Any) -> None:
        """
        Begin to listen.

        :param display: whose methods hear_... are called, as those of Display
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
            # Not looked into, hence not unpacked.
            self.poll(kind, topic, count(topic), LOSSY, raw=True)

    def now(self) -> int:
        """Return the present instant (ns), by the clock with which messages are sent."""
        return time_ns()


class Viewer(Listener):
    """Show the live graph in a browser, and do what is asked for there."""

    def __init__(self, **node_options: Any) -> None:
        """
        Serve the page, and begin to listen.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: the page cannot be served where the parameters say
        """
        # Here, since the rest of the package does without what it is drawn with.
        from turtle_brick.view import web_view
        super().__init__('viewer', **node_options)
        self._page = web_view
        host = self._parameter('host', '127.0.0.1', 'The interface on which the page is served')
        port = self._parameter('port', 8080, 'The port; if it is taken, the next free one')
        self._commands: deque[Any] = deque(maxlen=MOST_COMMANDS)
        try:
            self.view = web_view.WebView(host, port, self._commands.append)
        except web_view.AddressError as error:
            raise ParameterError(str(error)) from None
        self.display = Display(self.view, Buffer(node=self), Warner(self).warn)
        self._warner = Warner(self, limit=10)
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

    def destroy_node(self) -> None:
        """End the page, then the node."""
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
        """Fetch what has come, do what is asked for, and draw."""
        self.fetch()
        for _ in range(len(self._commands)):
            self._do(self._commands.popleft())
        self._take_answers()
        self.display.draw(self.now())

    def _do(self, command: Any) -> None:
        """Do what is asked for on the page."""
        page = self._page
        if isinstance(command, page.Place):
            self._place(command)
        elif isinstance(command, page.Drop):
            self._drop()
        elif isinstance(command, page.DropAtRandom):
            walls = self.display.walls()
            if walls is None:
                self._answer('drop at random: no walls in sight to drop it within', False)
                return
            west, east, south, north = walls
            self._place(page.Place(uniform(west + MARGIN, east - MARGIN),
                                   uniform(south + MARGIN, north - MARGIN),
                                   uniform(*RANDOM_HEIGHTS)), then=self._drop)
        elif isinstance(command, page.SetTilt):
            self._tilt_publisher.publish(Tilt(angle=command.angle))
        elif isinstance(command, page.SendTo):
            goal = PoseStamped()
            goal.header.frame_id = WORLD
            goal.header.stamp = self.get_clock().now().to_msg()
            goal.pose.position.x, goal.pose.position.y = command
            goal.pose.orientation.w = 1.0
            self._goal_publisher.publish(goal)

    def _place(self, point: Any, then: Callable[[], None] = lambda: None) -> None:
        """Ask for the brick to be placed, and for something else once it is."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = point
        self._call(self._place_client, request, then)

    def _drop(self) -> None:
        """Ask for the brick to fall."""
        self._call(self._drop_client, Trigger.Request(), lambda: None)

    def _call(self, client: Client, request: Any, then: Callable[[], None]) -> None:
        """Call a service, show what it answers, and do something if it agrees."""
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
        """Hand on the answers that have come, and say which will not."""
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
        """Show what came of a command."""
        text = text[:LONGEST_ANSWER]
        self.view.panel.show_answer(text, good)
        if not good:
            self._warner.warn('answer', text)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to stop."""
    if find_spec('viser') is None:
        print('viewer: the page in the browser is drawn by viser, which is not installed here: '
              f'pip install {VISER}', file=sys.stderr)
        return 1
    with init(args):
        executor = make_executor()
        executor.add_node(Viewer())
        spin(executor)
    return 0


if __name__ == '__main__':
    sys.exit(main())
