# SPDX-License-Identifier: Apache-2.0
"""
Stand-ins for the programs in turtlesim 1.8.2.

mimic publishes the velocity from input/pose (turtlesim/msg/Pose) on output/cmd_vel.
draw_square calls the reset service and then drives turtle1 along squares.
turtle_teleop_key drives turtle1 with the arrow keys and turns it to a heading with the keys around
f, which cancels a rotation. It has the parameters scale_linear (double, default: 2.0 m/s) and
scale_angular (double, default: 2.0 rad/s).
"""

from itertools import cycle, repeat
from math import pi
import os
from select import select
from signal import raise_signal, SIGINT
import sys
import termios
import tty

from geometry_msgs.msg import Twist, Vector3
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Empty
from turtle_graph.client.spinning import run_node
from turtlesim.action import RotateAbsolute
from turtlesim.msg import Pose
from turtlesim_standin.node import TurtleSimNode
from turtlesim_standin.turtlesim_kinematics import QUEUE_DEPTH

ARROWS = {b'A': (1.0, 0.0), b'B': (-1.0, 0.0), b'C': (0.0, -1.0), b'D': (0.0, 1.0)}
"""Signs of the linear and angular velocities, keyed by the last byte of an arrow key code."""

HEADINGS = {b'g': 0.0, b't': 0.7854, b'r': 1.5708, b'e': 2.3562, b'd': 3.1416, b'c': -2.3562,
            b'v': -1.5708, b'b': -0.7854}
"""Goal headings (rad), keyed by key. The position of a key relative to f is its direction."""


class Program(Node):
    """A node that sends velocity commands to a turtle."""

    def __init__(self, name: str, topic: str = 'turtle1/cmd_vel') -> None:
        super().__init__(name)
        self._publisher = self.create_publisher(Twist, topic, QUEUE_DEPTH)

    def drive(self, linear: float, angular: float) -> None:
        """Publish a forward velocity (m/s) and a counterclockwise angular velocity (rad/s)."""
        self._publisher.publish(Twist(linear=Vector3(x=linear), angular=Vector3(z=angular)))


class Mimic(Program):
    """Makes one turtle move at the same velocity as another turtle."""

    def __init__(self) -> None:
        super().__init__('turtle_mimic', 'output/cmd_vel')
        self.create_subscription(Pose, 'input/pose', self._on_pose, QUEUE_DEPTH)

    def _on_pose(self, pose: Pose) -> None:
        self.drive(pose.linear_velocity, pose.angular_velocity)


class DrawSquare(Program):
    """Drives turtle1 along 2 m squares by publishing one command for each received pose."""

    def __init__(self) -> None:
        super().__init__('draw_square')
        self._client = self.create_client(Empty, 'reset')
        self._reset: Future | None = None
        self._commands = cycle((*repeat((1.0, 0.0), 125), *repeat((0.0, pi / 8.0), 250)))
        self.create_subscription(Pose, 'turtle1/pose', self._on_pose, QUEUE_DEPTH)

    def _on_pose(self, _: Pose) -> None:
        if self._reset is None and self._client.service_is_ready():
            self._reset = self._client.call_async(Empty.Request())
        if self._reset is not None and self._reset.done():
            self.drive(*next(self._commands))


class TeleopKey(Program):
    """Drives and turns turtle1 with the keyboard until the user presses q."""

    def __init__(self) -> None:
        """Make the terminal deliver each key press without waiting for Enter."""
        super().__init__('teleop_turtle')
        for name in ('scale_linear', 'scale_angular'):
            self.declare_parameter(name, 2.0)
        if not sys.stdin.isatty():
            raise RuntimeError('turtle_teleop_key reads the keyboard: start it in a terminal')
        self._client = ActionClient(self, RotateAbsolute, 'turtle1/rotate_absolute')
        self._goal: Future | None = None
        self._terminal = termios.tcgetattr(sys.stdin)
        tty.setcbreak(sys.stdin)
        print('Use the arrow keys to move the turtle, g, t, r, e, d, c, v and b to turn it to a '
              'heading, f to cancel this rotation, and q to quit.', flush=True)
        self.create_timer(0.02, self._on_timer)

    def _on_timer(self) -> None:
        while select([sys.stdin], [], [], 0.0)[0]:
            key = os.read(sys.stdin.fileno(), 1)
            if key in (b'q', b''):
                return raise_signal(SIGINT)
            if key in ARROWS:
                linear, angular = ARROWS[key]
                self.drive(linear * self.get_parameter('scale_linear').value,
                           angular * self.get_parameter('scale_angular').value)
            elif key in HEADINGS:
                self._goal = self._client.send_goal_async(
                    RotateAbsolute.Goal(theta=HEADINGS[key]))
            elif key == b'f' and self._goal is not None and self._goal.done():
                self._goal.result().cancel_goal_async()

    def destroy_node(self) -> None:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._terminal)
        super().destroy_node()


def main(program: str) -> str | None:
    """Run a program until Ctrl-C or SIGTERM."""
    return run_node({'draw_square': DrawSquare, 'mimic': Mimic, 'turtle_teleop_key': TeleopKey,
                     'turtlesim_node': TurtleSimNode}[program], program)
