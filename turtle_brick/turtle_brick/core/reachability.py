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

The robot drives to the goal, which is the point inside the arena that is nearest to the brick. The
brick is reachable if it lands within platform_radius of the goal, and the robot is there in time:

    time needed = command_latency + (distance - reach) / max_velocity + braking loss

- The brick falls straight down without drag, and lands when its bottom reaches the top of the
  level platform. If the fall is detected only after that time, the brick is unreachable.
- A brick lands on the platform if its center is within platform_radius of the platform axis. The
  platform is therefore under the brick if its distance to the goal is at most the reach, which is
  platform_radius minus the distance from the goal to the brick (0 m for a brick in the arena).
- Braking costs extra time (braking loss) only if the braking distance exceeds the reach.
- A robot that moves, or has just received a goal, at worst drives away at full speed first. Its
  distance to the goal is therefore increased by max_velocity * command_latency.
- A robot at rest whose level platform is already under the brick needs no time.

All timestamps (ns) come from the same clock.
"""

from math import dist, inf
from typing import NamedTuple

from turtle_brick.core.brick_tracking import Fall
from turtle_brick.core.driving import braking_loss, START_DISTANCE
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.robot_tracking import RobotState
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


def time_needed(point: tuple[float, ...], robot: RobotState, parameters: Parameters) -> float:
    """Return the maximum time (s) from a decision until the level platform is under a point."""
    radius, speed = parameters.platform_radius, parameters.max_velocity
    if robot.is_at_rest and robot.is_level and robot.distance_to(point) <= radius:
        return 0.0
    goal = nearest_in_arena(*point[:2])
    reach = radius - dist(goal, point[:2])
    if reach < START_DISTANCE:
        return inf  # The robot stops within START_DISTANCE of its goal.
    distance = robot.distance_to(goal)
    if not robot.is_at_rest:
        distance += speed * parameters.command_latency
    if distance <= reach:
        return parameters.command_latency
    return parameters.command_latency + (distance - reach) / speed + braking_loss(reach, speed)


def decide_reachability(fall: Fall, now: int, robot: RobotState | None,
                        parameters: Parameters) -> Decision:
    """
    Decide whether the robot can be under a falling brick when the brick lands.

    :param now: current time (ns)
    :param robot: state of the robot, or None if the robot is unavailable
    """
    height = resting_height(parameters)
    available = fall.time_to(height, parameters.gravity_accel)
    available -= (now - fall.stamp) * SECONDS_PER_NS
    x, y, z = fall.position
    distance = needed = inf
    if robot is not None:
        distance = robot.distance_to(fall.position)
        needed = time_needed(fall.position, robot, parameters)
    reason = ''
    if z < height:
        reason = (f'the brick, at {z:.4g} m, is below its resting height on the platform, '
                  f'{height:.4g} m')
    elif available < 0.0:
        reason = (f'the fall was detected {-available:.3f} s after the brick reached the top of '
                  'the platform, because its transforms arrived late')
    elif robot is None:
        reason = 'no robot is available'
    elif needed == inf:
        reason = f'the landing point ({x:.4g}, {y:.4g}) is outside the arena'
    elif needed > available:
        reason = (f'the robot, {distance:.2f} m away, needs {needed:.3f} s, but the brick lands '
                  f'in {available:.3f} s, {needed - available:.3f} s too early')
    return Decision(not reason, fall, available, needed, distance, reason)
