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
What the viewer shows: it keeps what the messages say, and draws it on the page.

It belongs to no node, so that recorded messages can be drawn as well.
"""

from collections.abc import Callable
from math import dist, hypot
from typing import Any, TYPE_CHECKING

from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.time import Time
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException
from turtle_brick.arena import BRICK_COLORS
from turtle_brick.core.geometry import Pose
from turtle_brick.core.time_steps import NANOSECONDS, nanoseconds_of
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER
from turtle_brick.physics import Phase
from turtle_brick.ros.tf import BASE_LINK, BRICK, Intake, LATEST, ODOM, OLDEST, pose_of, WORLD
from turtle_brick.view.urdf_scene import (LARGEST, ORIGIN, parse_urdf, Robot, Shape, undrawable,
                                          UrdfError)
from turtle_brick.view.viewing import Account, common_instant, History, Key, Mark, Marks, Rate
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker

if TYPE_CHECKING:
    from turtle_brick.view.web_view import WebView

WALLS = 'walls'
BRICK_MARKER = 'brick_marker'
CATCHER_MARKER = 'catcher_marker'
"""The topics of markers. All markers on them are drawn."""

BRICK_TF = 'brick (TF)'
COUNTED = (('cmd_vel', 'turtle1/cmd_vel'), ('odom',), ('joint_states',), (BRICK_TF,))
"""
The topics whose rates are shown; of several names, the one that is heard.

The launch files remap cmd_vel to turtlesim's name.
"""

FRAMES = (WORLD, ODOM, BASE_LINK, BRICK)
"""The frames that can be shown."""

PHASES = {phase.value: phase for phase in Phase}

TEXT_PERIOD = NANOSECONDS // 5
"""Least time (ns) between two updates of the panel."""

GOAL = Shape('cylinder', (0.24, 0.24, 0.01), (0.10, 0.75, 0.25, 1.0))
"""The mark of the robot's goal on the ground."""

GOAL_REACHED = 0.05
"""How near (m) the robot has to be for the mark to vanish."""

MOST_MARKERS = 100
"""How many markers of a topic are drawn."""

MOST_POINTS = 10_000
"""How many points a marker may have."""

LONGEST_TEXT = 1000
"""How many characters text, namespace and frame of a marker may have together."""

UNREACHABLE = 'Unreachable'
"""The text on catcher_marker for a brick that can't be caught."""

SPEED_TIME = NANOSECONDS // 10
"""Over which time (ns) the robot's speed is measured."""

LONGEST_WARNING = 300
"""How many characters a warning may have."""

SOLIDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder'}


class Display:
    """
    Keep what the messages say, and draw it on the page.

    Every instant is in ns. A message is heard with the instant at which it came, and the page is
    drawn for an instant that is not earlier.
    """

    def __init__(self, view: 'WebView', buffer: Buffer, warn: Callable[[str, str], Any]) -> None:
        """
        Begin with nothing known.

        :param view: the page
        :param buffer: for the transforms; an empty one
        :param warn: called with a topic and a sentence about a message that can't be shown
        """
        self._view = view
        self._buffer = buffer
        self._warn = warn
        # Messages of several senders do not come in the order in which they were sent.
        self._intake = Intake(buffer, self._complain, jitter=NANOSECONDS)
        self._known_frames: set[str] = set()
        self._robot: Robot | None = None
        self._marks = Marks()
        self._brick_colors = dict(BRICK_COLORS)
        self._account = Account()
        self._goal: tuple[float, float] | None = None
        self._tilt = 0.0
        self._instant = 0
        self._drawn: dict[str, Pose | None] = {}
        self._text_time = 0
        self._suggested = False
        self._history = History(3)
        self._rates: dict[str, Rate] = {
            name: Rate() for names in COUNTED for name in names}

    def hear_description(self, message: String, now: int) -> None:
        """Hear which robot there is."""
        try:
            robot = parse_urdf(message.data)
        except UrdfError as error:
            self._complain('robot_description', f'The robot is not shown: {error}')
            return
        if robot == self._robot:
            return
        if robot.undrawn:
            self._complain(
                'robot_description', 'The viewer draws boxes, cylinders and spheres, not '
                f'{", ".join(robot.undrawn)}')
        if self._robot is not None:
            for link in self._robot.links:
                self._view.scene.remove(f'robot/{link}')
        self._robot = robot
        for link, shapes in robot.links.items():
            if shapes:
                self._view.scene.put(f'robot/{link}', shapes)

    def hear_transforms(self, message: TFMessage, static: bool, clock: int, now: int) -> None:
        """
        Hear transforms.

        :param message: the transforms
        :param static: whether they hold at all times
        :param clock: the instant at which they came by the clock that stamps them
        :param now: the same instant by the clock of everything else
        """
        bricks = 0
        for transform in self._intake.take_in(message, static, clock):
            self._known_frames.add(transform.header.frame_id)
            self._known_frames.add(transform.child_frame_id)
            bricks += transform.child_frame_id == BRICK
        if bricks:
            self._rates[BRICK_TF].add(now, bricks)

    def hear_marker(self, topic: str, message: Marker, now: int) -> None:
        """Hear a marker of a topic."""
        key: Key = (topic, message.ns, message.id)
        if message.action == Marker.DELETEALL:
            self._marks.clear(topic)
            return
        if message.action == Marker.DELETE:
            self._marks.remove(key)
            return
        try:
            mark = mark_of(message, now)
            if key not in self._marks.shown and self._marks.count(topic) >= MOST_MARKERS:
                raise ValueError(f'there are {MOST_MARKERS} of them already')
        except ValueError as error:
            self._complain(topic, f'A marker on {topic} is left out: {error}')
            return
        self._marks.put(key, mark)
        if topic == BRICK_MARKER:
            phase = phase_of(message)
            self._account.see_phase(phase)
            if phase is not None:
                self._brick_colors[phase] = mark.shape.color
        elif topic == CATCHER_MARKER and mark.shape.text == UNREACHABLE:
            self._account.see_unreachable()

    def hear_goal(self, message: PoseStamped, now: int) -> None:
        """Hear where the robot is sent."""
        frame = self.pose(message.header.frame_id or WORLD)
        if frame is None:
            self._complain('goal_pose', 'A goal is not shown: its frame '
                           f'{message.header.frame_id!r} is unknown')
            return
        point = message.pose.position
        x, y, _ = frame.transform((point.x, point.y, point.z))
        wild = undrawable((x, y))
        if wild is not None:
            self._complain('goal_pose', f'A goal is not shown: a coordinate is {wild:g}')
            return
        self._goal = (x, y)
        brick = self.pose(BRICK)
        self._account.see_goal(x, y, brick.position[:2] if brick is not None else None)

    def hear_tilt(self, message: Tilt, now: int) -> None:
        """Hear how the platform is tilted."""
        if undrawable((message.angle,)) is not None:
            self._complain('tilt', f'A tilt is not shown: it is {message.angle:g} rad')
            return
        self._tilt = message.angle
        self._account.see_tilt(message.angle)

    def hear_of(self, name: str, now: int) -> None:
        """Hear that a message has come, to count it."""
        self._rates[name].add(now)

    def phase(self) -> Phase | None:
        """Return what the brick does, None if that is unknown."""
        return self._account.phase

    def walls(self) -> tuple[float, float, float, float] | None:
        """Return in meters the least and greatest x, then y, of the walls, None without walls."""
        corners = [(mark.placed or ORIGIN, mark.shape) for key, mark in self._marks.shown.items()
                   if key[0] == WALLS]
        if not corners:
            return None
        spots = [frame.transform(shape.pose.position) for frame, shape in corners]
        xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
        return min(xs), max(xs), min(ys), max(ys)

    def rates(self, now: int) -> list[tuple[str, float | None]]:
        """Return what is counted and how often it comes (Hz), None for what does not come."""
        found = []
        for names in COUNTED:
            rates = [(name, self._rates[name].value(now)) for name in names]
            found.append(next((entry for entry in rates if entry[1] is not None), rates[0]))
        return found

    def pose(self, frame: str, stamp: int = 0) -> Pose | None:
        """Return the pose of a frame at an instant (ns; 0 for the latest), None if unknown."""
        if frame == self._fixed_frame():
            return ORIGIN
        transform = self._lookup(frame, stamp)
        if transform is None:
            return None
        pose = pose_of(transform.transform)
        return pose if undrawable(pose.position + pose.orientation) is None else None

    def drawn(self, frame: str) -> Pose | None:
        """Return the pose of a frame in the last picture, None if it is unknown."""
        if frame not in self._drawn:
            # What has stopped coming is unknown at this instant: it is where it was last.
            self._drawn[frame] = self.pose(frame, self._instant) or self.pose(frame)
        return self._drawn[frame]

    def draw(self, now: int) -> None:
        """Draw the page as it is at an instant (ns)."""
        self._instant = self._latest_instant()
        self._drawn.clear()
        with self._view.together():
            self._draw_robot()
            self._draw_marks(now)
            self._draw_frames()
            self._draw_goal()
            self._focus()
            if self._history.is_due(now):
                self._history.add(now, self._sample())
            if not 0 <= now - self._text_time < TEXT_PERIOD:
                self._text_time = now
                self._write(now)

    def _lookup(self, frame: str, stamp: int) -> TransformStamped | None:
        """Return a frame's transform at an instant (ns; 0 for the latest), None if unknown."""
        if frame not in self._known_frames:
            return None
        time = Time(nanoseconds=stamp) if stamp else LATEST
        try:
            return self._buffer.lookup_transform(self._fixed_frame(), frame, time)
        except TransformException:
            return None

    def _latest_instant(self) -> int:
        """Return the latest instant (ns) at which robot and brick are known, 0 if none moves."""
        moving = {BASE_LINK, BRICK}.union(self._robot.links if self._robot is not None else ())
        found = (self._lookup(frame, 0) for frame in moving)
        return common_instant((nanoseconds_of(transform.header.stamp) for transform in found
                               if transform is not None), OLDEST)

    def _draw_robot(self) -> None:
        if self._robot is not None:
            for link, shapes in self._robot.links.items():
                if shapes:
                    self._view.scene.move(f'robot/{link}', self.drawn(link))

    def _draw_marks(self, now: int) -> None:
        scene = self._view.scene
        self._marks.expire(now)
        shown = {}
        for key, mark in self._marks.shown.items():
            if mark.locked:
                pose = self.drawn(mark.frame)
            else:
                pose = mark.placed or (self.pose(mark.frame, mark.stamp) if mark.stamp
                                       else self.drawn(mark.frame))
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
                self._view.scene.move(name, self.drawn(frame))
            else:
                self._view.scene.remove(name)

    def _draw_goal(self) -> None:
        self._view.scene.put('goal', (GOAL,))
        robot = self.drawn(BASE_LINK)
        pose = None
        if self._goal is not None and robot is not None:
            x, y = self._goal
            if max(abs(robot.position[0] - x), abs(robot.position[1] - y)) > GOAL_REACHED:
                pose = Pose((x, y, 0.0), ORIGIN.orientation)
        self._view.scene.move('goal', pose)

    def _focus(self) -> None:
        """Have the cameras see the arena, the followed robot, or a robot without an arena."""
        robot = self.drawn(BASE_LINK) if self._view.panel.follow else None
        x = y = ARENA_CENTER if self._fixed_frame() == WORLD else 0.0
        if robot is not None:
            x, y, _ = robot.position
        self._view.scene.focus_on(x, y)

    def _sample(self) -> tuple[float | None, float | None, float | None]:
        """Return height of the brick (m), its distance (m) to the robot, and its speed (m/s)."""
        brick, robot = self.drawn(BRICK), self.drawn(BASE_LINK)
        before = self.pose(BASE_LINK, max(self._instant - SPEED_TIME, 1))
        height = distance = speed = None
        if brick is not None:
            height = round(brick.position[2], 3)
            if robot is not None:
                distance = round(dist(brick.position[:2], robot.position[:2]), 3)
        if robot is not None and before is not None:
            speed = round(dist(robot.position, before.position) * NANOSECONDS / SPEED_TIME, 3)
        return height, distance, speed

    def _write(self, now: int) -> None:
        panel = self._view.panel
        brick = self.drawn(BRICK)
        phase = self._account.phase
        if brick is None:
            panel.show_brick('no brick in sight', None)
        else:
            if not self._suggested:
                panel.suggest_place(brick.position)
                self._suggested = True
            panel.show_brick(
                f'{phase.value if phase else "brick"}, {brick.position[2]:.2f} m up',
                self._brick_colors[phase] if phase else None)
        panel.show_legend(self._brick_colors)
        panel.show_account(self._account.sentence(), self._account.unreachable)
        panel.show_tilt(self._tilt)
        panel.show_rates(self.rates(now))
        panel.show_history(self._history)

    def _fixed_frame(self) -> str:
        """Return the frame in which all is drawn: the world, or the root of a robot alone."""
        if WORLD in self._known_frames or self._robot is None:
            return WORLD
        return self._robot.root

    def _complain(self, topic: str, sentence: str) -> None:
        """Warn of a message, whose texts may hold any characters."""
        self._warn(topic, ''.join(letter if letter.isprintable() else ' '
                                  for letter in sentence[:LONGEST_WARNING]))


def mark_of(marker: Marker, now: int) -> Mark:
    """
    Read a marker that is to be added.

    :param marker: the message
    :param now: the instant at which it came (ns)
    :raises ValueError: it can't be drawn; the text says why
    """
    frame = marker.header.frame_id
    if marker.action != Marker.ADD:
        raise ValueError(f'its action is {marker.action}')
    if not frame:
        raise ValueError('its frame_id is empty')
    letters = len(marker.text) + len(marker.ns) + len(frame)
    if letters > LONGEST_TEXT:
        raise ValueError(f'its texts have {letters} characters')
    if len(marker.points) > MOST_POINTS:
        raise ValueError(f'it has {len(marker.points)} points')
    stamp = _instant_of(marker.header.stamp, 'stamp')
    lifetime = _instant_of(marker.lifetime, 'lifetime')
    shape = shape_of(marker)
    if shape is None:
        raise ValueError(f'its type is {marker.type}')
    wild = shape.undrawable()
    if wild is not None:
        raise ValueError(f'one of its numbers is {wild:g}')
    expires = now + lifetime if lifetime else None
    return Mark(frame, shape, marker.frame_locked, stamp, expires, heard=now)


def _instant_of(stamp: TimeMessage, name: str) -> int:
    """
    Return a stamp or duration in ns.

    :param stamp: the stamp or duration
    :param name: its name for the error
    :raises ValueError: it is negative or not normalized
    """
    if stamp.sec < 0 or stamp.nanosec >= NANOSECONDS:
        raise ValueError(f'its {name} is {stamp.sec} s and {stamp.nanosec} ns')
    return nanoseconds_of(stamp)


def shape_of(marker: Marker) -> Shape | None:
    """Return the shape of a marker, None for a type that is not drawn."""
    position, orientation = marker.pose.position, marker.pose.orientation
    quaternion = (orientation.x, orientation.y, orientation.z, orientation.w)
    length = hypot(*quaternion)
    if length == 0.0:
        quaternion = ORIGIN.orientation  # like rviz2
    elif length <= LARGEST:
        quaternion = tuple(part / length for part in quaternion)
    pose = Pose((position.x, position.y, position.z), quaternion)
    size = (marker.scale.x, marker.scale.y, marker.scale.z)
    color = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
    if marker.type in SOLIDS:
        return Shape(SOLIDS[marker.type], size, color, pose)
    if marker.type == Marker.TEXT_VIEW_FACING:
        return Shape('text', (size[2], size[2], size[2]), color, pose, text=marker.text)
    if marker.type not in (Marker.LINE_STRIP, Marker.LINE_LIST):
        return None
    points = [(point.x, point.y, point.z) for point in marker.points]
    if marker.type == Marker.LINE_STRIP:
        points = [point for pair in zip(points, points[1:]) for point in pair]
    return Shape('lines', (size[0], size[0], size[0]), color, pose,
                 points=tuple(points[:len(points) // 2 * 2]))


def phase_of(marker: Marker) -> Phase | None:
    """Return what the brick does by the text of its marker, None if it does not say."""
    return PHASES.get(marker.text)
