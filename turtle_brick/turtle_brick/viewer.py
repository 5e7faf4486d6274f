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
    brick_marker (visualization_msgs/Marker, latched): its colour tells what the brick does
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
    host (string, 127.0.0.1): the interface on which the page is served; 0.0.0.0 for all of them
    port (integer, 8080): the port; if it is taken, the next one that is free
"""

from functools import partial
from importlib.util import find_spec
from queue import SimpleQueue
from random import uniform
import sys
from typing import Any
from typing import Callable
from typing import Dict
from typing import Iterable
from typing import List
from typing import Optional
from typing import Tuple
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import CallbackGroup
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from rclpy.qos import ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from tf2_ros import TransformException
from turtle_brick.arena import BRICK_COLORS
from turtle_brick.frames import BASE_LINK
from turtle_brick.frames import BRICK
from turtle_brick.frames import LATEST
from turtle_brick.frames import nanoseconds_of
from turtle_brick.frames import ODOM
from turtle_brick.frames import pose_of
from turtle_brick.frames import WORLD
from turtle_brick.geometry import Pose
from turtle_brick.geometry import rotate
from turtle_brick.node_tools import run
from turtle_brick.parameters import ParameterError
from turtle_brick.physics import Phase
from turtle_brick.urdf_scene import ORIGIN
from turtle_brick.urdf_scene import parse_urdf
from turtle_brick.urdf_scene import Robot
from turtle_brick.urdf_scene import Shape
from turtle_brick.urdf_scene import UrdfError
from turtle_brick.viewing import Account
from turtle_brick.viewing import Key
from turtle_brick.viewing import Mark
from turtle_brick.viewing import Marks
from turtle_brick.viewing import NANOSECONDS
from turtle_brick.viewing import Rate
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker
from visualization_msgs.msg import MarkerArray

if TYPE_CHECKING:
    from turtle_brick.web_view import WebView

VISER = 'viser==1.1.1'
"""What pip is to install for the page; the same as in scripts/requirements.txt."""

PERIOD = 1.0 / 30.0
"""Time (s) between two pictures."""

TEXT_PERIOD = NANOSECONDS // 5
"""Least time (ns) between two changes of a text on the panel."""

ANSWER_TIME = 5 * NANOSECONDS
"""How long (ns) a service may take to answer."""

FRAMES = (WORLD, ODOM, BASE_LINK, BRICK)
"""The frames that can be switched on."""

GOAL = Shape('cylinder', (0.3, 0.3, 0.004), (0.18, 0.49, 0.27, 0.6))
"""What marks the robot's goal on the ground."""

GOAL_REACHED = 0.05
"""How far (m) from it the robot need not be told any more."""

RANDOM_HEIGHTS = (3.0, 9.0)
"""From which a brick is dropped at random (m)."""

MARGIN = 0.5
"""How far (m) within the walls it then is."""

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For what was published before the viewer was there."""

LOSSY = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For what is soon out of date: nobody who publishes it ever waits for the viewer."""

SOLIDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder'}


class Polled(CallbackGroup):
    """
    Subscriptions that never wake the executor, since their messages are fetched when needed.

    Being woken for each of the 750 messages per second of this graph costs three times as much
    as fetching all that have come since the last picture.
    """

    def can_execute(self, entity: Any) -> bool:
        """Let the executor wait for none of them."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Let it execute none of them."""
        return False

    def ending_execution(self, entity: Any) -> None:
        """Take note of nothing."""


def fetch(subscription: Subscription) -> Iterable[Tuple[Any, int]]:
    """Yield the messages that have come, each with the instant (ns) at which it was sent."""
    with subscription.handle:
        while (taken := subscription.handle.take_message(
                subscription.msg_type, subscription.raw)) is not None:
            message, info = taken
            yield message, info['source_timestamp'] or info['received_timestamp']


class Display:
    """From messages to the page: what is heard is kept, and drawn when it is time."""

    def __init__(self, view: 'WebView', buffer: Buffer, warn: Callable[[str], Any]) -> None:
        """
        Know nothing yet.

        Args:
            view: the page
            buffer: an empty one, for the transforms
            warn: told what cannot be shown, in a sentence

        """
        self._view = view
        self._buffer = buffer
        self._warn = warn
        self._warned: set = set()
        self._known_frames: set = set()
        self._robot: Optional[Robot] = None
        self._marks = Marks()
        self._account = Account()
        self._goal: Optional[Tuple[float, float]] = None
        self._tilt = 0.0
        self._text_time = 0
        self._suggested = False
        self.rates: Dict[str, Rate] = {
            name: Rate() for name in ('cmd_vel', 'odom', 'joint_states', 'brick (TF)')}

    def hear_description(self, message: String) -> None:
        """Take in a robot."""
        try:
            robot = parse_urdf(message.data)
        except UrdfError as error:
            self._warn(f'The robot is not shown: {error}')
            return
        for what in robot.undrawn:
            self._warn(f'The viewer draws boxes, cylinders and spheres, not {what}')
        if self._robot is not None:
            for link in self._robot.links:
                self._view.scene.remove(f'robot/{link}')
        self._robot = robot
        for link, shapes in robot.links.items():
            if shapes:
                self._view.scene.put(f'robot/{link}', shapes)

    def hear_transforms(self, message: TFMessage, static: bool, stamp: int = 0) -> None:
        """Take in transforms, sent at an instant (ns)."""
        keep = self._buffer.set_transform_static if static else self._buffer.set_transform
        bricks = 0
        for transform in message.transforms:
            try:
                keep(transform, 'viewer')
            except TransformException as error:
                self._warn_once(f'A transform is left out: {error}')
                continue
            self._known_frames.add(transform.header.frame_id)
            self._known_frames.add(transform.child_frame_id)
            bricks += transform.child_frame_id == BRICK
        if bricks:
            self.rates['brick (TF)'].add(stamp, bricks)

    def hear_marker(self, topic: str, message: Marker, now: int) -> None:
        """Take in a marker, received at an instant (ns)."""
        key: Key = (topic, message.ns, message.id)
        if message.action == Marker.DELETEALL:
            self._marks.clear(topic)
        elif message.action == Marker.DELETE:
            self._marks.remove(key)
        else:
            shape = shape_of(message)
            if shape is None:
                self._warn_once(f'Markers of type {message.type}, as on {topic}, are not drawn')
                return
            lifetime = nanoseconds_of(message.lifetime)
            self._marks.put(key, Mark(
                message.header.frame_id, shape, message.frame_locked,
                nanoseconds_of(message.header.stamp), now + lifetime if lifetime else None))
        if topic == 'brick_marker':
            self._account.see_phase(phase_of(message))
        elif topic == 'catcher_marker' and message.text:
            self._account.see_unreachable()

    def hear_goal(self, message: PoseStamped) -> None:
        """Take in where the robot is sent."""
        frame = self._pose(message.header.frame_id)
        if frame is None:
            return
        point = message.pose.position
        x, y, _ = transformed(frame, (point.x, point.y, point.z))
        self._goal = (x, y)
        brick = self._pose(BRICK)
        self._account.see_goal(x, y, brick.position[:2] if brick is not None else None)

    def hear_tilt(self, message: Tilt) -> None:
        """Take in how the platform is tilted."""
        self._tilt = message.angle
        self._account.see_tilt(message.angle)

    def walls(self) -> Optional[Tuple[float, float, float, float]]:
        """Return in m the least and the greatest x, then y, of the walls, None without walls."""
        corners = [(mark.placed or ORIGIN, mark.shape) for key, mark in self._marks.shown.items()
                   if key[0] == 'walls']
        if not corners:
            return None
        spots = [transformed(frame, shape.pose.position) for frame, shape in corners]
        xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
        return min(xs), max(xs), min(ys), max(ys)

    def draw(self, now: int) -> None:
        """Bring the page up to date at an instant (ns)."""
        with self._view.server.atomic():
            self._draw_robot()
            self._draw_marks(now)
            self._draw_frames()
            self._draw_goal()
            if not 0 <= now - self._text_time < TEXT_PERIOD:
                self._text_time = now
                self._write(now)

    def _draw_robot(self) -> None:
        if self._robot is not None:
            for link, shapes in self._robot.links.items():
                if shapes:
                    self._view.scene.move(f'robot/{link}', self._pose(link))

    def _draw_marks(self, now: int) -> None:
        scene = self._view.scene
        self._marks.expire(now)
        shown = {}
        for key, mark in self._marks.shown.items():
            if mark.locked:
                pose = self._pose(mark.frame)
            else:
                pose = mark.placed or self._pose(mark.frame, mark.stamp)
                if pose is not mark.placed:
                    self._marks.put(key, mark._replace(placed=pose))
            shown['markers/{}/{}/{}'.format(*key)] = (mark.shape, pose)
        for name in scene.names():
            if name.startswith('markers/') and name not in shown:
                scene.remove(name)
        for name, (shape, pose) in shown.items():
            scene.put(name, (shape,))
            scene.move(name, pose)

    def _draw_frames(self) -> None:
        for frame in FRAMES:
            name = f'frames/{frame}'
            if self._view.panel.frames:
                self._view.scene.put(name, (), axes=True)
                self._view.scene.move(name, self._pose(frame))
            else:
                self._view.scene.remove(name)

    def _draw_goal(self) -> None:
        self._view.scene.put('goal', (GOAL,))
        robot = self._pose(BASE_LINK)
        pose = None
        if self._goal is not None and robot is not None:
            x, y = self._goal
            if max(abs(robot.position[0] - x), abs(robot.position[1] - y)) > GOAL_REACHED:
                pose = Pose((x, y, 0.0), ORIGIN.orientation)
        self._view.scene.move('goal', pose)

    def _write(self, now: int) -> None:
        panel = self._view.panel
        brick = self._pose(BRICK)
        phase = self._account.phase
        if brick is None:
            panel.show_brick('no brick in sight', None)
        else:
            if not self._suggested:
                panel.suggest_place(brick.position)
                self._suggested = True
            panel.show_brick(
                f'{phase.value if phase else "brick"}, {brick.position[2]:.2f} m up',
                BRICK_COLORS.get(phase))
        panel.show_account(self._account.sentence(), self._account.unreachable)
        panel.show_tilt(self._tilt)
        panel.show_rates([(name, rate.value(now)) for name, rate in self.rates.items()])

    def _fixed_frame(self) -> str:
        """Return the frame in which all is drawn: the world, or the robot alone stands still."""
        if WORLD in self._known_frames or self._robot is None:
            return WORLD
        return self._robot.root

    def _pose(self, frame: str, stamp: int = 0) -> Optional[Pose]:
        """Return where a frame is at an instant (ns; 0 for the latest), None if that's unknown."""
        fixed = self._fixed_frame()
        if frame == fixed:
            return ORIGIN
        if frame not in self._known_frames:
            return None
        when = Time(nanoseconds=stamp) if stamp else LATEST
        try:
            return pose_of(self._buffer.lookup_transform(fixed, frame, when).transform)
        except TransformException:
            return None

    def _warn_once(self, sentence: str) -> None:
        """Say something that would otherwise be said again and again."""
        if sentence not in self._warned:
            self._warned.add(sentence)
            self._warn(sentence)


class Viewer(Node):
    """Show the live graph in a browser, and do what is asked for there."""

    def __init__(self, **node_options: Any) -> None:
        """
        Serve the page, and begin to listen.

        Args:
            node_options: passed on to rclpy.node.Node

        Raises:
            ParameterError: the page cannot be served where the parameters say

        """
        # Here, since the rest of the package does without what it is drawn with.
        from turtle_brick import web_view
        super().__init__('viewer', **node_options)
        self._page = web_view
        host = self._parameter('host', '127.0.0.1', 'The interface on which the page is served')
        port = self._parameter('port', 8080, 'The port; if it is taken, the next free one')
        self._commands: SimpleQueue = SimpleQueue()
        try:
            self.view = web_view.WebView(host, port, self._commands.put)
        except web_view.AddressError as error:
            raise ParameterError(str(error)) from None
        self.display = Display(self.view, Buffer(node=self), self.get_logger().warning)
        self._pending: List[Tuple[Future, str, int, Callable[[Any], None]]] = []

        self._goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self._tilt_publisher = self.create_publisher(Tilt, 'tilt', 10)
        self._place_client = self.create_client(Place, 'place')
        self._drop_client = self.create_client(Trigger, 'drop')

        display = self.display
        self.create_subscription(String, 'robot_description', display.hear_description, LATCHED)
        self.create_subscription(
            TFMessage, '/tf_static', partial(display.hear_transforms, static=True),
            QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.create_subscription(MarkerArray, 'walls', self._on_walls, LATCHED)
        self.create_subscription(
            Marker, 'brick_marker', partial(self._on_marker, 'brick_marker'), LATCHED)
        self.create_subscription(
            Marker, 'catcher_marker', partial(self._on_marker, 'catcher_marker'), 10)
        self.create_subscription(PoseStamped, 'goal_pose', display.hear_goal, 10)
        self.create_subscription(Tilt, 'tilt', display.hear_tilt, 10)
        polled = Polled()
        self._transforms = self.create_subscription(
            TFMessage, '/tf', print, LOSSY, callback_group=polled)
        # Not looked into, hence not unpacked. The launch files give cmd_vel turtlesim's name.
        self._counted = [
            (name, self.create_subscription(kind, topic, print, LOSSY, callback_group=polled,
                                            raw=True))
            for kind, name, topic in (
                (Twist, 'cmd_vel', 'cmd_vel'), (Twist, 'cmd_vel', 'turtle1/cmd_vel'),
                (Odometry, 'odom', 'odom'), (JointState, 'joint_states', 'joint_states'))]
        self.create_timer(PERIOD, self._on_timer)
        if self.view.port != port != 0:
            self.get_logger().warning(f'Port {port} is taken: the page is on {self.view.port}')
        print(f'Viewer: {self.view.url}', flush=True)

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

    def _now(self) -> int:
        return self.get_clock().now().nanoseconds

    def _on_walls(self, message: MarkerArray) -> None:
        now = self._now()
        for marker in message.markers:
            self.display.hear_marker('walls', marker, now)

    def _on_marker(self, topic: str, message: Marker) -> None:
        self.display.hear_marker(topic, message, self._now())

    def _on_timer(self) -> None:
        """Fetch what has come, do what is asked for, and draw."""
        for message, stamp in fetch(self._transforms):
            self.display.hear_transforms(message, False, stamp)
        for name, subscription in self._counted:
            for _, stamp in fetch(subscription):
                self.display.rates[name].add(stamp)
        while not self._commands.empty():
            self._do(self._commands.get())
        now = self._now()
        self._give_up(now)
        self.display.draw(now)

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
        name = client.srv_name.rpartition('/')[2]
        if not client.service_is_ready():
            self._answer(f'{name}: nobody offers {client.srv_name}', False)
            return

        def on_answer(response: Any) -> None:
            self._answer(f'{name}: {response.message}', response.success)
            if response.success:
                then()

        future = client.call_async(request)
        self._pending.append((future, name, self._now() + ANSWER_TIME, on_answer))

    def _give_up(self, now: int) -> None:
        """Hand on the answers that have come, and say which will not."""
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
        self.view.panel.show_answer(text, good)
        if not good:
            self.get_logger().warning(text)


def transformed(frame: Pose, point: Tuple[float, float, float]) -> Tuple[float, float, float]:
    """Return a point of a frame in the frame's parent (m)."""
    x, y, z = rotate(frame.orientation, point)
    return (x + frame.position[0], y + frame.position[1], z + frame.position[2])


def shape_of(marker: Marker) -> Optional[Shape]:
    """Return what a marker looks like, None for a type that isn't drawn."""
    position, orientation = marker.pose.position, marker.pose.orientation
    quaternion = (orientation.x, orientation.y, orientation.z, orientation.w)
    if not any(quaternion):
        quaternion = ORIGIN.orientation  # as rviz takes it
    pose = Pose((position.x, position.y, position.z), quaternion)
    size = (marker.scale.x, marker.scale.y, marker.scale.z)
    color = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
    if marker.type in SOLIDS:
        return Shape(SOLIDS[marker.type], size, color, pose)
    if marker.type == Marker.TEXT_VIEW_FACING:
        return Shape('text', (size[2], size[2], size[2]), color, pose, text=marker.text)
    points = [(point.x, point.y, point.z) for point in marker.points]
    if marker.type == Marker.LINE_STRIP:
        points = [point for pair in zip(points, points[1:]) for point in pair]
    elif marker.type != Marker.LINE_LIST:
        return None
    return Shape('lines', (size[0], size[0], size[0]), color, pose,
                 points=tuple(points[:len(points) // 2 * 2]))


def phase_of(marker: Marker) -> Optional[Phase]:
    """Return what the brick does by the colour of its marker, None if that tells nothing."""
    color = (marker.color.r, marker.color.g, marker.color.b)
    for phase, known in BRICK_COLORS.items():
        # as float32, to which the message has rounded it
        if all(abs(a - b) < 1e-6 for a, b in zip(color, known)):
            return phase
    return None


def main(args: Optional[List[str]] = None) -> int:
    """Run the node until it is told to stop."""
    if find_spec('viser') is None:
        print('viewer: the page in the browser is drawn by viser, which is not installed here: '
              f'pip install {VISER}', file=sys.stderr)
        return 1
    return run(Viewer, args)


if __name__ == '__main__':
    sys.exit(main())
