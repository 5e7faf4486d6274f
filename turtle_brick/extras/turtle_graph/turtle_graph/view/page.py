# SPDX-License-Identifier: Apache-2.0

"""
Store data from messages and draw the data on the web page.

    messages ─→ on_…() ─→ stored data ─→ draw() ─┬─→ scene: the objects, by name
                                                 └─→ panel: text and curves

This module does not depend on a node or a server. Times (ns) come from a monotonic clock, except
for timestamps and the time shown in the scene, which are ROS times.
"""

from collections import deque
from collections.abc import Callable
from math import dist, nan
from time import time_ns
from typing import Any, TYPE_CHECKING

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.time import Time
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException
from turtle_graph.client.geometry import ORIGIN, Pose
from turtle_graph.client.messages import nanoseconds_of, NS_PER_SECOND, read_pose, read_vector
from turtle_graph.client.record import message_rate
from turtle_graph.view.replay import Replay, Snapshot
from turtle_graph.view.settings import Settings
from turtle_graph.view.shapes import (is_drawable, Markers, robot_shapes, RobotShapes,
                                      SceneObject, Shape)
from visualization_msgs.msg import Marker, MarkerArray

if TYPE_CHECKING:  # These modules import viser, which may not be installed.
    from turtle_graph.view.panel import Panel
    from turtle_graph.view.scene import Scene

WORLD, BASE_LINK, BRICK = 'world', 'base_link', 'brick'

BRICK_TF = 'brick (TF)'
"""Label of the brick's transforms in the list of message rates."""

RATE_NAMES = ('cmd_vel', 'odom', 'joint_states', BRICK_TF)
"""Labels of all entries in the list of message rates."""

GOAL = Shape('cylinder', (0.24, 0.24, 0.01), (0.10, 0.75, 0.25, 1.0))
"""Shape that marks the robot's goal on the ground."""

GOAL_TOLERANCE = 0.05
"""Minimum distance (m) between the robot and its goal at which the goal is shown."""

MAX_AGE_NS = NS_PER_SECOND // 2
"""Maximum delay (ns) of the drawn scene relative to the newest pose."""

TEXT_TOPICS = ('brick_state', 'catcher_state', 'catcher_decision')
"""Topics whose latest text is shown on the page."""

HINTS = {
    'floating': 'The assignment requires that a brick that has left the platform floats.',
    'grounded': 'The assignment requires that the brick is always inclined like the platform.'}
"""Explanations of brick states that look like faults."""

PANEL_PERIOD_NS = NS_PER_SECOND // 10
"""Update period (ns) of the panel."""

SPEED_WINDOW_NS = 400_000_000
"""Time (ns) over which the robot's speed is averaged. This period spans 25 turtlesim ticks and
40 turtle_robot cycles, so the curve is smooth."""

RATE_WINDOW = 2.0
"""Time (s) over which message rates are averaged."""

CURVE_LENGTH = 120
"""Number of points in each curve."""


class Page:
    """Stores data from messages and draws the data on the web page."""

    def __init__(self, scene: 'Scene', panel: 'Panel', buffer: Buffer, settings: Settings,
                 warn: Callable[[str], Any], find_sections: Callable[[], tuple[bool, bool, bool]],
                 clock: Callable[[], int]) -> None:
        """Create a page. `find_sections` detects whether an arena, a robot and a catcher exist."""
        self._scene = scene
        self._panel = panel
        self._buffer = buffer
        self._settings = settings
        self._warn = warn
        self._find_sections = find_sections
        self._clock = clock
        self._warnings: set[str] = set()
        self._robot = RobotShapes('', {})
        self._markers = Markers()
        self._replay = Replay()
        self._texts = dict.fromkeys(TEXT_TOPICS, '')
        self._goal: tuple[float, float] | None = None
        self._tilt = 0.0
        self._arrivals: dict[str, deque[float]] = {name: deque() for name in RATE_NAMES}
        self._points: deque[tuple[float, ...]] = deque(maxlen=CURVE_LENGTH)
        self._next_panel_update = 0
        self._is_moving: dict[str, bool] = {}
        """Whether each known frame has appeared in a transform on /tf."""
        self._pending: dict[str, TransformStamped] = {}
        self._stamps: dict[str, int] = {}
        """Timestamp (ns) of the latest transform of each moving frame."""
        self._fixed_frame = WORLD
        self._drawn_time = 0
        self._poses: dict[str, Pose | None] = {}

    def on_description(self, message: String) -> None:
        """Read the robot description."""
        try:
            self._robot = robot_shapes(message.data)
        except ValueError as error:
            self._warn_once(f'The robot is not shown: {error}')
        for kind in self._robot.skipped:
            self._warn_once(f'The page cannot draw <{kind}> in robot_description')

    def on_transforms(self, is_static: bool, message: TFMessage, info: Any = None) -> None:
        """
        Store all transforms with a valid position, time and child frame.

        Of the moving transforms, only the last of each frame before each `draw` is stored.
        """
        for transform in message.transforms:
            child = transform.child_frame_id.lstrip('/')
            if child == BRICK:
                self.record_arrival(BRICK_TF, None, info)
            if is_static:
                self._store(child, transform, True)
            else:
                self._pending[child] = transform

    def _store(self, child: str, transform: TransformStamped, is_static: bool) -> None:
        position = read_vector(transform.transform.translation)
        stamp = nanoseconds_of(transform.header.stamp)
        is_root = child == WORLD == (self._settings.fixed_frame or WORLD)
        if is_root or not is_drawable(*position) or not (
                0 <= stamp <= time_ns() + NS_PER_SECOND):
            self._warn_once('The page ignores transforms with a wrong position, time or child')
            return
        if is_static:
            self._buffer.set_transform_static(transform, 'viewer')
        else:
            self._buffer.set_transform(transform, 'viewer')
            self._stamps[child] = stamp
        for frame in (child, transform.header.frame_id.lstrip('/')):
            self._is_moving[frame] = self._is_moving.get(frame, False) or not is_static

    def on_markers(self, topic: str, message: Marker | MarkerArray) -> None:
        """Add, change or remove each marker in a message received from a topic."""
        for marker in getattr(message, 'markers', [message]):
            try:
                self._markers.update(topic, marker, self._clock())
            except ValueError as error:
                self._warn_once(f'A marker on {topic} is not shown: {error}')

    def on_text(self, topic: str, message: String) -> None:
        """Store the text from one of the TEXT_TOPICS."""
        self._texts[topic] = message.data
        # Messages on different topics can arrive in any order, so a decision can arrive before
        # the `falling` state. A decision expires when the brick hovers or rides on the platform.
        if topic == 'brick_state' and message.data in ('hovering', 'riding'):
            self._texts['catcher_decision'] = ''

    def on_goal(self, message: PoseStamped) -> None:
        """Store the goal of the robot."""
        point = read_vector(message.pose.position)
        frame = self._pose(message.header.frame_id or WORLD)
        if frame is not None and is_drawable(*point):
            self._goal = frame.compose(Pose(point)).position[:2]

    def on_tilt(self, angle: float) -> None:
        """Store the tilt (rad) of the platform."""
        if is_drawable(angle):
            self._tilt = angle

    def record_arrival(self, name: str, _: object = None, info: Any = None) -> None:
        """Record the arrival time of a message, from its MessageInfo, under one of RATE_NAMES."""
        age = time_ns() - info['received_timestamp'] if info else 0
        self._arrivals[name].append((self._clock() - age) / NS_PER_SECOND)

    def toggle_replay(self, speed: float) -> None:
        """Start replaying the last drop at a given speed (1 for real time), or stop the replay."""
        if not self._replay.toggle(self._clock(), speed):
            self._panel.show_response('replay: no drop has been recorded', False)

    def draw(self) -> None:
        """Draw the scene or its replay, and update the panel."""
        now = self._clock()
        for child, transform in self._pending.items():
            self._store(child, transform, False)
        self._pending.clear()
        default = WORLD if WORLD in self._is_moving else self._robot.root or WORLD
        self._fixed_frame = self._settings.fixed_frame or default
        self._drawn_time = self._find_drawn_time()
        self._poses.clear()
        robot = {f'robot/{link}': SceneObject(shapes, pose)
                 for link, shapes in self._robot.links.items()
                 if (pose := self._drawn_pose(link)) is not None}
        objects = {**robot, **self._goal_objects(), **self._frame_objects(),
                   **self._markers.objects(now, self._drawn_pose)}
        points = [link.pose.position for link in robot.values()]
        if brick := self._drawn_pose(BRICK):
            x, y, z = brick.position
            points += [(x, y, z), (x, y, 0.0)]
        live = Snapshot(now, objects, points)
        self._replay.record(live, self._texts['brick_state'])
        shown = self._replay.snapshot(now) or live
        self._scene.show(shown.objects)
        self._scene.keep_in_view(shown.points, self._fixed_frame == WORLD)
        if now >= self._next_panel_update:
            self._next_panel_update = max(self._next_panel_update + PANEL_PERIOD_NS, now)
            self._update_panel(now, shown is live)

    def forget(self) -> None:
        """Remove the moving objects, the curves and the replay, which are not kept up to date."""
        self._buffer.clear()
        self._points.clear()
        self._replay = Replay()
        self._scene.show({})

    def _goal_objects(self) -> dict[str, SceneObject]:
        robot = self._drawn_pose(BASE_LINK)
        if self._goal is None or robot is None or dist(
                robot.position[:2], self._goal) < GOAL_TOLERANCE:
            return {}
        return {'goal': SceneObject((GOAL,), Pose((*self._goal, 0.0)))}

    def _frame_objects(self) -> dict[str, SceneObject]:
        if not self._panel.frames.value:
            return {}
        # By default, static frames are hidden because a robot has many of them.
        return {f'frames/{frame}': SceneObject((), pose, frame)
                for frame, is_moving in self._is_moving.items()
                if (is_moving or self._settings.shows_frames)
                and frame not in self._settings.hidden_frames
                and (pose := self._drawn_pose(frame)) is not None}

    def _update_panel(self, now: int, is_live: bool) -> None:
        self._panel.show_sections(*self._find_sections())
        self._panel.show_fixed_frame(self._fixed_frame, self._fixed_frame in self._is_moving)
        brick = self._drawn_pose(BRICK)
        state, _, decision = texts = self._texts.values()
        if brick is not None and state == 'hovering':
            self._panel.suggest_position(brick.position)
        height = 'height unknown' if brick is None else f'height {brick.position[2]:.2f} m'
        text = f'{state}, {height}' if state else height
        self._panel.show_brick(text if is_live else 'Replay of the last drop',
                               HINTS.get(state, ''))
        self._panel.show_status(
            catch_status(*texts),
            decision.startswith('unreachable') and state in ('falling', 'grounded'))
        self._panel.show_tilt(self._tilt)
        for times in self._arrivals.values():
            while times and times[0] < now / NS_PER_SECOND - RATE_WINDOW:
                times.popleft()
        rates = {name: message_rate(times) for name, times in self._arrivals.items()}
        self._panel.show_rates(list(rates.items()))
        self._show_hidden_links(bool(rates['joint_states']))
        self._points.append((now / NS_PER_SECOND, *self._curve_values()))
        self._panel.show_curves(self._points)

    def _show_hidden_links(self, has_joint_states: bool) -> None:
        links = self._robot.links
        hidden = [link for link in links if self._drawn_pose(link) is None]
        if len(hidden) == len(links):
            hidden = []  # The robot or the fixed frame does not exist.
        self._panel.show_hidden_links(hidden, 'no transforms are received' if has_joint_states
                                      else 'no joint_states are received')

    def _curve_values(self) -> tuple[float, float, float]:
        brick, robot = self._drawn_pose(BRICK), self._drawn_pose(BASE_LINK)
        before = self._pose(BASE_LINK, max(self._drawn_time - SPEED_WINDOW_NS, 1))
        height = brick.position[2] if brick else nan
        distance = dist(brick.position[:2], robot.position[:2]) if brick and robot else nan
        length = dist(robot.position, before.position) if robot and before else nan
        return height, distance, length * NS_PER_SECOND / SPEED_WINDOW_NS

    def _find_drawn_time(self) -> int:
        """
        Return the latest time (ns) at which all robot and brick poses are known, or 0.

        If each object were drawn at its own latest time, objects that move together would appear
        separated. Poses more than MAX_AGE_NS older than the newest pose are ignored.
        """
        times = [stamp for frame, stamp in self._stamps.items()
                 if frame in (BASE_LINK, BRICK) or frame in self._robot.links]
        latest = max(times, default=0)
        return min((time for time in times if time > latest - MAX_AGE_NS), default=0)

    def _drawn_pose(self, frame: str) -> Pose | None:
        if frame not in self._poses:
            # If no new transforms arrive, the latest pose is shown.
            self._poses[frame] = self._pose(frame, self._drawn_time) or self._pose(frame)
        return self._poses[frame]

    def _pose(self, frame: str, stamp: int = 0) -> Pose | None:
        """Return the pose of a frame at a given time (ns), or the latest pose if the time is 0."""
        if frame == self._fixed_frame:
            return ORIGIN
        transform = self._lookup(frame, stamp)
        if transform is None:
            return None
        return read_pose(transform.transform.translation, transform.transform.rotation)

    def _lookup(self, frame: str, stamp: int) -> TransformStamped | None:
        try:
            return self._buffer.lookup_transform(self._fixed_frame, frame, Time(nanoseconds=stamp))
        except TransformException:
            return None

    def _warn_once(self, sentence: str) -> None:
        if sentence not in self._warnings:
            self._warnings.add(sentence)
            self._warn(sentence)


def catch_status(brick_state: str, catcher_state: str, decision: str) -> str:
    """Return a one-line description of the current attempt to catch the brick."""
    verdict, _, reason = decision.partition(': ')
    if brick_state == 'riding':
        return f'Caught: {catcher_state}' if catcher_state in ('carrying', 'tilting') else 'Caught'
    texts = {('falling', ''): 'The brick is falling',
             ('falling', 'reachable'): 'Reachable: driving under the brick',
             ('falling', 'unreachable'): f'Unreachable: {reason}',
             ('grounded', 'reachable'): 'Missed: the brick fell to the ground',
             ('grounded', 'unreachable'): f'The unreachable brick fell to the ground: {reason}'}
    return texts.get((brick_state, verdict), 'Waiting for a brick to fall')
