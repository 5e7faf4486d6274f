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
The kinematics of turtlesim, tick for tick and bit for bit, without ROS.

What turtlesim 1.8 does every 16 ms, in its order (TurtleFrame::onUpdate, Turtle::update): each
turtle takes at most one velocity command from its queue of seven, carries out the teleports that
are waiting, stops if the last command is more than a second old, turns, moves along the new
heading, is clamped to the arena, and publishes its pose. The time step is always 0.016 s, however
late a tick is.

Positions are kept as turtlesim keeps them: x to the right and y downward from the upper left
corner, in double precision. Arguments and results have y upward and, as in turtlesim's messages,
the precision of float32.
"""

from collections import deque
import math
import struct
from typing import NamedTuple

_FLOAT = struct.Struct('f')
_FLOATS = struct.Struct('5f')


def float32(value: float) -> float:
    """Return the nearest float32, as a message's field keeps it; infinity beyond its range."""
    try:
        return _FLOAT.unpack(_FLOAT.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


TICK = 0.001 * 16
"""Time step of a tick and period of the ticks (s)."""

QUEUE_DEPTH = 7
"""Number of unread velocity commands that a turtle keeps, turtlesim's QoS KeepLast(7)."""

COMMAND_TIMEOUT = 1.0
"""Time (s) for which a turtle follows its last velocity command."""

ARENA_SIZE = float32(499 / 45)
"""Width and height of the arena (m): 499 pixels of 1/45 m, in single precision."""

ARENA_CENTER = float32(ARENA_SIZE / 2)
"""x and y of the arena's center (m), where the first turtle starts."""

_PI = 3.14159265
"""turtlesim's own pi, shorter than math.pi: the last bits of every heading depend on it."""

_TWO_PI = 2.0 * _PI


def within_arena(x: float, y: float) -> tuple[float, float]:
    """Return the point of the arena nearest to (x, y), in the world (m)."""
    return (0.0 if x < 0.0 else ARENA_SIZE if x > ARENA_SIZE else x,
            0.0 if y < 0.0 else ARENA_SIZE if y > ARENA_SIZE else y)


class TurtlePose(NamedTuple):
    """What turtlesim publishes about a turtle; every number is a float32."""

    x: float
    """Distance from the left wall (m)."""
    y: float
    """Distance from the lower wall (m)."""
    theta: float
    """Heading (rad), counter-clockwise from +x, in [-pi, pi)."""
    linear_velocity: float
    """Commanded speed (m/s), never negative, also when driving backward."""
    angular_velocity: float
    """Commanded turn rate (rad/s), counter-clockwise."""


def _normalize(angle: float) -> float:
    """Bring an angle (rad) into [-pi, pi) with turtlesim's pi; NaN if it is not finite."""
    try:
        return angle - _TWO_PI * math.floor((angle + _PI) / _TWO_PI)
    except (OverflowError, ValueError):
        return math.nan


class Turtle:
    """One turtle of turtlesim."""

    def __init__(self, x: float = ARENA_CENTER, y: float = ARENA_CENTER, theta: float = 0.0,
                 holonomic: bool = False, now: float = 0.0) -> None:
        """
        Put a turtle at rest into the arena.

        :param x: distance from the left wall (m); outside the arena, the first tick clamps it
        :param y: distance from the lower wall (m); likewise
        :param theta: heading (rad)
        :param holonomic: whether velocity commands may have a sideways part
        :param now: the time (s), on the clock that tick() is given
        """
        self._x = float32(x)
        self._y_down = float32(ARENA_SIZE - float32(y))
        self._theta = float32(theta)
        self._linear_x = 0.0
        self._linear_y = 0.0
        self._angular = 0.0
        self._commanded_at = now
        self._queue: deque[tuple[float, float, float]] = deque(maxlen=QUEUE_DEPTH)
        self._teleports: list[tuple[bool, float, float, float]] = []
        self.holonomic = holonomic
        """Whether velocity commands may have a sideways part; otherwise it is left as it was."""
        self.clamped: tuple[float, float] | None = None
        """Where the turtle would be without the wall that stopped it in the last tick: x and y
        downward (m); None if no wall did."""
        self.pose = self._rounded_pose()
        """The pose after the last tick, or the initial one."""

    def command(self, linear_x: float, linear_y: float, angular_z: float) -> None:
        """
        Append velocities (m/s, rad/s) to the queue of commands; a full one loses its oldest.

        Its sideways part, to the left, is ignored unless the turtle is holonomic when it takes it.
        """
        self._queue.append((linear_x, linear_y, angular_z))

    def teleport_absolute(self, x: float, y: float, theta: float) -> None:
        """
        Ask for a jump to a pose, which the next tick makes; the velocity stays.

        :param x: distance from the left wall (m)
        :param y: distance from the lower wall (m); beyond the upper wall it counts as at it
        :param theta: heading (rad)
        """
        self._teleports.append((False, float32(x), float32(y), float32(theta)))

    def teleport_relative(self, linear: float, angular: float) -> None:
        """
        Ask for a turn and then a jump along the new heading, which the next tick makes.

        :param linear: distance (m)
        :param angular: turn (rad), counter-clockwise
        """
        self._teleports.append((True, float32(linear), 0.0, float32(angular)))

    def take_command(self, now: float) -> None:
        """Take the oldest command of the queue, if there is one: the first half of a tick."""
        if self._queue:
            self._linear_x, linear_y, self._angular = self._queue.popleft()
            if self.holonomic:
                self._linear_y = linear_y
            self._commanded_at = now

    def update(self, now: float) -> TurtlePose:
        """
        Move by one time step: the second half of a tick.

        :param now: the time (s); only the age of the last command depends on it
        :return: the new pose
        """
        if self._teleports:
            self._teleport()
        if now - self._commanded_at > COMMAND_TIMEOUT:
            self._linear_x = self._linear_y = self._angular = 0.0
        linear_x = self._linear_x
        linear_y = self._linear_y
        angular = self._angular

        # Turning first, then moving along the new heading, is what turtlesim does.
        theta = _normalize(self._theta + angular * TICK)
        cos = math.cos(theta)
        sin = math.sin(theta)
        x = self._x + (cos * linear_x * TICK - sin * linear_y * TICK)
        y_down = self._y_down - (cos * linear_y * TICK + sin * linear_x * TICK)

        # A NaN passes, as it does in turtlesim.
        if x < 0.0 or x > ARENA_SIZE or y_down < 0.0 or y_down > ARENA_SIZE:
            self.clamped = (x, y_down)
            x = 0.0 if x < 0.0 else ARENA_SIZE if x > ARENA_SIZE else x
            y_down = 0.0 if y_down < 0.0 else ARENA_SIZE if y_down > ARENA_SIZE else y_down
        else:
            self.clamped = None
        self._x = x
        self._y_down = y_down
        self._theta = theta
        self.pose = self._rounded_pose()
        return self.pose

    def tick(self, now: float) -> TurtlePose:
        """Do what a tick of turtlesim does to a turtle; return the pose that it publishes."""
        self.take_command(now)
        return self.update(now)

    def _teleport(self) -> None:
        """Carry out the teleports that are waiting, in order."""
        for relative, x_or_linear, y, theta in self._teleports:
            if relative:
                self._theta += theta
                # Only a finite angle has a cosine in Python, every one has in C++.
                heading = self._theta if math.isfinite(self._theta) else math.nan
                self._x += math.cos(heading) * x_or_linear
                self._y_down += -math.sin(heading) * x_or_linear
            else:
                self._x = x_or_linear
                self._y_down = max(0.0, ARENA_SIZE - y)
                self._theta = theta
        self._teleports.clear()

    def _rounded_pose(self) -> TurtlePose:
        """Return where the turtle is, rounded to what a message can carry."""
        speed = math.sqrt(self._linear_x * self._linear_x + self._linear_y * self._linear_y)
        numbers = (self._x, ARENA_SIZE - self._y_down, self._theta, speed, self._angular)
        try:
            # At once, which takes half the time of each by itself.
            return TurtlePose._make(_FLOATS.unpack(_FLOATS.pack(*numbers)))
        except OverflowError:
            return TurtlePose._make(map(float32, numbers))


class TurtleSim:
    """All turtles of one turtlesim, by name; a new one holds turtle1 in the arena's center."""

    def __init__(self, holonomic: bool = False, now: float = 0.0) -> None:
        """Start a simulator at a time (s) of the clock that tick() is given."""
        self.turtles: dict[str, Turtle] = {}
        """The turtles by name, in the order in which a tick updates them."""
        self._holonomic = holonomic
        self._names = 0
        self._started = False
        self.reset(now)

    @property
    def holonomic(self) -> bool:
        """Whether velocity commands may have a sideways part, for all turtles."""
        return self._holonomic

    @holonomic.setter
    def holonomic(self, holonomic: bool) -> None:
        self._holonomic = holonomic
        for turtle in self.turtles.values():
            turtle.holonomic = holonomic

    def spawn(self, x: float, y: float, theta: float, name: str = '', now: float = 0.0) -> str:
        """
        Add a turtle.

        :param name: its name; if empty, the next free one of turtle1, turtle2, and so on
        :return: the turtle's name, or an empty string if the name was taken
        """
        if name in self.turtles:
            return ''
        while not name:
            self._names += 1
            candidate = f'turtle{self._names}'
            name = '' if candidate in self.turtles else candidate
        self.turtles[name] = Turtle(x, y, theta, self._holonomic, now)
        self.turtles = dict(sorted(self.turtles.items()))
        return name

    def kill(self, name: str) -> bool:
        """Remove a turtle; tell whether there was one of that name."""
        return self.turtles.pop(name, None) is not None

    def reset(self, now: float = 0.0) -> None:
        """Remove all turtles and start again with turtle1 in the center, at rest."""
        self.turtles = {}
        self._names = 0
        self.spawn(ARENA_CENTER, ARENA_CENTER, 0.0, now=now)

    def tick(self, now: float) -> dict[str, TurtlePose]:
        """
        Do what one 16 ms tick of turtlesim does.

        :return: The pose of each turtle. The very first tick takes commands, but nothing moves
            and there are no poses: it only starts turtlesim's clock.
        """
        if not self._started:
            self._started = True
            for turtle in self.turtles.values():
                turtle.take_command(now)
            return {}
        return {name: turtle.tick(now) for name, turtle in self.turtles.items()}
