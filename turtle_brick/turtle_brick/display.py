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
What the viewer shows: what is heard in the graph is kept, and drawn on the page when it is time.

Messages come in here, and shapes, poses and sentences go out. It belongs to no node, so that what
was heard can also be drawn later.
"""

from math import isfinite
from typing import Any
from typing import Callable
from typing import Dict
from typing import List
from typing import Optional
from typing import Tuple
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseStamped
from rclpy.time import Time
from std_msgs.msg import String
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
from turtle_brick.geometry import Vector
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
from visualization_msgs.msg import Marker

if TYPE_CHECKING:
    from turtle_brick.web_view import WebView

WALLS = 'walls'
BRICK_MARKER = 'brick_marker'
CATCHER_MARKER = 'catcher_marker'
"""The topics of markers, whatever is on them is drawn."""

BRICK_TF = 'brick (TF)'
COUNTED = (('cmd_vel', 'turtle1/cmd_vel'), ('odom',), ('joint_states',), (BRICK_TF,))
"""
What is counted; of several names that which comes.

The launch files give cmd_vel turtlesim's name.
"""

FRAMES = (WORLD, ODOM, BASE_LINK, BRICK)
"""The frames that can be switched on."""

TEXT_PERIOD = NANOSECONDS // 5
"""Least time (ns) between two changes of the texts on the page."""

GOAL = Shape('cylinder', (0.24, 0.24, 0.01), (0.10, 0.75, 0.25, 1.0))
"""What marks the robot's goal on the ground."""

GOAL_REACHED = 0.05
"""How far (m) from it the robot need not be told any more."""

SOLIDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder'}


class Display:
    """
    From messages to the page: what is heard is kept, and drawn when it is time.

    Every instant is in ns. Messages are heard at the instant at which they came, pictures are
    drawn of an instant that is not before.
    """

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
        self._rates: Dict[str, Rate] = {
            name: Rate() for names in COUNTED for name in names}

    def hear_description(self, message: String, now: int) -> None:
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

    def hear_transforms(self, message: TFMessage, static: bool, now: int) -> None:
        """Take in transforms."""
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
            self._rates[BRICK_TF].add(now, bricks)

    def hear_marker(self, topic: str, message: Marker, now: int) -> None:
        """Take in a marker of a topic."""
        key: Key = (topic, message.ns, message.id)
        if message.action == Marker.DELETEALL:
            self._marks.clear(topic)
            return
        if message.action == Marker.DELETE:
            self._marks.remove(key)
            return
        shape = shape_of(message)
        if shape is None:
            self._warn_once(f'Markers of type {message.type}, as on {topic}, are not drawn')
            return
        if not shape.finite():
            self._warn_once(f'A marker on {topic} is not drawn: its numbers are not all finite')
            return
        lifetime = nanoseconds_of(message.lifetime)
        self._marks.put(key, Mark(
            message.header.frame_id, shape, message.frame_locked,
            nanoseconds_of(message.header.stamp), now + lifetime if lifetime else None))
        if topic == BRICK_MARKER:
            self._account.see_phase(phase_of(message))
        elif topic == CATCHER_MARKER:
            self._account.see_unreachable()

    def hear_goal(self, message: PoseStamped, now: int) -> None:
        """Take in where the robot is sent."""
        frame = self.pose(message.header.frame_id)
        if frame is None:
            return
        point = message.pose.position
        x, y, _ = transformed(frame, (point.x, point.y, point.z))
        if not isfinite(x) or not isfinite(y):
            return
        self._goal = (x, y)
        brick = self.pose(BRICK)
        self._account.see_goal(x, y, brick.position[:2] if brick is not None else None)

    def hear_tilt(self, message: Tilt, now: int) -> None:
        """Take in how the platform is tilted."""
        if isfinite(message.angle):
            self._tilt = message.angle
            self._account.see_tilt(message.angle)

    def hear_of(self, name: str, now: int) -> None:
        """Take note that a message has come, of which nothing else is of interest."""
        self._rates[name].add(now)

    def account(self) -> str:
        """Say what the robot is up to with the brick."""
        return self._account.sentence()

    def phase(self) -> Optional[Phase]:
        """Return what the brick does, None if that can't be told."""
        return self._account.phase

    def walls(self) -> Optional[Tuple[float, float, float, float]]:
        """Return in m the least and the greatest x, then y, of the walls, None without walls."""
        corners = [(mark.placed or ORIGIN, mark.shape) for key, mark in self._marks.shown.items()
                   if key[0] == WALLS]
        if not corners:
            return None
        spots = [transformed(frame, shape.pose.position) for frame, shape in corners]
        xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
        return min(xs), max(xs), min(ys), max(ys)

    def rates(self, now: int) -> List[Tuple[str, Optional[float]]]:
        """Return how often (Hz) each of what is counted comes at an instant (ns), if it does."""
        found = []
        for names in COUNTED:
            rates = [(name, self._rates[name].value(now)) for name in names]
            found.append(next((entry for entry in rates if entry[1] is not None), rates[0]))
        return found

    def pose(self, frame: str, stamp: int = 0) -> Optional[Pose]:
        """Return where a frame is at an instant (ns; 0 for the latest), None if that's unknown."""
        fixed = self._fixed_frame()
        if frame == fixed:
            return ORIGIN
        if frame not in self._known_frames:
            return None
        when = Time(nanoseconds=stamp) if stamp else LATEST
        try:
            pose = pose_of(self._buffer.lookup_transform(fixed, frame, when).transform)
        except TransformException:
            return None
        return pose if all(map(isfinite, pose.position + pose.orientation)) else None

    def draw(self, now: int) -> None:
        """Bring the page up to date at an instant (ns)."""
        with self._view.together():
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
                    self._view.scene.move(f'robot/{link}', self.pose(link))

    def _draw_marks(self, now: int) -> None:
        scene = self._view.scene
        self._marks.expire(now)
        shown = {}
        for key, mark in self._marks.shown.items():
            if mark.locked:
                pose = self.pose(mark.frame)
            else:
                pose = mark.placed or self.pose(mark.frame, mark.stamp)
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
                self._view.scene.move(name, self.pose(frame))
            else:
                self._view.scene.remove(name)

    def _draw_goal(self) -> None:
        self._view.scene.put('goal', (GOAL,))
        robot = self.pose(BASE_LINK)
        pose = None
        if self._goal is not None and robot is not None:
            x, y = self._goal
            if max(abs(robot.position[0] - x), abs(robot.position[1] - y)) > GOAL_REACHED:
                pose = Pose((x, y, 0.0), ORIGIN.orientation)
        self._view.scene.move('goal', pose)

    def _write(self, now: int) -> None:
        panel = self._view.panel
        brick = self.pose(BRICK)
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
        panel.show_rates(self.rates(now))

    def _fixed_frame(self) -> str:
        """Return the frame in which all is drawn: the world, or the robot alone stands still."""
        if WORLD in self._known_frames or self._robot is None:
            return WORLD
        return self._robot.root

    def _warn_once(self, sentence: str) -> None:
        """Say something that would otherwise be said again and again."""
        if sentence not in self._warned:
            self._warned.add(sentence)
            self._warn(sentence)


def transformed(frame: Pose, point: Vector) -> Vector:
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
