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
viewer: show the running graph in a browser, for machines without rviz2.

The node draws the data from the topics 30 times per second. Any node on any machine can publish
these topics. The content of the page is defined in page.py.

Subscribes:
    robot_description (std_msgs/String, latched): the shapes of the robot
    /tf, /tf_static: the poses of all frames
    walls (visualization_msgs/MarkerArray, latched): the walls of the arena
    brick_marker (visualization_msgs/Marker, latched): the brick
    brick_state (std_msgs/String, latched): the state of the brick
    catcher_marker (visualization_msgs/Marker): the text "Unreachable" in the scene
    catcher_state (std_msgs/String, latched): the state of the catcher
    catcher_decision (std_msgs/String, latched): "reachable: …" or "unreachable: …"
    goal_pose (geometry_msgs/PoseStamped): the goal of the robot
    tilt (turtle_brick_interfaces/Tilt): the angle of the platform (rad)
    cmd_vel, turtle1/cmd_vel (geometry_msgs/Twist), odom (nav_msgs/Odometry),
        joint_states (sensor_msgs/JointState): used only for their message rates

Publishes commands from the page:
    goal_pose (geometry_msgs/PoseStamped): the clicked point on the ground
    tilt (turtle_brick_interfaces/Tilt): the angle (rad) set with the slider

Calls services for commands from the page:
    place (turtle_brick_interfaces/Place), drop (std_srvs/Trigger)

Parameters, read-only:
    host (string, default 127.0.0.1): the network interface of the page; 0.0.0.0 for all interfaces
    port (integer, default 8080): the TCP port of the page; 0 for any free port. If the port is in
        use, the page uses the next free port.
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
from turtle_brick.ros.node_main import init, spin
from turtle_brick.ros.tf import GuardedListener, LATCHED, WORLD
from turtle_brick.view.page import Page
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker, MarkerArray

VISER = 'viser==1.1.1'
"""Required version of viser, which must match scripts/requirements.txt."""

DRAW_PERIOD = 1.0 / 30.0
"""Time (s) between updates of the scene."""

RATE_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""QoS for measuring message rates. With this QoS, publishers do not wait for the viewer."""


class Viewer(Node):
    """Shows the running graph in a browser and executes commands from the page."""

    def __init__(self, **node_options: Any) -> None:
        """
        Serve the page and subscribe to all topics.

        :param node_options: options for rclpy.node.Node
        :raises ParameterError: if the page cannot be served at the configured host and port
        """
        # This import is here because main() must also work without viser.
        from turtle_brick.view.server import PageServer
        super().__init__('viewer', **node_options)
        host = self.declare_parameter('host', '127.0.0.1', ParameterDescriptor(
            description='Network interface of the page', read_only=True)).value
        port = self.declare_parameter('port', 8080, ParameterDescriptor(
            description='Preferred port of the page', read_only=True)).value
        self.server = PageServer(host, port, f'turtle_brick {self.get_namespace()}'.rstrip(' /'))
        self._scheduled: deque[Callable[[], None]] = deque()
        self._has_browser = False
        buffer = Buffer()
        self.panel, self.page = self.server.update(lambda: self._create_page(buffer))
        self.tf_listener = GuardedListener(
            buffer, self, lambda transform: self.page.on_transform(transform))
        self._goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self._tilt_publisher = self.create_publisher(Tilt, 'tilt', 10)
        self._create_subscriptions()
        self._place_client = self.create_client(Place, 'place')
        self._drop_client = self.create_client(Trigger, 'drop')
        self.create_timer(DRAW_PERIOD, self._on_timer)
        if port not in (0, self.server.port):
            self.get_logger().warning(
                f'Port {port} is in use, so the page is served on port {self.server.port}')
        # `ros2 launch` shows standard error but not standard output.
        print(f'Viewer: {self.server.url}', file=sys.stderr, flush=True)

    def _create_page(self, buffer: Buffer) -> tuple[Any, Page]:
        from turtle_brick.view.panel import Panel, PanelCallbacks
        from turtle_brick.view.scene import Scene
        scene = Scene(self.server.viser)
        panel = Panel(self.server.viser, scene, PanelCallbacks(
            place=partial(self.schedule, self.place),
            drop=partial(self.schedule, self.drop),
            tilt=partial(self.schedule, self.tilt),
            drive=partial(self.schedule, self.drive),
            replay=partial(self.schedule, lambda speed: self.page.toggle_replay(speed))))
        return panel, Page(scene, panel, buffer, self.get_logger().warning,
                           self.count_publishers, monotonic_ns)

    def _create_subscriptions(self) -> None:
        page = self.page
        for message_type, topic, callback, qos in (
                (String, 'robot_description', page.on_description, LATCHED),
                (MarkerArray, 'walls', page.on_walls, LATCHED),
                (Marker, 'brick_marker', partial(page.on_marker, 'brick_marker'), LATCHED),
                (String, 'brick_state', page.on_brick_state, LATCHED),
                (Marker, 'catcher_marker', partial(page.on_marker, 'catcher_marker'), 10),
                (String, 'catcher_state', page.on_catcher_state, LATCHED),
                (String, 'catcher_decision', page.on_catcher_decision, LATCHED),
                (PoseStamped, 'goal_pose', page.on_goal, 10),
                (Tilt, 'tilt', page.on_tilt, 10)):
            self.create_subscription(message_type, topic, callback, qos)
        # The launch files remap cmd_vel to turtle1/cmd_vel.
        for message_type, topic, name in (
                (Twist, 'cmd_vel', 'cmd_vel'), (Twist, 'turtle1/cmd_vel', 'cmd_vel'),
                (Odometry, 'odom', 'odom'), (JointState, 'joint_states', 'joint_states')):
            # Only the arrival times of these messages are used.
            self.create_subscription(
                message_type, topic, partial(page.record_arrival, name), RATE_QOS, raw=True)

    def destroy_node(self) -> None:
        """Stop the server and destroy the node."""
        self.server.viser.stop()
        super().destroy_node()

    def place(self, position: Vector, on_success: Callable[[], None] = lambda: None) -> None:
        """Place the brick at a position (m) in the world frame, and call a function on success."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = position
        self._call(self._place_client, request, on_success)

    def drop(self, position: Vector | None = None) -> None:
        """Place the brick if a position (m) is given, and then drop the brick."""
        if position is not None:
            self.place(position, on_success=self.drop)
        else:
            self._call(self._drop_client, Trigger.Request())

    def tilt(self, angle: float) -> None:
        """Tilt the platform to an angle (rad)."""
        self._tilt_publisher.publish(Tilt(angle=angle))

    def drive(self, x: float, y: float) -> None:
        """Send the robot to x and y (m) in the world frame."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 1.0
        self._goal_publisher.publish(goal)

    def schedule(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a function in the next timer callback. Any thread can call this method."""
        self._scheduled.append(partial(function, *arguments))

    def _on_timer(self) -> None:
        while self._scheduled:
            self._scheduled.popleft()()
        self.server.update(self.page.draw)
        if not self._has_browser and self.server.viser.get_clients():
            self._has_browser = True
            print('Viewer: a browser has opened the page', file=sys.stderr, flush=True)

    def _call(self, client: Client, request: Any,
              on_success: Callable[[], None] = lambda: None) -> None:
        """Call a service, show the response, and call a function on success."""
        service = self.resolve_service_name(client.srv_name)
        name = service.rpartition('/')[2]

        def on_response(future: Future) -> None:
            response = future.result()
            self._show_response(f'{name}: {response.message}', response.success)
            if response.success:
                on_success()

        if client.service_is_ready():
            self._show_response(f'{name}: waiting for the response', True)
            client.call_async(request).add_done_callback(on_response)
        else:
            self._show_response(f'{name}: the {service} service is not available', False)

    def _show_response(self, text: str, is_success: bool) -> None:
        self.server.update(lambda: self.panel.show_response(text, is_success))


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM."""
    if find_spec('viser') is None:
        print('viewer: the page requires viser, which is not installed. Install it with: '
              f'pip install {VISER}', file=sys.stderr)
        return 1
    with init(args):
        spin(Viewer())
    return 0


if __name__ == '__main__':
    sys.exit(main())
