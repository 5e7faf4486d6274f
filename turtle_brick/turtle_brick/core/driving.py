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

turtlesim queues up to seven commands and takes the oldest command every 16 ms. Commands at 100 Hz
keep this queue full, so a command takes effect 60 to 70 ms after its publication or is discarded.
A controller that used the latest pose would overshoot and oscillate. This module therefore uses a
Smith predictor. `CommandQueue` models the queue and predicts the position at which the next
command takes effect. `Driver` computes the command for the predicted position.

All times (s) come from one monotonic clock. The caller passes the current time.
"""

from collections import deque
from math import cos, hypot, inf, isfinite, log, sin

from turtle_brick.core.turtlesim_kinematics import QUEUE_DEPTH, TICK, TurtlePose, within_arena

COMMAND_PERIOD = 0.010
"""Interval (s) between commands on cmd_vel."""

TRANSPORT_DELAY = 0.0004
"""Delay (s) of a message between two nodes on one machine. Measured: 0.2 to 0.6 ms."""

POSE_TIMEOUT = 0.25
"""Maximum age (s) of a pose used for driving."""

APPROACH_FRACTION = 0.5
"""Fraction of the remaining distance that the turtle covers per tick near its goal. A fraction of
1 would cause an overshoot whenever turtlesim takes a command other than the predicted one."""

STOP_DISTANCE = 0.0005
"""Distance (m) from the goal at which the turtle stops."""

START_DISTANCE = 0.003
"""Distance (m) from the goal at which a stopped turtle starts again."""


class TickClock:
    """
    Estimate the times of turtlesim's ticks from the arrival times of the poses.

    The ticks are 16 ms apart. The pose published by a tick arrives shortly after the tick.
    """

    GAIN = 0.05
    """Fraction of a measured deviation by which the estimated tick times are corrected."""

    EARLY = 0.6
    """Fraction of a tick by which a pose must be early to restart the estimation."""

    LATE_POSES = 3
    """Number of successive poses that restart the estimation if each is over half a tick late."""

    def __init__(self) -> None:
        self.last = inf
        """Estimated time (s) of the last tick, or infinity before the first pose."""
        self._late = 0

    def observe(self, now: float) -> float:
        """Record a pose received at `now` (s), and return the estimated tick time (s)."""
        self.last += TICK
        deviation = now - self.last
        self._late = self._late + 1 if deviation > TICK / 2.0 else 0
        if deviation < -self.EARLY * TICK or self._late == self.LATE_POSES:
            self.last = now
            self._late = 0
        elif self._late == 0:
            self.last += self.GAIN * deviation
            return now
        return self.last


class CommandQueue:
    """
    Model turtlesim's command queue to predict the position at which a new command takes effect.

    The model uses the publication times of the commands and the estimated tick times. The speed in
    a pose identifies the command that turtlesim executed before it published the pose.
    """

    MEMORY = 64
    """Maximum number of recorded commands, several times the length of turtlesim's queue."""

    def __init__(self) -> None:
        self.pose: TurtlePose | None = None
        self.pose_time = 0.0
        """Arrival time (s) of the latest pose."""
        self._ticks = TickClock()
        self._sent: deque[tuple[float, float, float]] = deque(maxlen=self.MEMORY)
        self._count = 0
        """Number of published commands."""
        self._taken = -1
        """Index of the last command that turtlesim took from its queue."""
        self._moving = -1
        """Index of the last nonzero command."""

    def publish(self, now: float, linear_x: float, linear_y: float) -> None:
        """Record a command (m/s, in the turtle's frame) published at `now` (s)."""
        self._sent.append((now, linear_x, linear_y))
        if linear_x or linear_y:
            self._moving = self._count
        self._count += 1

    def observe(self, now: float, pose: TurtlePose) -> None:
        """Record a pose received at `now` (s). Ignore poses that contain NaN or infinity."""
        if not all(map(isfinite, pose)):
            return
        if self.is_stale(now):
            # After a long gap between poses, turtlesim's queue is empty.
            self._ticks = TickClock()
            self._taken = self._count - 1
        tick = self._ticks.observe(now)
        self.pose = pose
        self.pose_time = now
        expected = self._head(self._taken, self._published_by(tick - 2.0 * TRANSPORT_DELAY))
        expected = self._recognize(expected, pose.linear_velocity)
        self._taken = max(self._taken, min(expected, self._count - 1))

    def is_stale(self, now: float) -> bool:
        """Return whether there is no pose or the latest pose is older than POSE_TIMEOUT."""
        return self.pose is None or now - self.pose_time > POSE_TIMEOUT

    def predict(self, now: float) -> tuple[float, float]:
        """Predict the position (m) at which a command published at `now` (s) takes effect."""
        pose = self.pose
        if pose is None:
            raise ValueError('no pose has been received')
        x, y = pose.x, pose.y
        if self._moving < self._taken:
            return x, y  # Only zero commands remain.
        c, s = cos(pose.theta), sin(pose.theta)
        sent = self._sent
        first = self._count - len(sent)
        taken = self._taken
        linear_x = linear_y = 0.0
        if taken >= first:
            _, linear_x, linear_y = sent[taken - first]
        tick = self._ticks.last - 2.0 * TRANSPORT_DELAY
        for _ in range(2 * QUEUE_DEPTH):
            tick += TICK
            if tick >= now:
                latest = self._count + int((tick - now) / COMMAND_PERIOD)
            else:
                latest = self._published_by(tick)
            if latest > taken:
                taken = self._head(taken, latest)
                if taken >= self._count:
                    break
                _, linear_x, linear_y = sent[max(taken - first, 0)]
            x, y = within_arena(x + (c * linear_x - s * linear_y) * TICK,
                                y + (s * linear_x + c * linear_y) * TICK)
        return x, y

    @staticmethod
    def _head(taken: int, latest: int) -> int:
        """Return the index of the oldest queued command, or `taken` if the queue is empty."""
        if latest <= taken:
            return taken
        return max(latest - QUEUE_DEPTH + 1, taken + 1)

    def _published_by(self, time: float) -> int:
        """Return the index of the last command published no later than a given time (s)."""
        index = self._count - 1
        for published, _, _ in reversed(self._sent):
            if published <= time:
                break
            index -= 1
        return index

    def _recognize(self, expected: int, speed: float) -> int:
        """Return the index closest to `expected` among sent commands with a given speed (m/s)."""
        first = self._count - len(self._sent)
        lowest, highest = max(self._taken, first), self._count - 1
        for offset in (0, 1, -1, 2, -2, 3, -3):
            index = expected + offset
            if lowest <= index <= highest:
                _, linear_x, linear_y = self._sent[index - first]
                # The reported speed is a float32, which has about seven digits.
                if abs(hypot(linear_x, linear_y) - speed) <= 1e-6 * (1.0 + speed):
                    return index
        return expected


class Driver:
    """Drive the turtle straight to its goal at full speed and keep it at the goal."""

    def __init__(self, max_velocity: float) -> None:
        """Create a driver with a given speed limit (m/s) and no goal."""
        self.max_velocity = max_velocity
        self.goal: tuple[float, float] | None = None
        """Goal (m) in the world frame."""
        self.arrived = False
        """Whether the published commands stop the turtle at its goal."""
        self.predicts = True
        """Whether the driver uses the predicted position. If not, the turtle overshoots."""
        self._queue = CommandQueue()

    @property
    def pose(self) -> TurtlePose | None:
        """Get the latest pose of the turtle in the world frame, or None before the first pose."""
        return self._queue.pose

    def drive_to(self, x: float, y: float) -> None:
        """Set a goal (m) in the world frame, or raise ValueError if the goal is not finite."""
        if not (isfinite(x) and isfinite(y)):
            raise ValueError(f'the goal ({x:g}, {y:g}) is not finite')
        if self.goal != (x, y):
            self.goal = (x, y)
            self.arrived = False

    def observe(self, now: float, pose: TurtlePose) -> None:
        """Record a turtle pose received at `now` (s)."""
        self._queue.observe(now, pose)

    def command(self, now: float) -> tuple[float, float]:
        """
        Return and record the velocity (m/s, in the turtle's frame) to publish at `now` (s).

        Call this method at 100 Hz. The velocity is zero if the turtle is at its goal, has no goal,
        or has no recent pose.
        """
        velocity = self._steer(now)
        self._queue.publish(now, *velocity)
        return velocity

    def _steer(self, now: float) -> tuple[float, float]:
        pose = self._queue.pose
        if self.goal is None or pose is None or self._queue.is_stale(now):
            return (0.0, 0.0)
        x, y = self._queue.predict(now)
        if not self.predicts:
            x, y = pose.x, pose.y
        dx, dy = self.goal[0] - x, self.goal[1] - y
        distance = hypot(dx, dy)
        self.arrived = distance < (START_DISTANCE if self.arrived else STOP_DISTANCE)
        if self.arrived:
            return (0.0, 0.0)
        speed = min(self.max_velocity, APPROACH_FRACTION * distance / TICK)
        world_x, world_y = speed * dx / distance, speed * dy / distance
        c, s = cos(pose.theta), sin(pose.theta)
        return (c * world_x + s * world_y, c * world_y - s * world_x)


def travel_time(distance: float, radius: float, max_velocity: float) -> float:
    """
    Return the time (s) from the first motion until the turtle is within `radius` (m) of its goal.

    The time is (distance - radius) / max_velocity if the turtle slows down only within the radius.
    """
    if distance <= radius:
        return 0.0
    shortest = (distance - radius) / max_velocity
    approach_distance = max_velocity * TICK / APPROACH_FRACTION
    if radius >= approach_distance:
        return shortest
    cruise = max(distance - approach_distance, 0.0) / max_velocity
    approach = (TICK * log(min(distance, approach_distance) / radius)
                / -log(1.0 - APPROACH_FRACTION))
    return max(shortest, cruise + approach)
