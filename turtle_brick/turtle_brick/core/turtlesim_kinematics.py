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
Kinematics of turtlesim 1.8 without ROS. The results are bitwise identical to those of turtlesim.

The tests, simulations and turtlesim's stand-in use this module; the nodes use turtlesim itself.
Every 16 ms, each turtle executes these steps (TurtleFrame::onUpdate, Turtle::update):

1. Take one velocity command from a queue of up to seven commands.
2. Stop if the last command is more than one second old.
3. Turn, move along the new heading, and stay inside the arena.
4. Publish the pose.

The time step is always 0.016 s, even if a tick is late.

Internal positions have double precision, and y points down from the upper left corner. Poses in
arguments and results have float32 precision, and y points up, as in turtlesim's messages.
"""

from collections import deque
import math

from .turtlesim_arena import ARENA_CENTER, ARENA_SIZE, float32, nearest_in_arena, TICK, TurtlePose

QUEUE_DEPTH = 7
"""Capacity of the velocity command queue (QoS KeepLast(7))."""

COMMAND_TIMEOUT = 1.0
"""Time (s) without a velocity command after which a turtle stops."""

_PI = 3.14159265
"""Value of pi in turtlesim. Headings computed with math.pi would differ from turtlesim's."""

_TWO_PI = 2.0 * _PI


def normalize(angle: float) -> float:
    """Return an angle (rad) reduced to [-pi, pi), or NaN if the angle is not finite."""
    try:
        return angle - _TWO_PI * math.floor((angle + _PI) / _TWO_PI)
    except (OverflowError, ValueError):
        return math.nan


class Turtle:
    """A turtle in turtlesim."""

    def __init__(self, x: float = ARENA_CENTER, y: float = ARENA_CENTER, theta: float = 0.0,
                 holonomic: bool = False, now: float = 0.0) -> None:
        """Create a turtle at rest at a given pose (m, rad) and time (s)."""
        self._x = float32(x)
        self._y_down = float32(ARENA_SIZE - float32(y))
        self._theta = float32(theta)
        self._linear_x = 0.0
        self._linear_y = 0.0
        self._angular = 0.0
        self._commanded_at = now
        self._queue: deque[tuple[float, float, float]] = deque(maxlen=QUEUE_DEPTH)
        self.holonomic = holonomic
        """Whether the turtle executes the sideways component of velocity commands."""
        self.pose = self._rounded_pose()
        """Pose after the last tick."""

    def command(self, linear_x: float, linear_y: float, angular_z: float) -> None:
        """Queue velocities (m/s, rad/s) as one command. A full queue discards its oldest entry."""
        self._queue.append((linear_x, linear_y, angular_z))

    def take_command(self, now: float) -> None:
        """Execute the first half of a tick, which takes the oldest command from the queue."""
        if self._queue:
            self._linear_x, linear_y, self._angular = self._queue.popleft()
            if self.holonomic:
                self._linear_y = linear_y
            self._commanded_at = now

    def update(self, now: float) -> TurtlePose:
        """Execute the second half of a tick, which moves the turtle, and return the new pose."""
        if now - self._commanded_at > COMMAND_TIMEOUT:
            self._linear_x = self._linear_y = self._angular = 0.0
        linear_x, linear_y = self._linear_x, self._linear_y
        theta = normalize(self._theta + self._angular * TICK)
        cos = math.cos(theta)
        sin = math.sin(theta)
        x = self._x + (cos * linear_x * TICK - sin * linear_y * TICK)
        y_down = self._y_down - (cos * linear_y * TICK + sin * linear_x * TICK)
        self._x, self._y_down = self.clamp(x, y_down)
        self._theta = theta
        self.pose = self._rounded_pose()
        return self.pose

    def clamp(self, x: float, y_down: float) -> tuple[float, float]:
        """Stop the turtle at a wall. Like in turtlesim, coordinates may be NaN."""
        return nearest_in_arena(x, y_down)

    def tick(self, now: float) -> TurtlePose:
        """Execute one tick and return the pose to publish."""
        self.take_command(now)
        return self.update(now)

    def _rounded_pose(self) -> TurtlePose:
        speed = math.sqrt(self._linear_x * self._linear_x + self._linear_y * self._linear_y)
        numbers = (self._x, ARENA_SIZE - self._y_down, self._theta, speed, self._angular)
        return TurtlePose(*map(float32, numbers))
