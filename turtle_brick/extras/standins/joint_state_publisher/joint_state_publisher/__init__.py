# SPDX-License-Identifier: Apache-2.0
"""
The stand-in for joint_state_publisher and joint_state_publisher_gui 2.4.0.

Publishes: joint_states (sensor_msgs/JointState), at the rate set by the `rate` parameter.
Subscribes: robot_description (std_msgs/String, latched).
Argument: the path of a URDF file, which is read at the start.
Parameters: rate (integer, default: 10 Hz), zeros.<joint> (double, zero position in rad or m),
use_smallest_joint_limits (bool, default: true, apply the soft limits of <safety_controller>).
Positions of mimic joints are not published, because robot_state_publisher computes them.
joint_state_publisher_gui serves a web page on 127.0.0.1 instead of opening a window.
"""

from collections.abc import Callable
from math import pi
from pathlib import Path
from random import uniform
import sys
from typing import Any
from xml.etree import ElementTree

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from turtle_graph.client.spinning import run_node

LEFT_OUT = ('delta', 'dependent_joints', 'publish_default_efforts', 'publish_default_positions',
            'publish_default_velocities', 'source_list', 'use_mimic_tags')


PANEL_WIDTH = 5000
"""Width of the panel in pixels. In a smaller window, the panel is almost as wide as the window."""


class JointStatePublisher(Node):
    """Publishes the positions of the joints in the robot description."""

    def __init__(self, **options: Any) -> None:
        super().__init__('joint_state_publisher',
                         automatically_declare_parameters_from_overrides=True, **options)
        for name in LEFT_OUT:
            if self.get_parameters_by_prefix(name) or self.has_parameter(name):
                raise ValueError(
                    f'this stand-in for joint_state_publisher does not support {name}')
        rate = self.get_parameter_or('rate', Parameter('rate', value=10)).value
        if not rate > 0:
            raise ValueError(f'rate is {rate}, but must be greater than 0')
        self.positions: dict[str, float] = {}
        self.limits: dict[str, tuple[float, float, float]] = {}
        """Minimum, maximum and zero position of each joint (rad or m)."""
        self.get_logger().info(
            'Waiting for robot_description to be published on the robot_description topic...')
        self.create_subscription(String, 'robot_description', self.configure, QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.publisher = self.create_publisher(JointState, 'joint_states', 10)
        self.create_timer(1.0 / rate, self.publish)

    def configure(self, description: String) -> None:
        """Read the limits and zero positions of the joints from a robot description."""
        try:
            robot = ElementTree.fromstring(description.data.encode())
        except ElementTree.ParseError:
            self.get_logger().warning('Invalid robot_description given, ignoring')
            return
        smallest = self.get_parameter_or(
            'use_smallest_joint_limits', Parameter('use_smallest_joint_limits', value=True))
        self.limits = {}
        for joint in robot.findall('joint'):
            name, limit = joint.get('name', ''), joint.find('limit')
            if joint.get('type') in ('fixed', 'floating', 'planar') or (
                    joint.find('mimic') is not None):
                continue
            try:
                if joint.get('type') == 'continuous':
                    least, greatest = -pi, pi
                elif limit is None:
                    raise ValueError('the joint has no limits')
                else:
                    least = float(limit.get('lower', ''))
                    greatest = float(limit.get('upper', ''))
            except ValueError:
                self.get_logger().warning(
                    f'{name} is not fixed, nor continuous, but limits are not specified!')
                continue
            safety = joint.find('safety_controller')
            if safety is not None and smallest.value:
                least = max(least, float(safety.get('soft_lower_limit', least)))
                greatest = min(greatest, float(safety.get('soft_upper_limit', greatest)))
            zero = self.get_parameter_or(f'zeros.{name}').value
            middle = (least + greatest) / 2 if least > 0 or greatest < 0 else 0.0
            self.limits[name] = least, greatest, middle if zero is None else zero
        self.positions = {name: zero for name, (_, _, zero) in self.limits.items()}

    def publish(self) -> None:
        message = JointState(name=list(self.positions), position=[
            float(position) for position in self.positions.values()])
        message.header.stamp = self.get_clock().now().to_msg()
        self.publisher.publish(message)


class Gui(JointStatePublisher):
    """Publishes joint positions that the user sets with sliders on a web page."""

    def __init__(self) -> None:
        from turtle_graph.view.server import PageServer  # This import is slow.
        self.server = PageServer('127.0.0.1', 8081, 'Joint State Publisher')
        self.server.update(self.arrange)
        super().__init__()
        print(f'Joint State Publisher: {self.server.url}', file=sys.stderr, flush=True)

    def configure(self, description: String) -> None:
        super().configure(description)
        self.server.update(self.create_sliders)

    def arrange(self) -> None:
        """Fill the window with the panel, because viser also shows a 3D scene, which is empty."""
        gui = self.server.viser.gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(PANEL_WIDTH)

    def create_sliders(self) -> None:
        """Create the Randomize and Center buttons, and one slider for each joint."""
        gui = self.server.viser.gui
        gui.reset()
        self.arrange()
        gui.add_button('Randomize').on_click(lambda _: self.move(
            lambda least, greatest, zero: uniform(least, greatest)))
        gui.add_button('Center').on_click(lambda _: self.move(lambda least, greatest, zero: zero))
        self.sliders: dict[str, Any] = {
            name: gui.add_slider(name, least, greatest, (greatest - least) / 10000,
                                 min(max(zero, least), greatest))
            for name, (least, greatest, zero) in self.limits.items()}
        for name, slider in self.sliders.items():
            slider.on_update(lambda event, name=name: self.positions.update(
                {name: event.target.value}))

    def move(self, choose: Callable[[float, float, float], float]) -> None:
        """Set each joint to the position returned by choose(minimum, maximum, zero)."""
        def update() -> None:
            for name, limits in self.limits.items():
                self.sliders[name].value = self.positions[name] = choose(*limits)

        self.server.update(update)

    def destroy_node(self) -> None:
        self.server.stop()
        super().destroy_node()


def make_node(node_type: type[JointStatePublisher]) -> JointStatePublisher:
    """Create a node, and configure it if the command line contains the path of a URDF file."""
    files = [path for path in map(Path, remove_ros_args(sys.argv)[1:2]) if path.is_file()]
    node = node_type()
    if files:
        node.configure(String(data=files[0].read_text(encoding='utf-8')))
    return node


def main(node_type: type[JointStatePublisher] = JointStatePublisher) -> str | None:
    """Run a node until Ctrl-C or SIGTERM."""
    return run_node(lambda: make_node(node_type), 'joint_state_publisher')
