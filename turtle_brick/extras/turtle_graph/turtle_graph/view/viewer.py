# SPDX-License-Identifier: Apache-2.0

"""
viewer: show a running graph in a browser. The viewer is also the stand-in for rviz2.

While a browser is connected, the node updates the page 20 times per second. Otherwise, it does not
subscribe to the state streams: /tf, cmd_vel, odom and joint_states. Any node on any machine can
publish on the topics below. The content of the page is defined in page.py. The options are those
of rviz2: -d FILE for a configuration file and -f FRAME for the fixed frame.

Subscribes:
    robot_description (std_msgs/String, latched): the shapes of the robot
    /tf, /tf_static: the poses of all frames
    every topic in the node's namespace with the type visualization_msgs/Marker or
        visualization_msgs/MarkerArray
    goal_pose (geometry_msgs/PoseStamped): the goal of the robot
    tilt (any type with a floating-point field): the angle of the platform (rad)
    brick_state, catcher_state, catcher_decision (std_msgs/String, latched): the states of the
        brick and the catcher, and "reachable: …" or "unreachable: …"
    cmd_vel, turtle1/cmd_vel (geometry_msgs/Twist), odom (nav_msgs/Odometry),
        joint_states (sensor_msgs/JointState): used only for their message rates

Publishes goal_pose and tilt, and calls the services place and drop, when a user enters a command.

Parameters, read-only:
    host (string, default 127.0.0.1): the network interface of the page; 0.0.0.0 for all interfaces
    port (integer, default 8080): the TCP port of the page; 0 for any free port. If the port is in
        use, the page uses the next free port.
"""

import argparse
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from math import inf
import os
import sys
from time import monotonic, monotonic_ns
from typing import Any
import webbrowser

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_graph.client.geometry import Vector
from turtle_graph.client.observer import (angle_in, fill_angle, fill_position, load_type,
                                          MARKER_MESSAGES, matching_qos, PollingNode,
                                          subscription_qos)
from turtle_graph.client.spinning import run_node
from turtle_graph.view.page import Page, TEXT_TOPICS, WORLD
from turtle_graph.view.settings import read_settings, Settings

VISER = 'viser==1.1.1'
"""Required version of viser, which must match scripts/requirements.txt."""

DRAW_PERIOD, DISCOVERY_PERIOD = 0.05, 0.5
"""Periods (s) for updating the scene and for discovering new topics and services."""

IDLE_DELAY = 10.0
"""Time (s) without a browser after which the node stops receiving the state streams. Reloading the
page takes less time, so the curves and the replay are kept."""


class Viewer(Node):
    """Shows the running graph in a browser and executes commands from the page."""

    def __init__(self, name: str = 'viewer', settings: Settings = Settings(),
                 **node_options: Any) -> None:
        """
        Serve the page and create the subscriptions.

        :param settings: settings from an rviz2 configuration file
        :param node_options: options for rclpy.node.Node
        :raises ValueError: if the page cannot be served at the configured host and port
        """
        # This import is here because main() must also work without viser.
        from turtle_graph.view.server import PageServer
        super().__init__(name, **node_options)
        host = self.declare_parameter('host', '127.0.0.1', ParameterDescriptor(
            description='Network interface of the page', read_only=True)).value
        port = self.declare_parameter('port', 8080, ParameterDescriptor(
            description='Preferred port of the page', read_only=True)).value
        self.server = PageServer(host, port, f'{name} {self.get_namespace()}'.rstrip(' /'))
        self._settings = settings
        self._scheduled: deque[Callable[[], None]] = deque()
        self._last_visit = -inf
        self._streams: PollingNode | None = None
        self._clients_by_name: dict[str, Any] = {}
        self._tilt_publisher: Any = None
        self.panel, self.page = self.server.update(self._create_page)
        self.replay = self.page.toggle_replay
        self._goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self._create_subscriptions()
        if settings.description:
            self.page.on_description(String(data=settings.description))
        self.create_timer(DRAW_PERIOD, self._on_timer)
        self.create_timer(DISCOVERY_PERIOD, self._discover)
        # `ros2 launch` shows standard error but not standard output.
        print(f'{name}: {self.server.url}', file=sys.stderr, flush=True)

    def _create_page(self) -> tuple[Any, Page]:
        from turtle_graph.view.panel import Panel
        from turtle_graph.view.scene import Scene
        scene = Scene(self.server.viser)
        panel = Panel(self.server.viser, scene, self.schedule, self._settings.shows_frames)
        return panel, Page(scene, panel, Buffer(), self._settings, self.get_logger().warning,
                           self._find_sections, monotonic_ns)

    def _create_subscriptions(self) -> None:
        page, latched = self.page, subscription_qos(latched=True)
        for message_type, topic, callback, qos in (
                (TFMessage, '/tf_static', partial(page.on_transforms, True), latched),
                (String, self._settings.description_topic, page.on_description, latched),
                (PoseStamped, 'goal_pose', page.on_goal, 10)):
            self.create_subscription(message_type, topic, callback, qos)
        for topic in TEXT_TOPICS:
            self.create_subscription(String, topic, partial(page.on_text, topic), latched)

    def _open_streams(self) -> PollingNode:
        """Create a node, hidden from `ros2 node list`, that receives the state streams."""
        streams = PollingNode(f'_{self.get_name()}', context=self.context,
                              use_global_arguments=False)
        # With best-effort QoS, publishers do not wait for the viewer.
        subscribe = partial(streams.subscribe, qos=subscription_qos(latched=False, reliable=False))
        subscribe(TFMessage, self.resolve_topic_name('/tf'),
                  partial(self.page.on_transforms, False))
        # The launch files remap cmd_vel to turtle1/cmd_vel.
        for message_type, topic, name in (
                (Twist, 'cmd_vel', 'cmd_vel'), (Twist, 'turtle1/cmd_vel', 'cmd_vel'),
                (Odometry, 'odom', 'odom'), (JointState, 'joint_states', 'joint_states')):
            # Only the arrival times of the messages on these topics are used.
            subscribe(message_type, self.resolve_topic_name(topic),
                      partial(self.page.record_arrival, name), raw=True)
        return streams

    def _discover(self) -> None:
        """Subscribe to new marker topics, and connect to the tilt topic and the services."""
        inside = f'{self.get_namespace().rstrip("/")}/'
        known = {subscription.topic_name for subscription in self.subscriptions}
        for topic, types in self.get_topic_names_and_types():
            if topic == self.resolve_topic_name('tilt') and topic not in known:
                self._connect_tilt(topic, types[0])
            if types[0] in MARKER_MESSAGES and topic.startswith(inside) and topic not in known:
                self._connect_markers(topic, types[0], topic.removeprefix(inside))
        services = dict(self.get_service_names_and_types())
        for name in {'place', 'drop'} - self._clients_by_name.keys():
            service_types = services.get(self.resolve_service_name(name), [])
            with suppress(LookupError):  # No server exists, or the service type is not installed.
                self._clients_by_name[name] = self.create_client(load_type(service_types[0]), name)

    def _connect_tilt(self, topic: str, type_name: str) -> None:
        with suppress(LookupError):
            tilt_type = load_type(type_name)
            if fill_angle(tilt_type(), 0.0):
                self._tilt_publisher = self.create_publisher(tilt_type, topic, 10)
                self.create_subscription(
                    tilt_type, topic, lambda message: self.page.on_tilt(angle_in(message)), 10)

    def _connect_markers(self, topic: str, type_name: str, name: str) -> None:
        if publishers := self.get_publishers_info_by_topic(topic):
            self.create_subscription(load_type(type_name), topic, partial(
                self.page.on_markers, name), matching_qos(publishers))

    def _find_sections(self) -> tuple[bool, bool, bool]:
        return (any(client.service_is_ready() for client in self._clients_by_name.values()),
                self.count_publishers('odom') > 0, self.count_publishers('catcher_state') > 0)

    def destroy_node(self) -> None:
        """Stop the server and destroy both nodes."""
        self.server.stop()
        if self._streams:
            self._streams.destroy_node()
        super().destroy_node()

    def place(self, position: Vector, on_success: Callable[[], None] = lambda: None) -> None:
        """Place the brick at a position (m) in the world frame, and call a function on success."""
        self._call('place', position, on_success)

    def drop(self, position: Vector | None = None) -> None:
        """Place the brick if a position (m) is given, and then drop the brick."""
        if position is not None:
            self.place(position, on_success=self.drop)
        else:
            self._call('drop')

    def tilt(self, angle: float) -> None:
        """Tilt the platform to an angle (rad)."""
        if self._tilt_publisher is not None:
            message = self._tilt_publisher.msg_type()
            fill_angle(message, angle)
            self._tilt_publisher.publish(message)

    def drive(self, x: float, y: float) -> None:
        """Send the robot to a point (m) in the world frame."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 1.0
        self._goal_publisher.publish(goal)

    def schedule(self, command: str, *arguments: Any) -> None:
        """Schedule a viewer method for the next timer callback. This method is thread-safe."""
        self._scheduled.append(partial(getattr(self, command), *arguments))

    def _on_timer(self) -> None:
        while self._scheduled:
            self._scheduled.popleft()()
        if self.server.viser.get_clients():
            self._last_visit = monotonic()
            self._streams = self._streams or self._open_streams()
        elif self._streams and monotonic() - self._last_visit > IDLE_DELAY:
            self._streams.destroy_node()
            self._streams = None
            self.server.update(self.page.forget)
        if self._streams:
            self._streams.fetch()
            self.server.update(self.page.draw)

    def _call(self, name: str, position: Vector | None = None,
              on_success: Callable[[], None] = lambda: None) -> None:
        """Call a service with an optional position (m), and show the response."""
        def on_response(future: Future) -> None:
            response = future.result()
            # In another workspace, the response may have no success or message field.
            is_success = getattr(response, 'success', True)
            self._show_response(f'{name}: {getattr(response, "message", "done")}', is_success)
            if is_success:
                on_success()

        client = self._clients_by_name.get(name)
        if client is None or not client.service_is_ready():
            service = self.resolve_service_name(name)
            self._show_response(f'{name}: the {service} service is not available', False)
            return
        request = client.srv_type.Request()
        if position is not None and not fill_position(request, position):
            self._show_response(f'{name}: the request has no fields x, y and z', False)
            return
        self._show_response(f'{name}: waiting for the response', True)
        client.call_async(request).add_done_callback(on_response)

    def _show_response(self, text: str, is_success: bool) -> None:
        self.server.update(lambda: self.panel.show_response(text, is_success))


def parse(name: str, args: list[str]) -> Settings:
    """Return the settings from the rviz2 options -d and -f, and ignore all other arguments."""
    parser = argparse.ArgumentParser(prog=name, description='Show a graph in the browser.')
    parser.add_argument('-d', '--display-config', metavar='FILE', help='rviz2 configuration file')
    parser.add_argument('-f', '--fixed-frame', metavar='FRAME', help='fixed frame')
    options, _ = parser.parse_known_args(args)
    settings = Settings()
    try:
        if options.display_config:
            settings = read_settings(options.display_config)
    except ValueError as error:
        print(f'{name}: {error}. The page uses default settings.', file=sys.stderr)
    return settings._replace(fixed_frame=options.fixed_frame or settings.fixed_frame)


def main(args: list[str] | None = None, name: str = 'viewer') -> int | str | None:
    """Run the node until Ctrl-C or SIGTERM, and return the exit status or an error message."""
    if find_spec('viser') is None:
        print(f'{name}: the page requires viser, which is not installed. Install it with: '
              f'pip install {VISER}', file=sys.stderr)
        return 1
    argv = sys.argv if args is None else args

    def make_viewer() -> Viewer:
        viewer = Viewer(name, parse(name, remove_ros_args(argv)[1:]))
        # Like the real rviz2, the stand-in opens a window if a display is available.
        if name == 'rviz2' and (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
            webbrowser.open(viewer.server.url)
        return viewer

    return run_node(make_viewer, name, argv)


if __name__ == '__main__':
    sys.exit(main())
