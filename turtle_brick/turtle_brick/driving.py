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

turtlesim keeps the last seven commands and takes one of them, the oldest, every 16 ms. Commands
that come faster than that, as 100 Hz do, keep this queue full: each is taken 60 to 70 ms after
it was published, and some never are. A controller that steers by the pose it sees therefore
overshoots by 0.07 s of motion and hunts about the goal. This one mirrors the queue
(`CommandPath`), so that it knows where the turtle will be when the command it is about to give
takes effect, and steers from there (`Driver`).

No clock is read here: every method is told the time, in seconds of one steady clock.
"""

from collections import deque
from math import cos
from math import hypot
from math import inf
from math import isfinite
from math import log
from math import sin

from turtle_brick.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.turtlesim_kinematics import Pose
from turtle_brick.turtlesim_kinematics import QUEUE_DEPTH
from turtle_brick.turtlesim_kinematics import TICK

PERIOD = 0.010
"""Time (s) between two commands: cmd_vel is published at 100 Hz."""

TRANSPORT = 0.0004
"""Time (s) that a message takes from one node to another on one machine (0.2 to 0.6 ms)."""

STALE = 0.25
"""Age (s) at which the last pose no longer tells where the turtle is."""

APPROACH = 0.5
"""Part of the remaining way that a command covers in the one tick it is applied for. At 1 the
turtle would arrive in one step, with all of a mistaken tick as its overshoot; at 0.5 neighbouring
commands differ by little, so that it hardly matters which of them a jittering tick has taken."""

ARRIVED = 0.0005
"""Distance (m) from the goal at which the turtle is told to stand."""

DEPARTED = 0.003
"""Distance (m) from the goal from which a standing turtle is told to move again."""


class TickClock:
    """
    Know when turtlesim ticks, from the arrival of its poses: one pose is one tick.

    Ticks keep to a grid of 16 ms; arrivals scatter about it, mostly to the late side.
    """

    GAIN = 0.05
    """Part of an arrival's deviation that the grid follows."""

    EARLY = 0.6
    """Part of a tick by which no pose is early: the grid is late, set by poses held up before."""

    PATIENCE = 3
    """Poses in a row that are late by over half a tick: turtlesim, not their way, lost time."""

    def __init__(self) -> None:
        """Know nothing before the first pose."""
        self.last = inf
        """When the last tick was (s); infinity at first: the first pose begins the grid."""
        self._late = 0

    def observe(self, now: float) -> float:
        """
        Take note of the arrival of a pose.

        :param now: the time of arrival (s)
        :return: The likely time of its tick (s): of its arrival, or the grid's if it was held up.
        """
        self.last += TICK
        deviation = now - self.last
        if deviation < -self.EARLY * TICK:
            self.last = now
            self._late = 0
        elif deviation > TICK / 2.0:
            self._late += 1
            if self._late >= self.PATIENCE:
                self._late = 0
                self.last = now
        else:
            self._late = 0
            self.last += self.GAIN * deviation
            return now
        return self.last

    def forget(self) -> None:
        """Begin anew with the next pose."""
        self.last = inf
        self._late = 0


class CommandPath:
    """
    Mirror turtlesim's queue: which commands are on their way, and where they will lead.

    The queue is known from what is observed alone: the times at which commands were published,
    the ticks that the poses mark, and the speed that each pose reports, which tells the command
    that the tick has taken where the times leave a doubt.
    """

    MEMORY = 64
    """Commands remembered, several times what can be on the way."""

    def __init__(self) -> None:
        """Start with an empty queue and no pose."""
        self.pose: Pose | None = None
        self.pose_time = 0.0
        self._ticks = TickClock()
        self._sent: deque[tuple[float, float, float]] = deque(maxlen=self.MEMORY)
        self._count = 0
        self._taken = -1
        self._last_motion = -1

    def publish(self, now: float, linear_x: float, linear_y: float) -> None:
        """
        Take note of a command that is being published.

        :param now: the present time (s)
        :param linear_x: forward velocity, in the turtle's frame (m/s)
        :param linear_y: leftward velocity, in the turtle's frame (m/s)
        """
        if linear_x != 0.0 or linear_y != 0.0:
            self._last_motion = self._count
        self._sent.append((now, linear_x, linear_y))
        self._count += 1

    def observe(self, now: float, pose: Pose) -> None:
        """
        Take note of a pose, and so of a tick of turtlesim.

        :param now: its time of arrival (s)
        :param pose: the turtle's pose in the world, with the speed it reports (m, rad, m/s); one
            that is not finite is no pose of turtlesim's, and ignored
        """
        if not all(map(isfinite, pose)):
            return
        if self.is_stale(now):
            # A turtlesim that was away has taken nothing of what was published meanwhile.
            self._ticks.forget()
            self._taken = self._count - 1
        tick = self._ticks.observe(now)
        self.pose = pose
        self.pose_time = now
        expected = self._head(self._taken, self._published_by(tick - 2.0 * TRANSPORT))
        if not self._at_rest() or pose.linear_velocity != 0.0:
            expected = self._recognise(expected, pose.linear_velocity)
        self._taken = max(self._taken, min(expected, self._count - 1))

    def is_stale(self, now: float) -> bool:
        """Tell whether there is no pose, or none that is recent enough to act on."""
        return self.pose is None or now - self.pose_time > STALE

    def predict(self, now: float) -> tuple[float, float]:
        """
        Return where the turtle will be when a command published now takes effect.

        :param now: the present time (s)
        :return: x and y in the world (m), after all ticks that earlier commands will govern.
        :raises ValueError: there has been no pose yet
        """
        pose = self.pose
        if pose is None:
            raise ValueError('there has been no pose yet')
        x, y = pose.x, pose.y
        if self._at_rest():
            return x, y
        c, s = cos(pose.theta), sin(pose.theta)
        sent = self._sent
        first = self._count - len(sent)
        taken = self._taken
        linear_x = linear_y = 0.0
        if taken >= first:
            _, linear_x, linear_y = sent[taken - first]
        tick = self._ticks.last - 2.0 * TRANSPORT
        for _ in range(2 * QUEUE_DEPTH):
            tick += TICK
            if tick >= now:
                latest = self._count + int((tick - now) / PERIOD)
            else:
                latest = self._published_by(tick)
            head = self._head(taken, latest)
            if head >= self._count:
                break
            if head > taken:
                taken = head
                _, linear_x, linear_y = sent[max(head - first, 0)]
            x += (c * linear_x - s * linear_y) * TICK
            y += (s * linear_x + c * linear_y) * TICK
            if not (0.0 <= x <= ARENA_SIZE and 0.0 <= y <= ARENA_SIZE):
                x, y = within_arena(x, y)
        return x, y

    def _at_rest(self) -> bool:
        """Tell whether the command in force and all that follow it ask for no motion."""
        return self._last_motion < self._taken or self._last_motion < 0

    @staticmethod
    def _head(taken: int, latest: int) -> int:
        """Return the command that a tick takes: the oldest of those kept; `taken` if none."""
        if latest <= taken:
            return taken
        oldest = latest - QUEUE_DEPTH + 1
        return oldest if oldest > taken else taken + 1

    def _published_by(self, time: float) -> int:
        """Return the index of the last command that was published by then."""
        index = self._count - 1
        for published, _, _ in reversed(self._sent):
            if published <= time:
                break
            index -= 1
        return index

    def _recognise(self, expected: int, speed: float) -> int:
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
        """
        Stand still until there is a goal.

        :param max_velocity: the largest speed that is ever asked for (m/s)
        """
        self.max_velocity = max_velocity
        self.goal: tuple[float, float] | None = None
        self._path = CommandPath()
        self._arrived = False

    @property
    def arrived(self) -> bool:
        """Whether the turtle stands, or is about to, at its goal."""
        return self._arrived

    @property
    def pose(self) -> Pose | None:
        """Last pose of the turtle in the world, None before the first."""
        return self._path.pose

    def drive_to(self, x: float, y: float) -> None:
        """
        Drive to a goal from now on, from wherever the turtle is and whatever it does.

        The goal at which it stands already changes nothing.

        :param x: the goal in the world (m), within the arena
        :param y: the goal in the world (m), within the arena
        :raises ValueError: the goal is not finite; the one before stays
        """
        if not (isfinite(x) and isfinite(y)):
            raise ValueError(f'the goal ({x:g}, {y:g}) is not finite')
        if self.goal != (x, y):
            self.goal = (x, y)
            self._arrived = False

    def observe(self, now: float, pose: Pose) -> None:
        """
        Take note of where turtlesim says that the turtle is.

        :param now: time of arrival of the pose (s, steady clock)
        :param pose: the pose in the world (m, rad)
        """
        self._path.observe(now, pose)

    def command(self, now: float) -> tuple[float, float]:
        """
        Return the command to publish now; it must be published, 100 times per second.

        :param now: the present time (s, steady clock)
        :return: linear.x and linear.y (m/s) in the turtle's own frame; zero without a goal, at the
            goal and while no recent pose tells where the turtle is.
        """
        velocity = self._steer(now)
        self._path.publish(now, *velocity)
        return velocity

    def _steer(self, now: float) -> tuple[float, float]:
        """Return the velocity in the turtle's frame that leads from where it will be."""
        pose = self._path.pose
        if self.goal is None or pose is None or self._path.is_stale(now):
            return (0.0, 0.0)
        x, y = self._path.predict(now)
        dx, dy = self.goal[0] - x, self.goal[1] - y
        distance = hypot(dx, dy)
        self._arrived = distance < (DEPARTED if self._arrived else ARRIVED)
        if self._arrived:
            return (0.0, 0.0)
        speed = min(self.max_velocity, APPROACH * distance / TICK)
        ex, ey = speed * dx / distance, speed * dy / distance
        c, s = cos(pose.theta), sin(pose.theta)
        return (c * ex + s * ey, c * ey - s * ex)


def within_arena(x: float, y: float) -> tuple[float, float]:
    """Return the point of the arena nearest to (x, y), in the world (m)."""
    return min(max(x, 0.0), ARENA_SIZE), min(max(y, 0.0), ARENA_SIZE)


def travel_time(distance: float, radius: float, max_velocity: float) -> float:
    """
    Return how long the Driver moves until the goal is within a radius.

    :param distance: from the turtle at rest to the goal (m)
    :param radius: how near is near enough (m)
    :param max_velocity: the turtle's speed (m/s)
    :return: The time (s) from the first motion on: (distance - radius) / max_velocity as long as
        the radius covers the last stretch, on which each tick of the approach covers a fixed part
        of the way that is left.
    """
    if distance <= radius:
        return 0.0
    least = (distance - radius) / max_velocity
    stretch = max_velocity * TICK / APPROACH
    if radius >= stretch:
        return least
    cruise = max(distance - stretch, 0.0) / max_velocity
    approach = TICK * log(min(distance, stretch) / radius) / -log(1.0 - APPROACH)
    return max(least, cruise + approach)
