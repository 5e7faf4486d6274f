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
Drive the turtle at full speed and stop it at its goal.

turtlesim queues up to seven commands and executes the oldest one every 16 ms. Commands at 100 Hz
keep turtlesim's queue full, so a command first affects a pose 61 to 77 ms after its publication. A
controller that used only the latest pose would overshoot and oscillate.

`Driver` is therefore a Smith predictor (Smith, 1957) with a constant delay. `Driver` predicts the
turtle's position from the latest pose and from all commands that this pose does not reflect yet,
and computes the next command for the predicted position.

All times (s), including those passed by the caller, come from the same monotonic clock.
"""

from collections import deque
from math import atan2, cos, hypot, log, sin

from turtle_brick.core.turtlesim_arena import nearest_in_arena, TurtlePose

COMMAND_PERIOD = 0.010
"""Interval (s) between commands on cmd_vel."""

COMMAND_DELAY = 0.069
"""Median time (s) from the publication of a command to the first pose that shows its effect."""

POSE_TIMEOUT = 0.25
"""Maximum age (s) of a pose used for driving."""

BRAKING_TIME = 0.064
"""Time constant (s) of the final approach (distance to the goal divided by speed). A shorter
time constant would cause overshoot because the command delay varies by up to 16 ms."""

STOP_DISTANCE = 0.0005
"""Distance (m) from the goal at which the turtle stops."""

START_DISTANCE = 0.003
"""Distance (m) from the goal at which a stopped turtle starts moving again."""

HIDDEN_COMMANDS = round((POSE_TIMEOUT + COMMAND_DELAY) / COMMAND_PERIOD)
"""Maximum number of commands that the latest usable pose does not show yet."""


class Driver:
    """Drive the turtle straight to its goal at full speed and keep it at the goal."""

    def __init__(self, max_velocity: float) -> None:
        """Create a driver with a given speed limit (m/s) and no goal."""
        self.max_velocity = max_velocity
        self.goal: tuple[float, float] | None = None
        """Goal (m) of the turtle in the world frame."""
        self.arrived = False
        """Whether the turtle will be at its goal after executing all published commands."""
        self.stem_angle = 0.0
        """Direction (rad) of the last nonzero command in the turtle's frame."""
        self.pose: TurtlePose | None = None
        """Latest pose of the turtle in the world frame."""
        self.pose_time = 0.0
        """Time (s) at which this pose was received."""
        self._sent: deque[tuple[float, float, float]] = deque(maxlen=HIDDEN_COMMANDS)
        """Times (s) and velocities (m/s, in the turtle's frame) of the latest commands."""

    def drive_to(self, x: float, y: float) -> None:
        """Set the goal (m) of the turtle in the world frame."""
        if self.goal != (x, y):
            self.goal = (x, y)
            self.arrived = False

    def observe(self, now: float, pose: TurtlePose) -> None:
        """Record a turtle pose received at `now` (s)."""
        self.pose, self.pose_time = pose, now

    def command(self, now: float) -> tuple[float, float]:
        """
        Return and record the velocity (m/s, in the turtle's frame) to publish at `now` (s).

        Call this method at 100 Hz. The velocity is zero if the turtle is at its goal or has no
        goal, or if no pose has been observed for POSE_TIMEOUT seconds.
        """
        velocity = (0.0, 0.0)
        if self.goal and self.pose and now - self.pose_time <= POSE_TIMEOUT:
            velocity = self._approach(self.goal, self.pose)
        self._sent.append((now, *velocity))
        return velocity

    def _approach(self, goal: tuple[float, float], pose: TurtlePose) -> tuple[float, float]:
        x, y = self.predict(pose)
        dx, dy = goal[0] - x, goal[1] - y
        distance = hypot(dx, dy)
        self.arrived = distance < (START_DISTANCE if self.arrived else STOP_DISTANCE)
        if self.arrived:
            return (0.0, 0.0)
        speed = min(self.max_velocity, distance / BRAKING_TIME)
        angle = atan2(dy, dx) - pose.theta
        self.stem_angle = atan2(sin(angle), cos(angle))
        return (speed * cos(angle), speed * sin(angle))

    def predict(self, pose: TurtlePose) -> tuple[float, float]:
        """Return the position (m) of the turtle after all commands that `pose` does not show."""
        hidden = [(linear_x, linear_y) for time, linear_x, linear_y in self._sent
                  if time > self.pose_time - COMMAND_DELAY]
        forward = sum(linear_x for linear_x, _ in hidden) * COMMAND_PERIOD
        left = sum(linear_y for _, linear_y in hidden) * COMMAND_PERIOD
        c, s = cos(pose.theta), sin(pose.theta)
        return nearest_in_arena(pose.x + c * forward - s * left, pose.y + s * forward + c * left)


def braking_loss(radius: float, max_velocity: float) -> float:
    """
    Return the time (s) that braking adds to a drive that ends within `radius` (m) of the goal.

    Braking begins at b = max_velocity * BRAKING_TIME from the goal, usually within `radius`. From
    there, the distance decays as b * exp(-t / BRAKING_TIME), so it takes BRAKING_TIME * log(b /
    radius) instead of (b - radius) / max_velocity to come within `radius` of the goal.
    """
    braking_distance = max_velocity * BRAKING_TIME
    if radius >= braking_distance:
        return 0.0
    return (BRAKING_TIME * log(braking_distance / radius)
            - (braking_distance - radius) / max_velocity)
