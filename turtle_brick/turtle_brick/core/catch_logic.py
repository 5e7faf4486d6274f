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
Compute goals and tilt commands to catch a brick, carry it, and tip it off the platform.

    WAITING --> APPROACHING --> CARRYING --> TILTING --> LEVELING --> WAITING

`Catcher` records the poses of the brick and the platform. Each update first decides whether a new
fall is reachable, then computes the next state, and returns the commands for this state. There is
one decision per fall, and a fall is identified by its release time. All timestamps (ns) come from
the same clock.
"""

from enum import Enum
from math import cos, pi
from typing import NamedTuple

from turtle_brick.core.brick_tracking import BrickTracker, Fall
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.reachability import decide_reachability, Decision, resting_height
from turtle_brick.core.robot_tracking import GOAL_TOLERANCE, RobotTracker
from turtle_brick.core.tilting_platform import PlatformShape
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_arena import ARENA_CENTER, nearest_in_arena

UPDATE_PERIOD = 0.02
"""Update period (s) of the catcher. Each new fall triggers an additional update."""

CENTER = (ARENA_CENTER, ARENA_CENTER)
"""Center (m) of the arena, to which the robot carries the bricks."""

RAMP_TIME = 0.5
"""Time (s) that the platform takes to tilt or to return to level."""

TILTING_TIMEOUT = 10.0
"""Timeout (s) for the brick to leave the tilted platform."""

SETTLING_TIME = 0.05
"""Time (s) without motion after which a brick beside the platform counts as having left it."""

LYING_TIME = 1.0
"""Time (s) for which a brick must lie still on a level platform before the robot carries it."""


class State(Enum):
    """State of the catcher."""

    WAITING = 'waiting'
    APPROACHING = 'approaching'
    CARRYING = 'carrying'
    TILTING = 'tilting'
    LEVELING = 'leveling'


DRIVING_STATES = (State.APPROACHING, State.CARRYING)
"""States of the catcher in which the robot drives to a goal."""


class Observation(NamedTuple):
    """Observed values that determine the next state of the catcher."""

    state_time: float = 0.0
    """Time (s) that the catcher has spent in its current state."""
    has_reachable_fall: bool = False
    """Whether the catcher decided in this update that a falling brick is reachable."""
    is_falling: bool = False
    """Whether the brick is falling and has not passed the platform yet."""
    is_on_platform: bool = False
    """Whether the brick has landed on the platform of an available robot and is still there."""
    is_beside_platform: bool = False
    """Whether the center of the brick is beside the platform, or the robot is unavailable."""
    still_for: float = 0.0
    """Time (s) since the brick last moved."""
    is_robot_idle: bool = False
    """Whether the robot is at rest and its platform is level."""
    is_at_center: bool = False
    """Whether the robot is at rest at the center of the arena."""
    is_level: bool = True
    """Whether the last tilt command was 0 rad, and the platform is level or unavailable."""


def transition(state: State, observation: Observation) -> tuple[State, str]:
    """
    Return the next state of the catcher and the reason, or the current state and no reason.

    If a reachable brick starts to fall, the next state is always APPROACHING. Otherwise:

        APPROACHING --> CARRYING    the brick is on the platform
        APPROACHING --> LEVELING    the brick no longer falls toward the platform
        CARRYING    --> LEVELING    the brick has left the platform, or the robot is unavailable
        CARRYING    --> TILTING     the robot has arrived at the center
        TILTING     --> LEVELING    the brick rests beside the platform
        TILTING     --> LEVELING    the brick has not left the platform in time
        LEVELING    --> WAITING     the platform is level
        WAITING     --> CARRYING    a brick lies on the level platform of a robot at rest

    If the arena node stops during a fall, the state stays APPROACHING until the brick reappears.
    """
    o = observation
    if o.has_reachable_fall:
        return State.APPROACHING, 'a reachable brick falls'
    if state is State.APPROACHING:
        if o.is_on_platform:
            return State.CARRYING, 'the brick is on the platform'
        if not o.is_falling:
            return State.LEVELING, 'the brick no longer falls toward the platform'
    elif state is State.CARRYING:
        if not o.is_on_platform:
            return State.LEVELING, 'the brick has left the platform, or the robot is unavailable'
        if o.is_at_center:
            return State.TILTING, 'the robot has arrived at the center'
    elif state is State.TILTING:
        if o.is_beside_platform and o.still_for >= SETTLING_TIME:
            return State.LEVELING, 'the brick rests beside the platform'
        if o.state_time > TILTING_TIMEOUT:
            return State.LEVELING, 'the brick has not left the platform in time'
    elif state is State.LEVELING:
        if o.is_level:
            return State.WAITING, 'the platform is level'
    # A brick can lie on the platform at startup, or land there despite the decision "unreachable".
    elif o.is_on_platform and o.is_robot_idle and o.still_for >= LYING_TIME:
        return State.CARRYING, 'a brick lies on the level platform of a robot at rest'
    return state, ''


class Commands(NamedTuple):
    """Commands to publish after an update of the catcher. A command that is None is omitted."""

    goal: tuple[float, float] | None = None
    """Goal (m) of the robot in the world frame."""
    tilt_angle: float | None = None
    """Angle (rad) of the platform."""


def ramp(start: float, end: float, time: float) -> float:
    """Return the platform angle (rad) after `time` (s) on a smooth ramp from `start` to `end`."""
    if time >= RAMP_TIME:
        return end
    return start + (end - start) * (0.5 - 0.5 * cos(pi * time / RAMP_TIME))


class Catcher:
    """
    Catch each reachable brick, carry it to the arena's center, and tip it off the platform.

    Record all positions in `brick` and `robot`, and then call `update`.
    """

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self._shape = PlatformShape(parameters.platform_radius)
        self._reset(0)

    def _reset(self, now: int) -> None:
        self.state = State.WAITING
        self.reason = 'the clock was set back'
        """Reason for the last change of the state."""
        self.decision: Decision | None = None
        """Latest decision."""
        self.brick = BrickTracker(self.parameters.gravity_accel, resting_height(self.parameters))
        self.robot = RobotTracker(self.parameters.command_latency)
        self._now = self._state_start = now
        self._tilt_angle = self._ramp_start = 0.0
        """Last commanded platform angle (rad), and the angle at the start of the tilt ramp."""

    @property
    def undecided_fall(self) -> Fall | None:
        """
        Get the current fall, or None if there is no fall that still needs a decision.

        A fall that was released before the latest decision is the fall that was decided.
        """
        fall = self.brick.fall
        if fall is None or self.decision is None:
            return fall
        release = fall.release_time(self.parameters.gravity_accel)
        return None if release < self.decision.fall.stamp else fall

    def is_update_due(self, now: int) -> bool:
        """Return whether a fall needs a decision, or the clock was set back to `now` (ns)."""
        return now < self._now or self.undecided_fall is not None

    def update(self, now: int) -> Commands:
        """
        Decide on a new fall, update the state, and return the commands to publish.

        If the clock is set back, the catcher returns to WAITING and levels the platform.

        :param now: current time (ns)
        """
        if now < self._now:
            self._reset(now)
            return Commands(tilt_angle=0.0)
        self._now = now
        catch_goal = self._decide()
        previous = self.state
        self.state, reason = transition(previous, self._observation(catch_goal is not None))
        if reason:
            self.reason = reason
            self._state_start, self._ramp_start = now, self._tilt_angle

        goal = catch_goal or self._next_goal(previous)
        angle = self._next_angle()
        if goal is not None:
            self.robot.record_goal(now, goal)
        if angle is not None:
            self._tilt_angle = angle
            self.robot.record_tilt(now, angle)
        return Commands(goal, angle)

    def _decide(self) -> tuple[float, float] | None:
        """Decide on a new fall, and return the robot's goal (m) if the brick is reachable."""
        fall = self.undecided_fall
        if fall is None:
            return None
        self.decision = decide_reachability(fall, self._now, self.robot.state, self.parameters)
        return nearest_in_arena(*fall.position[:2]) if self.decision.reachable else None

    def _observation(self, has_reachable_fall: bool) -> Observation:
        brick, robot, platform = self.brick, self.robot.state, self.robot.platform
        return Observation(
            state_time=self._elapsed(self._state_start),
            has_reachable_fall=has_reachable_fall,
            is_falling=brick.is_falling_to_platform,
            is_on_platform=brick.has_landed and robot is not None,
            is_beside_platform=platform is None or not self._shape.contains(
                *platform.coordinates_of(brick.position)),
            still_for=brick.still_for,
            is_robot_idle=robot is not None and robot.is_at_rest and robot.is_level,
            is_at_center=(robot is not None and robot.is_at_rest
                          and robot.distance_to(CENTER) <= GOAL_TOLERANCE),
            is_level=self._is_level)

    def _elapsed(self, time: int) -> float:
        return (self._now - time) * SECONDS_PER_NS

    @property
    def _is_level(self) -> bool:
        platform = self.robot.platform
        return self._tilt_angle == 0.0 and (platform is None or platform.is_level)

    def _next_goal(self, previous: State) -> tuple[float, float] | None:
        robot, state = self.robot.state, self.state
        if robot is None:
            return None
        if state is State.CARRYING and previous is not State.CARRYING:
            return CENTER
        if state is State.LEVELING and previous in DRIVING_STATES:
            return nearest_in_arena(robot.x, robot.y)
        if state in DRIVING_STATES and robot.is_off_course:
            return self.robot.goal  # The goal was lost, or another node has published a goal.
        return None

    def _next_angle(self) -> float | None:
        time = self._elapsed(self._state_start)
        if self.state is State.TILTING:
            angle = ramp(self._ramp_start, self.parameters.tilt_angle, time)
            return None if angle == self._tilt_angle else angle
        # Other nodes may tilt the platform while the catcher waits, but not during a catch.
        if self.state is State.WAITING or self._is_level:
            return None
        return 0.0 if self.state is State.APPROACHING else ramp(self._ramp_start, 0.0, time)
