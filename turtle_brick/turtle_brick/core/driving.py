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
Drive turtlesim's turtle to a goal at full speed, and stop there, through its slow command path.

turtlesim keeps the last seven commands and takes the oldest of them every 16 ms. Commands at
100 Hz keep this queue full: each is taken 60 to 70 ms after it was published, and some never are.
A controller that steers by the last pose therefore overshoots by 0.07 s of motion and hunts about
the goal. This one mirrors the queue (`CommandQueue`), predicts where the turtle will be when the
next command takes effect, and steers from there (`Driver`): a Smith predictor.

No clock is read here: times are passed in, in seconds of one steady clock.
"""

from collections import deque
from math import cos, hypot, inf, isfinite, log, sin

from turtle_brick.core.turtlesim_kinematics import (ARENA_SIZE, QUEUE_DEPTH, TICK, TurtlePose,
                                                    within_arena)

COMMAND_PERIOD = 0.010
"""Time (s) between two commands: cmd_vel is published at 100 Hz."""

TRANSPORT_DELAY = 0.0004
"""Time (s) that a message takes from one node to another on one machine (0.2 to 0.6 ms)."""

POSE_TIMEOUT = 0.25
"""Age (s) at which the last pose no longer tells where the turtle is."""

APPROACH_FRACTION = 0.5
"""Part of the remaining way that a command covers in its one tick. At 1 the turtle would arrive in
one step, and overshoot by a whole step if a tick took another command than predicted; at 0.5
neighboring commands differ by little, so that it hardly matters which of them a tick takes."""

STOP_DISTANCE = 0.0005
"""Distance (m) from the goal at which the turtle stops."""

START_DISTANCE = 0.003
"""Distance (m) from the goal at which a turtle that has stopped moves again."""


class TickClock:
    """
    Estimate when turtlesim ticks from the arrival of its poses: one pose is one tick.

    Ticks keep to a grid of 16 ms; poses arrive some time after them, never before.
    """

    GAIN = 0.05
    """Part of an arrival's deviation that the grid follows."""

    EARLY = 0.6
    """Part of a tick: a pose that comes earlier than that shows that the grid is late."""

    LATE_POSES = 3
    """Number of poses in a row, each over half a tick late, that show that turtlesim lost time."""

    def __init__(self) -> None:
        """Know nothing before the first pose."""
        self.last = inf
        """When the last tick was (s); infinity before the first pose, which begins the grid."""
        self._late = 0

    def observe(self, now: float) -> float:
        """
        Note a pose that arrives now (s).

        :return: The likely time of its tick (s): its arrival, or the grid's if it was delayed.
        """
        self.last += TICK
        deviation = now - self.last
        if deviation < -self.EARLY * TICK:
            self.last = now
            self._late = 0
        elif deviation > TICK / 2.0:
            self._late += 1
            if self._late >= self.LATE_POSES:
                self._late = 0
                self.last = now
        else:
            self._late = 0
            self.last += self.GAIN * deviation
            return now
        return self.last

    def forget(self) -> None:
        """Begin a new grid with the next pose."""
        self.last = inf
        self._late = 0


class CommandQueue:
    """
    Mirror turtlesim's queue: which commands are on their way, and where they lead.

    It follows from the times at which commands were published, from the ticks that the poses mark,
    and, where these leave a doubt, from the speed that each pose reports: that of the command that
    its tick has taken.
    """

    MEMORY = 64
    """Number of commands remembered, several times those that can be on their way."""

    def __init__(self) -> None:
        """Start with an empty queue and no pose."""
        self.pose: TurtlePose | None = None
        """The last one."""
        self.pose_time = 0.0
        """When it arrived (s)."""
        self._ticks = TickClock()
        self._sent: deque[tuple[float, float, float]] = deque(maxlen=self.MEMORY)
        self._count = 0
        """Number of commands published so far."""
        self._taken = -1
        """Index of the command taken last."""
        self._moving = -1
        """Index of the last command that is not zero."""

    def publish(self, now: float, linear_x: float, linear_y: float) -> None:
        """Note a command that is published now (s): its velocities in the turtle's frame (m/s)."""
        self._sent.append((now, linear_x, linear_y))
        if linear_x or linear_y:
            self._moving = self._count
        self._count += 1

    def observe(self, now: float, pose: TurtlePose) -> None:
        """Note a pose that arrives now (s), and so a tick; ignore it if it is not finite."""
        if not all(map(isfinite, pose)):
            return
        if self.is_stale(now):
            # A turtlesim that was away has taken none of the commands published meanwhile.
            self._ticks.forget()
            self._taken = self._count - 1
        tick = self._ticks.observe(now)
        self.pose = pose
        self.pose_time = now
        expected = self._head(self._taken, self._published_by(tick - 2.0 * TRANSPORT_DELAY))
        expected = self._recognize(expected, pose.linear_velocity)
        self._taken = max(self._taken, min(expected, self._count - 1))

    def is_stale(self, now: float) -> bool:
        """Tell whether there is no pose, or only one that is too old to act on."""
        return self.pose is None or now - self.pose_time > POSE_TIMEOUT

    def predict(self, now: float) -> tuple[float, float]:
        """
        Return where the turtle will be when a command published now (s) takes effect.

        :return: x and y in the world (m), after all ticks that earlier commands will govern
        :raises ValueError: there has been no pose yet
        """
        pose = self.pose
        if pose is None:
            raise ValueError('there has been no pose yet')
        x, y = pose.x, pose.y
        if self._moving < self._taken:
            return x, y  # it obeys zero, and nothing else is on its way
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
            if linear_x or linear_y:
                x, y = within_arena(x + (c * linear_x - s * linear_y) * TICK,
                                    y + (s * linear_x + c * linear_y) * TICK)
        return x, y

    @staticmethod
    def _head(taken: int, latest: int) -> int:
        """Return the command that a tick takes: the oldest in the queue; `taken` if none is."""
        if latest <= taken:
            return taken
        return max(latest - QUEUE_DEPTH + 1, taken + 1)

    def _published_by(self, time: float) -> int:
        """Return the index of the last command that was published by then."""
        index = self._count - 1
        for published, _, _ in reversed(self._sent):
            if published <= time:
                break
            index -= 1
        return index

    def _recognize(self, expected: int, speed: float) -> int:
        """Return the command nearest to the expected one that has the reported speed."""
        first = self._count - len(self._sent)
        lowest, highest = max(self._taken, first), self._count - 1
        for offset in (0, 1, -1, 2, -2, 3, -3):
            index = expected + offset
            if lowest <= index <= highest:
                _, linear_x, linear_y = self._sent[index - first]
                # The pose is a float32: seven digits.
                if abs(hypot(linear_x, linear_y) - speed) <= 1e-6 * (1.0 + speed):
                    return index
        return expected


class Driver:
    """Bring the turtle to a goal, straight and at full speed, and keep it there."""

    def __init__(self, max_velocity: float) -> None:
        """Stand still until there is a goal; never ask for more than max_velocity (m/s)."""
        self.max_velocity = max_velocity
        self.goal: tuple[float, float] | None = None
        """Where to drive, in the world (m)."""
        self.arrived = False
        """Whether the commands on their way stop the turtle at its goal, or have done so."""
        self._path = CommandQueue()

    @property
    def pose(self) -> TurtlePose | None:
        """Last pose of the turtle in the world, None before the first."""
        return self._path.pose

    def drive_to(self, x: float, y: float) -> None:
        """
        Drive to a point of the arena (m) from now on; the one where it stands changes nothing.

        :raises ValueError: the goal is not finite; the present one stays
        """
        if not (isfinite(x) and isfinite(y)):
            raise ValueError(f'the goal ({x:g}, {y:g}) is not finite')
        if self.goal != (x, y):
            self.goal = (x, y)
            self.arrived = False

    def observe(self, now: float, pose: TurtlePose) -> None:
        """Note a pose of the turtle that arrives now (s)."""
        self._path.observe(now, pose)

    def command(self, now: float) -> tuple[float, float]:
        """
        Return the command to publish now (s), and count on it; to be called at 100 Hz.

        :return: linear.x and linear.y (m/s) in the turtle's own frame; zero without a goal, at the
            goal and without a recent pose
        """
        velocity = self._steer(now)
        self._path.publish(now, *velocity)
        return velocity

    def _steer(self, now: float) -> tuple[float, float]:
        """Return the velocity in the turtle's frame (m/s) from where it will be to the goal."""
        pose = self._path.pose
        if self.goal is None or pose is None or self._path.is_stale(now):
            return (0.0, 0.0)
        x, y = self._path.predict(now)
        dx, dy = self.goal[0] - x, self.goal[1] - y
        distance = hypot(dx, dy)
        self.arrived = distance < (START_DISTANCE if self.arrived else STOP_DISTANCE)
        if self.arrived:
            return (0.0, 0.0)
        speed = min(self.max_velocity, APPROACH_FRACTION * distance / TICK)
        ex, ey = speed * dx / distance, speed * dy / distance
        c, s = cos(pose.theta), sin(pose.theta)
        return (c * ex + s * ey, c * ey - s * ex)


def travel_time(distance: float, radius: float, max_velocity: float) -> float:
    """
    Return how long the Driver moves until the goal is within a radius.

    :param distance: from the turtle at rest to the goal (m)
    :param radius: how near is near enough (m)
    :param max_velocity: the turtle's speed (m/s)
    :return: The time (s) from the first motion on: (distance - radius) / max_velocity as long as
        the radius covers the last stretch, where each tick covers a fixed part of the way left.
    """
    if distance <= radius:
        return 0.0
    least = (distance - radius) / max_velocity
    stretch = max_velocity * TICK / APPROACH_FRACTION
    if radius >= stretch:
        return least
    cruise = max(distance - stretch, 0.0) / max_velocity
    approach = TICK * log(min(distance, stretch) / radius) / -log(1.0 - APPROACH_FRACTION)
    return max(least, cruise + approach)
