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
shows a graph on another machine as well. What it shows stands in page.py.

Subscribes:
    robot_description (std_msgs/String, latched): the robot; TF places its links
    /tf, /tf_static: the poses of all frames
    walls (visualization_msgs/MarkerArray, latched): the walls of the arena
    brick_marker (visualization_msgs/Marker, latched): the brick; its text tells what it does
    catcher_marker (visualization_msgs/Marker): the text "Unreachable"
    catcher_state (std_msgs/String, latched): why it is; the page can do without
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
        Requests have to name this host, this machine, localhost or a numeric address. Others are
        refused, and so are pages of other origins
    port (integer, default 8080): the TCP port of the page; 0 for any. If it is taken, the next
        free one
"""

from collections import deque
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
import sys
from time import monotonic_ns
from typing import Any

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_ros import Buffer
from turtle_brick.core.geometry import Vector
from turtle_brick.ros.node_main import init, spin, Warner
from turtle_brick.ros.tf import GuardedListener, LATCHED, WORLD
from turtle_brick.view.page import BRICK_MARKER, CATCHER_MARKER, Page, WALLS
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker, MarkerArray

VISER = 'viser==1.1.1'
"""What pip has to install for the page, as in scripts/requirements.txt."""

PERIOD = 1.0 / 30.0
"""Time (s) between two pictures."""

LOSSY = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For what is only counted: its publishers never wait for the viewer."""


class Viewer(Node):
    """Show the live graph in a browser, and carry out what is asked for there."""

    def __init__(self, **node_options: Any) -> None:
        """
        Serve the page, and begin to listen.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: the page cannot be served where the parameters say
        """
        # Here, since they need viser, without which main has to work.
        from turtle_brick.view.panel import Orders, Panel
        from turtle_brick.view.scene import Scene
        from turtle_brick.view.server import PageServer
        super().__init__('viewer', **node_options)
        host, port = (
            self.declare_parameter(name, default, ParameterDescriptor(
                description=description, read_only=True)).value
            for name, default, description in (
                ('host', '127.0.0.1', 'The interface on which the page is served'),
                ('port', 8080, 'The port; if it is taken, the next free one')))
        self.server = PageServer(host, port, 'turtle_brick')
        self._orders: deque[Callable[[], None]] = deque()
        buffer = Buffer()

        def lay_out() -> tuple[Panel, Page]:
            scene = Scene(self.server.viser)
            panel = Panel(self.server.viser, scene, Orders(
                self._soon(self.place), self._soon(self.drop), self._soon(self.tilt),
                self._soon(self.go)))
            return panel, Page(scene, panel, buffer, Warner(self).warn, self.count_publishers,
                               monotonic_ns)

        self.panel, self.page = self.server.change(lay_out)
        self.tf_listener = GuardedListener(
            buffer, self, lambda one, _: self.page.hear_transform(one))

        self._goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self._tilt_publisher = self.create_publisher(Tilt, 'tilt', 10)
        self._listen()
        self._place_client = self.create_client(Place, 'place')
        self._drop_client = self.create_client(Trigger, 'drop')
        self.create_timer(PERIOD, self._on_timer)
        if self.server.port != port != 0:
            self.get_logger().warning(
                f'Port {port} is not free: the page is on {self.server.port}')
        # Not on standard output, which `ros2 launch` does not show.
        print(f'Viewer: {self.server.url}', file=sys.stderr, flush=True)
        self._is_shown = False
        """Whether a browser has come to show the page, which is said once."""

    def destroy_node(self) -> None:
        """End the page and the node."""
        self.server.viser.stop()
        super().destroy_node()

    def place(self, place: Vector, then: Callable[[], None] = lambda: None) -> None:
        """Place the brick (m in the world), and do something else if that is possible."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = place
        self._call(self._place_client, request, then)

    def drop(self, place: Vector | None = None) -> None:
        """Drop the brick; if there is a place (m in the world), place it there first."""
        if place is not None:
            self.place(place, then=self.drop)
        else:
            self._call(self._drop_client, Trigger.Request())

    def tilt(self, angle: float) -> None:
        """Tilt the platform (rad)."""
        self._tilt_publisher.publish(Tilt(angle=angle))

    def go(self, x: float, y: float) -> None:
        """Send the robot to a point of the ground (m in the world)."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 1.0
        self._goal_publisher.publish(goal)

    def _listen(self) -> None:
        """Hear all that is shown, but the transforms."""
        page = self.page
        for kind, topic, hear, qos in (
                (String, 'robot_description', page.hear_description, LATCHED),
                (MarkerArray, WALLS, page.hear_walls, LATCHED),
                (Marker, BRICK_MARKER, partial(page.hear_marker, BRICK_MARKER), LATCHED),
                (Marker, CATCHER_MARKER, partial(page.hear_marker, CATCHER_MARKER), 10),
                (String, 'catcher_state', page.hear_state, LATCHED),
                (PoseStamped, 'goal_pose', page.hear_goal, 10),
                (Tilt, 'tilt', page.hear_tilt, 10)):
            self.create_subscription(kind, topic, hear, qos)
        # The launch files remap cmd_vel to turtlesim's name.
        for kind, topic, name in (
                (Twist, 'cmd_vel', 'cmd_vel'), (Twist, 'turtle1/cmd_vel', 'cmd_vel'),
                (Odometry, 'odom', 'odom'), (JointState, 'joint_states', 'joint_states')):
            # Only counted, hence not deserialized.
            self.create_subscription(kind, topic, partial(page.count, name), LOSSY, raw=True)

    def _soon(self, order: Callable[..., None]) -> Callable[..., None]:
        """Return a function, for any thread, that has an order carried out in the node's own."""
        return lambda *values: self._orders.append(partial(order, *values))

    def _on_timer(self) -> None:
        """Carry out the orders, and draw."""
        while self._orders:
            self._orders.popleft()()
        self.server.change(self.page.draw)
        if not self._is_shown and self.server.viser.get_clients():
            self._is_shown = True
            print('Viewer: a browser shows the page', file=sys.stderr, flush=True)

    def _call(self, client: Client, request: Any, then: Callable[[], None] = lambda: None
              ) -> None:
        """Call a service, show its answer, and do something else if it agrees."""
        service = self.resolve_service_name(client.srv_name)
        name = service.rpartition('/')[2]

        def on_answer(future: Future) -> None:
            response = future.result()
            self._answer(f'{name}: {response.message}', response.success)
            if response.success:
                then()

        if client.service_is_ready():
            self._answer(f'{name}: no answer yet', True)
            client.call_async(request).add_done_callback(on_answer)
        else:
            self._answer(f'{name}: nobody offers {service}', False)

    def _answer(self, text: str, good: bool) -> None:
        """Show what has become of an order."""
        self.server.change(lambda: self.panel.show_answer(text, good))


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
