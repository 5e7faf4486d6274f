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
The nodes of a benchmark's processes: the real ones composed, or bare ones as the floor.

A bare node publishes and receives the same messages at the same rates as the real one, under the
same names, and does nothing else: it is what rclpy and DDS cost, whatever a node computes. Every
message is made once.

    python3 -m turtle_brick.tools.benchmark_nodes (bare|real) NODE... [--ros-args ...]

Several nodes share a process and an executor.
"""

from collections.abc import Sequence
from math import inf
import sys
from typing import Any

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.arena import MARKER_PERIOD
from turtle_brick.catcher import PERIOD as CATCHER_PERIOD
from turtle_brick.core.driving import PERIOD as ROBOT_PERIOD
from turtle_brick.core.turtlesim_kinematics import QUEUE_DEPTH, TICK
from turtle_brick.physics import STEP
from turtle_brick.ros.node_main import init, spare_collector, spin
from turtle_brick.ros.tf import BASE_LINK, BRICK, LATCHED, ODOM, transform_message, WORLD
from turtle_brick.tools.graph import Graph
from turtle_brick.tools.interrupts import INTERRUPTS
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtlesim.msg import Pose
from visualization_msgs.msg import Marker, MarkerArray

TF = QoSProfile(depth=100)


class BareNode(Node):
    """A node that repeats messages and ignores those that it hears."""

    def __init__(self, name: str, **node_options: Any) -> None:
        """
        Say and hear nothing yet.

        :param name: of the node
        :param node_options: passed on to rclpy.node.Node
        """
        super().__init__(name, **node_options)
        self._outgoing: list[tuple[Publisher, Any]] = []

    def hear(self, message_type: type, topic: str, qos: Any = 10) -> None:
        """Subscribe to a topic."""
        self.create_subscription(message_type, topic, self._ignore, qos)

    def hear_transforms(self) -> None:
        """Subscribe to what a TransformListener does."""
        self.hear(TFMessage, '/tf', TF)
        self.hear(TFMessage, '/tf_static',
                  QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL))

    def repeat(self, message: Any, topic: str, qos: Any = 10) -> None:
        """Publish a message whenever `speak` is called."""
        self._outgoing.append((self.create_publisher(type(message), topic, qos), message))

    def speak(self) -> None:
        """Publish every message that is to be repeated."""
        for publisher, message in self._outgoing:
            publisher.publish(message)

    def _ignore(self, message: Any) -> None:
        """Do nothing with a message."""


class BareTurtleRobot(BareNode):
    """The floor of turtle_robot."""

    def __init__(self, **node_options: Any) -> None:
        """Speak 100 times per second."""
        super().__init__('turtle_robot', **node_options)
        self.hear(Pose, 'turtle1/pose')
        self.hear(PoseStamped, 'goal_pose')
        self.hear(Tilt, 'tilt')
        self.hear(TFMessage, '/tf_static')
        self.repeat(Twist(), 'cmd_vel')
        joints = JointState(name=['stem_joint', 'wheel_joint', 'platform_joint'],
                            position=[0.0, 0.0, 0.0])
        self.repeat(joints, 'joint_states')
        self.repeat(TFMessage(transforms=[transform_message(ODOM, BASE_LINK)]), '/tf', TF)
        odometry = Odometry()
        odometry.header.frame_id, odometry.child_frame_id = ODOM, BASE_LINK
        self.repeat(odometry, 'odom')
        self.create_publisher(TFMessage, '/tf_static', LATCHED)
        self.create_timer(ROBOT_PERIOD, self.speak)


class BareArena(BareNode):
    """The floor of the arena."""

    def __init__(self, **node_options: Any) -> None:
        """Speak 250 times per second."""
        super().__init__('arena', **node_options)
        self.hear_transforms()
        self.repeat(TFMessage(transforms=[transform_message(WORLD, BRICK)]), '/tf', TF)
        self.create_publisher(MarkerArray, 'walls', LATCHED)
        brick = self.create_publisher(Marker, 'brick_marker', LATCHED)
        self.create_timer(MARKER_PERIOD, lambda: brick.publish(Marker()))
        self.create_service(Place, 'place', lambda request, response: response)
        self.create_service(Trigger, 'drop', lambda request, response: response)
        self.create_timer(STEP * 1e-9, self.speak)


class BareCatcher(BareNode):
    """The floor of the catcher."""

    def __init__(self, **node_options: Any) -> None:
        """Wake up as often as the catcher does."""
        super().__init__('catcher', **node_options)
        self.hear_transforms()
        self.create_publisher(PoseStamped, 'goal_pose', 10)
        self.create_publisher(Tilt, 'tilt', 10)
        self.create_publisher(Marker, 'catcher_marker', 10)
        self.create_timer(CATCHER_PERIOD, self.speak)


class BareTurtlesim(BareNode):
    """The floor of turtlesim."""

    def __init__(self, **node_options: Any) -> None:
        """Speak once per tick."""
        super().__init__('turtlesim', **node_options)
        self.hear(Twist, 'turtle1/cmd_vel', QUEUE_DEPTH)
        self.repeat(Pose(), 'turtle1/pose', QUEUE_DEPTH)
        self.create_timer(TICK, self.speak)


class BareRobotStatePublisher(BareNode):
    """The floor of robot_state_publisher."""

    def __init__(self, **node_options: Any) -> None:
        """Speak after every joint state."""
        super().__init__('robot_state_publisher', **node_options)
        self.repeat(TFMessage(transforms=[
            transform_message(BASE_LINK, 'stem'), transform_message('stem', 'wheel'),
            transform_message('post', 'platform')]), '/tf', TF)
        self.create_publisher(TFMessage, '/tf_static', LATCHED)
        self.create_publisher(String, 'robot_description', LATCHED)
        self.create_subscription(JointState, 'joint_states', lambda _: self.speak(), 10)


BARE_NODES = {
    'turtle_robot': BareTurtleRobot,
    'arena': BareArena,
    'catcher': BareCatcher,
    'turtlesim': BareTurtlesim,
    'robot_state_publisher': BareRobotStatePublisher,
}

REMAP = {'turtle_robot': ('-r', 'cmd_vel:=turtle1/cmd_vel')}
"""What a node needs to be connected to turtlesim."""


def add_real(graph: Graph, name: str) -> None:
    """Add a real node, or its stand-in, to a graph."""
    {'turtle_robot': graph.add_robot, 'arena': graph.add_arena, 'catcher': graph.add_catcher,
     'turtlesim': graph.add_turtlesim,
     'robot_state_publisher': graph.add_robot_state_publisher}[name]()


def add_bare(graph: Graph, name: str) -> None:
    """Add a bare node to a graph."""
    graph.add(BARE_NODES[name], *REMAP.get(name, ()), parameters=False)


def main(args: Sequence[str] | None = None) -> int:
    """Run nodes until Ctrl-C or SIGTERM."""
    kind, *names = args or sys.argv[1:]
    if '--ros-args' in names:
        names = names[:names.index('--ros-args')]
    if kind == 'bare' and len(names) == 1:
        with init():
            spin(BARE_NODES[names[0]]())
        return 0
    INTERRUPTS.take_over()
    try:
        with Graph(quiet=True) as graph:
            for name in names:
                (add_real if kind == 'real' else add_bare)(graph, name)
            spare_collector()
            graph.spin_until(lambda: False, inf, 'Ctrl-C')
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == '__main__':
    sys.exit(main())
