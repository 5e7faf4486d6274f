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
What is on the page: it keeps what the messages say, and draws it.

    what comes ─→ hear_…() ─→ what is known ─→ draw() ─┬─→ scene: the shapes, by name
                                                       └─→ panel: texts and curves

It belongs to no node and knows no server. Instants are in ns: stamps and the instant that is drawn
are ROS time; the page's own clock only goes on.
"""

from collections import deque
from collections.abc import Callable
from math import dist, nan
from typing import Any, TYPE_CHECKING

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.time import Time
from std_msgs.msg import String
from tf2_ros import Buffer, TransformException
from turtle_brick.core.geometry import Pose, Vector
from turtle_brick.core.time_steps import nanoseconds_of, NS_PER_SECOND
from turtle_brick.physics import Phase
from turtle_brick.ros.tf import BASE_LINK, BRICK, MAX_AGE_NS, ODOM, pose_of, WORLD
from turtle_brick.view.account import Account
from turtle_brick.view.shapes import (is_drawable, Markers, ORIGIN, robot_shapes, RobotShapes,
                                      Shape, Thing)
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker, MarkerArray

if TYPE_CHECKING:  # They need viser, without which the viewer has to say what is missing.
    from turtle_brick.view.panel import Panel
    from turtle_brick.view.scene import Scene

WALLS = 'walls'
BRICK_MARKER = 'brick_marker'
CATCHER_MARKER = 'catcher_marker'
"""The topics of markers. All markers on them are drawn."""

BRICK_TF = 'brick (TF)'
COUNTED = ('cmd_vel', 'odom', 'joint_states', BRICK_TF)
"""What is counted, to show its rate."""

FRAMES = (WORLD, ODOM, BASE_LINK, BRICK)
"""The frames that can be shown."""

PHASES = {phase.value: phase for phase in Phase}
"""What the brick does, by the text of its marker."""

PARTS = (BRICK_MARKER, 'odom', CATCHER_MARKER)
"""Topics that arena, robot and catcher publish: without them their parts of the panel are gone."""

UNREACHABLE = 'Unreachable'
"""The text on catcher_marker for a brick that can't be caught."""

GOAL = Shape('cylinder', (0.24, 0.24, 0.01), (0.10, 0.75, 0.25, 1.0))
"""The mark of the robot's goal on the ground."""

GOAL_REACHED = 0.05
"""How near (m) the robot has to be for the mark to vanish."""

PERIOD = NS_PER_SECOND // 10
"""Time (ns) between two updates of texts and curves, over which the robot's speed is measured."""

RATE_TIME = 2 * NS_PER_SECOND
"""Over which time (ns) rates are measured."""

POINTS = 120
"""How many points each curve has."""


class Page:
    """Keep what the messages say, and draw it."""

    def __init__(self, scene: 'Scene', panel: 'Panel', buffer: Buffer,
                 warn: Callable[[str, str], Any], publishers: Callable[[str], int],
                 clock: Callable[[], int]) -> None:
        """
        Begin with nothing known.

        :param scene: where shapes are drawn
        :param panel: where texts and curves are shown
        :param buffer: the transforms
        :param warn: called with a topic and a sentence about a message that can't be shown
        :param publishers: returns how many there are of a topic
        :param clock: returns the present instant
        """
        self._scene = scene
        self._panel = panel
        self._buffer = buffer
        self._warn = warn
        self._publishers = publishers
        self._clock = clock
        self._robot = RobotShapes('', {})
        self._markers = Markers()
        self._account = Account()
        self._goal: tuple[float, float] | None = None
        self._tilt = 0.0
        self._counted: dict[str, deque[int]] = {name: deque(maxlen=1000) for name in COUNTED}
        self._points: deque[tuple[float, ...]] = deque(maxlen=POINTS)
        self._next = 0
        self._fixed_frame = WORLD
        self._instant = 0
        self._poses: dict[str, Pose | None] = {}
        self._things: dict[str, Thing] = {}

    def hear_description(self, message: String) -> None:
        """Hear which robot there is, as URDF."""
        try:
            self._robot = robot_shapes(message.data)
        except ValueError as error:
            self._warn('robot_description', f'The robot is not shown: {error}')

    def hear_transform(self, transform: TransformStamped) -> None:
        """Hear of a moving transform, which is in the buffer already."""
        if transform.child_frame_id == BRICK:
            self.count(BRICK_TF)

    def hear_walls(self, message: MarkerArray) -> None:
        """Hear of the walls."""
        for marker in message.markers:
            self.hear_marker(WALLS, marker)

    def hear_marker(self, topic: str, message: Marker) -> None:
        """Hear a marker of a topic."""
        try:
            self._markers.hear(topic, message, self._clock())
        except ValueError as error:
            self._warn(topic, f'A marker on {topic} is left out: {error}')
            return
        if message.action != Marker.ADD:
            return
        if topic == BRICK_MARKER:
            self._account.see_phase(PHASES.get(message.text))
        elif topic == CATCHER_MARKER and message.text == UNREACHABLE:
            self._account.see_unreachable()

    def hear_state(self, message: String) -> None:
        """Hear what the catcher does."""
        self._account.see_state(message.data)

    def hear_goal(self, message: PoseStamped) -> None:
        """Hear where the robot is sent."""
        point = message.pose.position
        frame = self._pose(message.header.frame_id or WORLD)
        if frame is not None and is_drawable(point.x, point.y, point.z):
            x, y, _ = frame.transform((point.x, point.y, point.z))
            self._goal = (x, y)

    def hear_tilt(self, message: Tilt) -> None:
        """Hear how the platform is to be tilted."""
        if is_drawable(message.angle):
            self._tilt = message.angle

    def count(self, name: str, _: object = None) -> None:
        """Count something that has come."""
        self._counted[name].append(self._clock())

    def draw(self) -> None:
        """Draw the page as it is now."""
        now = self._clock()
        self._fixed_frame = self._find_fixed_frame()
        self._instant = self._latest_instant()
        self._poses.clear()
        self._things = {**self._robot_things(), **self._goal_things(), **self._frame_things(),
                        **self._markers.things(now, self._pose_drawn)}
        self._scene.show(self._things)
        self._scene.keep_in_sight(self._near())
        if now >= self._next:
            self._next = max(self._next + PERIOD, now)
            self._write(now)

    def _robot_things(self) -> dict[str, Thing]:
        return {f'robot/{link}': Thing(shapes, pose)
                for link, shapes in self._robot.links.items()
                if (pose := self._pose_drawn(link)) is not None}

    def _goal_things(self) -> dict[str, Thing]:
        robot = self._pose_drawn(BASE_LINK)
        if self._goal is None or robot is None or dist(
                robot.position[:2], self._goal) < GOAL_REACHED:
            return {}
        return {'goal': Thing((GOAL,), Pose((*self._goal, 0.0), ORIGIN.orientation))}

    def _frame_things(self) -> dict[str, Thing]:
        return {f'frames/{frame}': Thing((), pose, frame) for frame in FRAMES
                if self._panel.frames.value and (pose := self._pose_drawn(frame)) is not None}

    def _near(self) -> list[Vector]:
        """Return points (m) of the robot and the brick, and the point of the ground below it."""
        points = [thing.pose.position for name, thing in self._things.items()
                  if name.startswith('robot/')]
        brick = self._pose_drawn(BRICK)
        if brick is not None:
            x, y, _ = brick.position
            points += [brick.position, (x, y, 0.0)]
        return points

    def _point(self) -> Vector:
        """Return height of the brick (m), its distance (m) to the robot, and its speed (m/s)."""
        brick, robot = self._pose_drawn(BRICK), self._pose_drawn(BASE_LINK)
        before = self._pose(BASE_LINK, max(self._instant - PERIOD, 1))
        height = brick.position[2] if brick is not None else nan
        distance = speed = nan
        if robot is not None and brick is not None:
            distance = dist(brick.position[:2], robot.position[:2])
        if robot is not None and before is not None:
            speed = dist(robot.position, before.position) * NS_PER_SECOND / PERIOD
        return height, distance, speed

    def _write(self, now: int) -> None:
        """Update texts and curves."""
        self._panel.show_parts(*(self._publishers(topic) > 0 for topic in PARTS))
        brick, phase = self._pose_drawn(BRICK), self._account.phase
        if brick is None:
            self._panel.show_brick('no brick in sight')
        else:
            if phase is Phase.HOVERING:
                self._panel.suggest_place(brick.position)
            self._panel.show_brick(
                f'{phase.value if phase else "brick"}, {brick.position[2]:.2f} m up')
        self._panel.show_account(self._account.sentence(), self._account.alarm)
        self._panel.show_tilt(self._tilt)
        self._panel.show_rates([(name, rate([instant for instant in instants
                                             if now - instant <= RATE_TIME]))
                                for name, instants in self._counted.items()])
        self._points.append((now / NS_PER_SECOND, *self._point()))
        self._panel.show_curves(self._points)

    def _find_fixed_frame(self) -> str:
        """Return the frame in which all is drawn: the world, or the root of a robot alone."""
        root = self._robot.root
        alone = root and not any(
            self._buffer.can_transform(WORLD, frame, Time()) for frame in (root, BRICK))
        return root if alone else WORLD

    def _lookup(self, frame: str, stamp: int) -> TransformStamped | None:
        try:
            return self._buffer.lookup_transform(
                self._fixed_frame, frame, Time(nanoseconds=stamp))
        except TransformException:
            return None

    def _pose(self, frame: str, stamp: int = 0) -> Pose | None:
        """Return the pose of a frame at an instant (0 for the latest), None if unknown."""
        if frame == self._fixed_frame:
            return ORIGIN
        transform = self._lookup(frame, stamp)
        return pose_of(transform.transform) if transform is not None else None

    def _pose_drawn(self, frame: str) -> Pose | None:
        """Return the pose of a frame at the instant that is drawn, None if unknown."""
        if frame not in self._poses:
            # What has stopped coming is unknown at this instant: it is where it was last.
            self._poses[frame] = self._pose(frame, self._instant) or self._pose(frame)
        return self._poses[frame]

    def _latest_instant(self) -> int:
        """
        Return the latest instant at which robot and brick are known, 0 if none moves.

        Things that move together, each drawn at its own latest instant, would be drawn apart. What
        has stopped coming is not waited for.
        """
        found = [nanoseconds_of(transform.header.stamp)
                 for frame in {BASE_LINK, BRICK, *self._robot.links}
                 if (transform := self._lookup(frame, 0)) is not None]
        latest = max(found, default=0)
        return min((stamp for stamp in found if stamp > latest - MAX_AGE_NS), default=0)


def rate(instants: list[int]) -> float | None:
    """Return how often (Hz) comes what came at some instants, None if that is unknown."""
    if not instants or instants[-1] == instants[0]:
        return None
    return (len(instants) - 1) * NS_PER_SECOND / (instants[-1] - instants[0])
