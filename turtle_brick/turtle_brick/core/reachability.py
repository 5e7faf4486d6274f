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
Decide whether the robot can be under a falling brick in time.

A brick is reachable if it lands inside the arena and an available robot can be there in time. The
required time must not exceed the time until landing. For a level platform, the required time is

    0                                                          if distance <= platform_radius
    latency + (distance - platform_radius) / max_velocity      otherwise

- The brick falls straight down without drag. It lands when its bottom reaches the top of the level
  platform. A brick is unreachable if its bottom is already below the platform's top.
- A brick lands on the platform if its center is within platform_radius of the platform axis. The
  robot therefore does not have to drive the whole distance.
- The distance is the horizontal distance from the robot to the landing point. A moving robot first
  executes the commands already sent, so the largest possible distance counts.
- The latency is COMMAND_LATENCY plus the excess latency. COMMAND_LATENCY applies to nodes on one
  machine. The `latency` module estimates the excess latency due to slow links and busy machines.
- A brick cannot land on a tilted platform. Leveling takes LEVEL_LATENCY plus the excess latency.
  Therefore, the required time is at least the leveling time if the platform is not level.
- If late transforms put the computed landing in the past, the time until the landing is 0.

`robot_tracking` computes the motion of the robot. All timestamps (ns) come from one clock.
"""

from math import hypot, inf, isnan, sqrt
from typing import NamedTuple

from turtle_brick.core.driving import COMMAND_PERIOD, TRANSPORT_DELAY, travel_time
from turtle_brick.core.fall_detection import Fall
from turtle_brick.core.parameters import CatcherParameters
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import QUEUE_DEPTH, TICK, within_arena

QUEUE_LATENCY = (QUEUE_DEPTH - 1) * COMMAND_PERIOD + TICK + TRANSPORT_DELAY
"""Maximum time (0.0764 s) from a command to the first pose that shows its effect. A command
takes effect at the first turtlesim tick after six newer commands have arrived."""

COMMAND_LATENCY = 3 * TRANSPORT_DELAY + COMMAND_PERIOD + QUEUE_LATENCY + COMMAND_PERIOD + 0.010
"""Maximum time (0.108 s) from a decision until the arena receives a pose of the moving robot. The
time includes three message transports (goal, pose, transform), two robot cycles and turtlesim's
queue. A 10 ms margin covers operating system delays and the wait for the next physics step."""

GUARANTEED_LATENCY = 0.13
"""Guaranteed upper limit (s) for the time from the release of a brick to the robot's first motion.
The limit covers COMMAND_LATENCY and the time needed to observe three positions of the brick."""

LEVEL_LATENCY = 3 * TRANSPORT_DELAY + COMMAND_PERIOD + 0.015
"""Maximum time (s) from a tilt command of 0 until the arena receives a level platform pose."""


class Decision(NamedTuple):
    """Result of `decide_reachability`."""

    reachable: bool
    fall: Fall
    contact: int
    """Time (ns) at which the bottom of the brick reaches the top of the platform."""
    available: float
    """Time (s) from the decision to the contact."""
    needed: float
    """Time (s) from the decision until the platform can be under the brick."""
    latency: float
    """Assumed latency (s) of the command path."""
    distance: float
    """Current horizontal distance (m) from the robot to the brick."""
    reason: str
    """Reason why the brick is unreachable, or an empty string if it is reachable."""

    @property
    def margin(self) -> float:
        """Difference (s) between the available time and the required time."""
        return self.available - self.needed

    @property
    def summary(self) -> str:
        """One-line summary of the decision, such as "unreachable: no robot is available"."""
        if not self.reachable:
            return f'unreachable: {self.reason}'
        return (f'reachable: the robot, {self.distance:.2f} m away, needs {self.needed:.3f} s, '
                f'and the brick lands in {self.available:.3f} s (command latency '
                f'{self.latency:.2f} s)')


class RobotMotion(NamedTuple):
    """Current position and possible future positions of the robot."""

    x: float
    """x coordinate (m) of the robot in the world frame."""
    y: float
    destinations: tuple[tuple[float, float], ...] = ()
    """Points (m) that the robot may reach with the commands already sent."""
    level: bool = True
    """Whether the platform is level and the arena has received its level pose."""
    uncertainty: float = 0.0
    """Distance (m) that the robot may cover in an unknown direction."""

    @property
    def at_rest(self) -> bool:
        """Whether the robot is at rest and will remain at rest until it receives a new command."""
        return not self.destinations and self.uncertainty == 0.0

    def distance_to(self, point: tuple[float, ...]) -> float:
        """Return the horizontal distance (m) from the robot to a point in the world frame."""
        return hypot(point[0] - self.x, point[1] - self.y)

    def longest_distance_to(self, point: tuple[float, ...]) -> float:
        """Return the maximum distance (m) from the robot's possible positions to a point."""
        distances = [hypot(point[0] - x, point[1] - y) for x, y in self.destinations]
        return max([self.distance_to(point), *distances]) + self.uncertainty


def resting_height(parameters: CatcherParameters) -> float:
    """Return the height (m) of the center of a brick that rests on the level platform."""
    return parameters.platform_height + parameters.brick_size[2] / 2.0


def fall_time(height: float, parameters: CatcherParameters) -> float:
    """Return the duration (s) of a free fall from a release height (m) to the level platform."""
    depth = max(height - resting_height(parameters), 0.0)
    return sqrt(2.0 * depth / parameters.gravity_accel)


def guaranteed_distance(height: float, parameters: CatcherParameters,
                        excess: float = 0.0) -> float:
    """
    Return the largest distance (m) at which a robot at rest is guaranteed to catch a brick.

    The distance is negative if no catch is guaranteed. `height` (m) is the height of the brick's
    center at the release, and `excess` (s) is the excess latency.
    """
    if height < resting_height(parameters):
        return -inf
    time = fall_time(height, parameters) - GUARANTEED_LATENCY - excess
    return parameters.max_velocity * time + parameters.platform_radius


def decide_reachability(fall: Fall, now: int, robot: RobotMotion | None,
                        parameters: CatcherParameters, excess: float = 0.0) -> Decision:
    """
    Decide whether the robot can be under a falling brick when the brick lands.

    :param now: current time (ns)
    :param robot: motion of the robot, or None if the robot is unavailable
    :param excess: excess latency (s)
    """
    time = fall.time_to(resting_height(parameters), parameters.gravity_accel)
    contact = fall.stamp + (0 if isnan(time) else round(time / SECONDS_PER_NS))
    available = (contact - now) * SECONDS_PER_NS
    latency = COMMAND_LATENCY + excess
    distance = needed = inf
    if robot is None:
        reason = 'no robot is available'
    else:
        distance = robot.distance_to(fall.position)
        needed = time_needed(fall, robot, parameters, excess)
        reason = _landing_problem(fall, time, parameters)
        remaining = max(available, 0.0)
        if not reason and needed > remaining:
            reason = (f'the robot, {distance:.2f} m away, needs {needed:.3f} s, but the brick '
                      f'lands in {remaining:.3f} s, {needed - remaining:.3f} s too early '
                      f'(command latency {latency:.2f} s)')
    return Decision(not reason, fall, contact, available, needed, latency, distance, reason)


def time_needed(fall: Fall, robot: RobotMotion, parameters: CatcherParameters,
                excess: float) -> float:
    """Return the maximum time (s) until the platform is level and under a falling brick."""
    distance = robot.longest_distance_to(fall.position)
    time = 0.0
    if distance > parameters.platform_radius:
        # For tiny platforms, travel_time exceeds the quotient in the module's formula.
        time = COMMAND_LATENCY + excess + travel_time(
            distance, parameters.platform_radius, parameters.max_velocity)
    return time if robot.level else max(time, LEVEL_LATENCY + excess)


def _landing_problem(fall: Fall, time: float, parameters: CatcherParameters) -> str:
    """Return the reason why the brick cannot land on a platform, or an empty string if it can."""
    if isnan(time):
        return (f'the brick, at {fall.z:.4g} m, falls from below its resting height on the '
                f'platform, {resting_height(parameters):.4g} m')
    if within_arena(fall.x, fall.y) != (fall.x, fall.y):
        return f'the landing point ({fall.x:.4g}, {fall.y:.4g}) is outside the arena'
    if time < 0.0:
        return f'the brick, at {fall.z:.4g} m, has already passed the platform'
    return ''
