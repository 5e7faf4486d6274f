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

A brick is reachable if it lands inside the arena and the robot arrives before the brick lands:

    time needed = command_latency + (distance - platform_radius) / max_velocity + braking loss

- The brick falls straight down without drag, and lands when its bottom reaches the top of the
  level platform. If the fall is detected only after that time, the brick is unreachable.
- A brick lands on the platform if its center is within platform_radius of the platform axis. The
  driving distance is therefore the distance to the brick minus platform_radius, but at least 0.
- Braking costs extra time (braking loss) only if the braking distance exceeds platform_radius.
- A robot that moves, or has just received a goal, at worst drives away at full speed first. Its
  distance to the brick is therefore increased by max_velocity * command_latency.
- A robot at rest whose level platform is already under the brick needs no time.

All timestamps (ns) come from the same clock.
"""

from math import inf, isnan
from typing import NamedTuple

from turtle_brick.core.brick_tracking import Fall
from turtle_brick.core.driving import braking_loss
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.robot_tracking import RobotState
from turtle_brick.core.tilting_platform import PlatformShape
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_arena import nearest_in_arena


class Decision(NamedTuple):
    """Decision on whether a falling brick is reachable."""

    reachable: bool
    fall: Fall
    available: float
    """Time (s) from the decision until the brick's bottom reaches the top of the platform."""
    needed: float
    """Time (s) from the decision until the platform can be under the brick."""
    distance: float
    """Horizontal distance (m) from the robot to the brick at the time of the decision."""
    reason: str
    """Reason why the brick is unreachable, or an empty string if it is reachable."""

    @property
    def summary(self) -> str:
        """One-line summary of the decision, such as "unreachable: no robot is available"."""
        if not self.reachable:
            return f'unreachable: {self.reason}'
        return (f'reachable: the robot, {self.distance:.2f} m away, needs {self.needed:.3f} s, '
                f'and the brick lands in {self.available:.3f} s')


def resting_height(parameters: Parameters) -> float:
    """Return the height (m) of the center of a brick that rests on the level platform."""
    return parameters.platform_height + parameters.brick_size[2] / 2.0


def drive_time(distance: float, parameters: Parameters) -> float:
    """
    Return the time (s) from a decision until the platform is under a brick.

    If all nodes run on one machine, the command latency is at most 0.11 s. Transporting three
    messages (goal, pose and transform) takes 1.2 ms. The waits for turtle_robot's next cycle and
    next transform take up to 10 ms each. A command takes 0.4 ms to reach turtlesim, waits up to
    60 ms to become the oldest command in the queue, and waits up to 16 ms for the next tick. The
    remaining 12.4 ms cover one physics step of the arena and operating system delays. Leveling
    the platform takes less than 0.11 s.

    :param distance: horizontal distance (m) from the platform axis to the brick
    """
    shape = PlatformShape(parameters.platform_radius)
    drive = shape.distance_to(distance) / parameters.max_velocity
    if drive > 0.0:
        drive += braking_loss(shape.reach, parameters.max_velocity)
    return parameters.command_latency + drive


def time_needed(point: tuple[float, ...], robot: RobotState, parameters: Parameters) -> float:
    """Return the maximum time (s) from a decision until the level platform is under a point."""
    distance = robot.distance_to(point)
    if not robot.is_at_rest:
        return drive_time(distance + parameters.max_velocity * parameters.command_latency,
                          parameters)
    if robot.is_level and PlatformShape(parameters.platform_radius).distance_to(distance) == 0.0:
        return 0.0
    return drive_time(distance, parameters)


def decide_reachability(fall: Fall, now: int, robot: RobotState | None,
                        parameters: Parameters) -> Decision:
    """
    Decide whether the robot can be under a falling brick when the brick lands.

    :param now: current time (ns)
    :param robot: state of the robot, or None if the robot is unavailable
    """
    time = fall.time_to(resting_height(parameters), parameters.gravity_accel)
    available = time - (now - fall.stamp) * SECONDS_PER_NS
    distance = needed = inf
    if robot is not None:
        distance = robot.distance_to(fall.position)
        needed = time_needed(fall.position, robot, parameters)
    reason = _landing_problem(fall, time, available, parameters)
    if not reason and robot is None:
        reason = 'no robot is available'
    elif not reason and needed > available:
        reason = (f'the robot, {distance:.2f} m away, needs {needed:.3f} s, but the brick lands '
                  f'in {available:.3f} s, {needed - available:.3f} s too early')
    return Decision(not reason, fall, available, needed, distance, reason)


def _landing_problem(fall: Fall, time: float, available: float, parameters: Parameters) -> str:
    x, y, z = fall.position
    if isnan(time):
        return (f'the brick, at {z:.4g} m, falls from below its resting height on the '
                f'platform, {resting_height(parameters):.4g} m')
    if nearest_in_arena(x, y) != (x, y):
        return f'the landing point ({x:.4g}, {y:.4g}) is outside the arena'
    if time < 0.0:
        return f'the brick, at {z:.4g} m, has already passed the platform'
    if available < 0.0:
        return (f'the fall was detected {-available:.3f} s after the brick reached the top of the '
                'platform, because its transforms arrived late')
    return ''
