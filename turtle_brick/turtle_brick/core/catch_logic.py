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
Use the positions of the brick and the robot to decide how to catch the brick.

`Catcher` records positions, decides whether each falling brick is reachable, and returns the goals
and tilt commands to publish. `transition` implements the state machine of the catcher. All
timestamps (ns) come from one clock.
"""

from enum import Enum
from math import cos, dist, hypot, inf, pi
from typing import NamedTuple

from turtle_brick.core.fall_detection import Fall, FallDetector
from turtle_brick.core.geometry import MAX_COORDINATE, Vector
from turtle_brick.core.latency import LatencyMonitor
from turtle_brick.core.parameters import CatcherParameters
from turtle_brick.core.reachability import (decide_reachability, Decision, LEVEL_LATENCY,
                                            resting_height, RobotMotion)
from turtle_brick.core.robot_tracking import POSITION_TOLERANCE, RobotTracker
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, within_arena

UPDATE_PERIOD = 0.02
"""Update period (s) of the catcher. Each new fall triggers an additional update."""

CENTER = (ARENA_CENTER, ARENA_CENTER)
"""Center (m) of the arena. The robot carries the bricks to this point."""

RAMP_TIME = 0.5
"""Time (s) that the platform takes to tilt or to become level."""

TILTING_TIMEOUT = 10.0
"""Timeout (s) for the brick to leave the tilted platform."""

SETTLING_TIME = 0.05
"""Time (s) without motion after which a brick beside the platform is considered to be at rest."""

BRICK_LAG = 0.5
"""Maximum pause (s) in the motion of a brick on a moving or tilted platform. The brick pauses if
platform transforms reach the arena late."""

LYING_TIME = 1.0
"""Time (s) for which a brick must rest on a level, stationary platform before the robot moves."""

CLOCK_DIFFERENCE = 0.5
"""Maximum age (s) of a brick position used for a decision. After a clock change, positions
can appear older than they are until the arena and the catcher have detected the change."""

DECISION_DEADLINE = 0.1
"""Time (s) before the landing by which the catcher must decide whether the brick is reachable."""

ROBOT_TIMEOUT = 1.0
"""Time (s) without a platform transform after which the catcher abandons the brick."""

GOAL_TOLERANCE = 0.02
"""Maximum distance (m) from the goal at which a stationary robot counts as having arrived."""

HEIGHT_TOLERANCE = 0.01
"""Maximum difference (m) between the height of a brick on the platform and its resting height."""

TRANSFORM_SKEW = 0.1
"""Maximum difference (s) between the timestamps of the latest brick and robot transforms."""


class State(Enum):
    """State of the catcher."""

    WAITING = 'waiting'
    APPROACHING = 'approaching'
    CARRYING = 'carrying'
    TILTING = 'tilting'
    LEVELING = 'leveling'


DRIVING_STATES = (State.APPROACHING, State.CARRYING)
"""States in which the robot drives to a goal."""


class Brick(NamedTuple):
    """Last observation of the brick."""

    position: Vector = (inf, inf, inf)
    """Center (m) of the brick in the world frame, infinite before the first observation."""
    stamp: int = 0
    """Time (ns) of the last observation."""
    last_motion: int = 0
    """Time (ns) at which the brick last moved or `is_attached` last changed."""
    is_attached: bool = False
    """Whether the platform is the parent frame of the brick."""
    has_landed: bool = False
    """Whether the brick is at resting height, and has landed or is attached to the platform."""

    def observe(self, stamp: int, position: Vector, is_attached: bool) -> 'Brick':
        """Return the brick updated with an observation made at `stamp` (ns)."""
        if (stamp < self.stamp or is_attached is not self.is_attached
                or dist(position, self.position) > POSITION_TOLERANCE):
            return Brick(position, stamp, stamp, is_attached)
        return Brick(self.position, stamp, self.last_motion, is_attached)


class Observation(NamedTuple):
    """Snapshot of the brick and the robot at the time of an update."""

    parameters: CatcherParameters
    now: int
    """Current time (ns)."""
    state_time: float
    """Time (s) that the catcher has spent in its current state."""
    brick: Brick
    is_in_free_fall: bool
    has_reachable_fall: bool
    """Whether the catcher decided in this update that a falling brick is reachable."""
    robot: RobotMotion | None
    """Motion of the robot, or None if the robot is unavailable."""
    platform: Platform | None
    tracker: RobotTracker
    is_level_commanded: bool
    """Whether the last tilt command was 0."""

    @property
    def is_robot_briefly_lost(self) -> bool:
        """Whether the robot has been unavailable for less than ROBOT_TIMEOUT."""
        return (self.robot is None
                and (self.now - self.tracker.last_seen) * SECONDS_PER_NS < ROBOT_TIMEOUT)

    @property
    def still_since(self) -> int:
        """Time (ns) at which the brick last moved or the robot was last unavailable."""
        return max(self.brick.last_motion, self.tracker.last_unseen)

    @property
    def still_time(self) -> float:
        """Time (s) from `still_since` until the last observation of the brick."""
        return (self.brick.stamp - self.still_since) * SECONDS_PER_NS

    @property
    def is_falling(self) -> bool:
        """Whether the brick is falling and still above the platform."""
        height = resting_height(self.parameters)
        return self.is_in_free_fall and self.brick.position[2] > height - HEIGHT_TOLERANCE

    @property
    def is_at_resting_height(self) -> bool:
        """Whether the brick is at its resting height and is not falling."""
        height = resting_height(self.parameters)
        return (not self.is_in_free_fall
                and abs(self.brick.position[2] - height) <= HEIGHT_TOLERANCE)

    @property
    def is_on_platform(self) -> bool:
        """Whether the brick is on the platform, allowing for an outdated robot position."""
        skew = self.parameters.max_velocity * TRANSFORM_SKEW
        return (self.is_at_resting_height and self.robot is not None
                and self.robot.distance_to(self.brick.position)
                <= self.parameters.platform_radius + skew)

    @property
    def is_following(self) -> bool:
        """Whether the brick is at its resting height and has moved in the last BRICK_LAG (s)."""
        return (self.is_at_resting_height and self.robot is not None
                and self.still_time < BRICK_LAG)

    @property
    def is_lying(self) -> bool:
        """Whether a landed brick has rested for LYING_TIME on a level, stationary platform."""
        limit = self.parameters.platform_radius + HEIGHT_TOLERANCE
        return (self.brick.has_landed and self.still_time >= LYING_TIME
                and self.robot is not None and self.robot.at_rest and self.robot.level
                and self.robot.distance_to(self.brick.position) <= limit)

    @property
    def has_left_platform(self) -> bool:
        """Whether the brick has left the tilted platform and stopped."""
        if self.platform is None:
            return True
        start = max(self.still_since, self.tracker.last_level)
        still_time = (self.brick.stamp - start) * SECONDS_PER_NS
        distance = hypot(*self.platform.coordinates_of(self.brick.position))
        is_beside = distance > self.parameters.platform_radius
        return still_time >= (SETTLING_TIME if is_beside else BRICK_LAG)

    def has_arrived_at(self, goal: tuple[float, float]) -> bool:
        """Return whether the robot is at rest at a given goal (m) in the world frame."""
        return (self.robot is not None and self.robot.at_rest
                and self.robot.distance_to(goal) <= GOAL_TOLERANCE)


def transition(state: State, observation: Observation) -> State:
    """Return the next state, which may be the current state."""
    if observation.has_reachable_fall:
        return State.APPROACHING
    if observation.is_robot_briefly_lost and state is not State.LEVELING:
        return state
    if state is State.APPROACHING:
        if observation.is_on_platform and observation.brick.has_landed:
            return State.CARRYING
        if not observation.is_falling:
            return State.LEVELING
    elif state is State.CARRYING:
        if not (observation.is_on_platform or observation.is_following):
            return State.LEVELING
        if observation.has_arrived_at(CENTER):
            return State.TILTING
    elif state is State.TILTING:
        if observation.has_left_platform or observation.state_time > TILTING_TIMEOUT:
            return State.LEVELING
    elif state is State.LEVELING:
        if observation.is_level_commanded:
            return State.WAITING
    elif observation.is_lying:
        # The brick was declared unreachable but landed on the platform, or was there at startup.
        return State.CARRYING
    return state


class DriveGoal(NamedTuple):
    """Goal (m) of the robot in the world frame."""

    x: float
    y: float


class TiltCommand(NamedTuple):
    """Commanded angle (rad) of the platform."""

    angle: float


Action = Decision | DriveGoal | TiltCommand
"""Decision or command that the catcher node publishes."""


class TiltRamp:
    """Change the platform angle smoothly."""

    def __init__(self, now: int) -> None:
        """Create a ramp with an angle of 0 at a given time (ns)."""
        self.angle = self._start_angle = 0.0
        self._start_time = 0
        self._command_time = now

    def start(self, now: int) -> None:
        """Start a new ramp from the current angle at time `now` (ns)."""
        self._start_angle, self._start_time = self.angle, now

    def advance(self, now: int, goal: float) -> bool:
        """Move the angle toward `goal` (rad) at `now` (ns). Return whether the angle changed."""
        if self.angle == goal:
            return False
        fraction = min((now - self._start_time) * SECONDS_PER_NS / RAMP_TIME, 1.0)
        smooth = 0.5 - 0.5 * cos(pi * fraction)
        self.angle = self._start_angle + smooth * (goal - self._start_angle)
        if fraction == 1.0:
            self.angle = goal
        self._command_time = now
        return True

    def command_age(self, now: int) -> float:
        """Return the age (s) of the last command at time `now` (ns)."""
        return (now - self._command_time) * SECONDS_PER_NS


class Catcher:
    """Catch each reachable brick, carry it to the center of the arena, and tip it off."""

    def __init__(self, parameters: CatcherParameters) -> None:
        self.parameters = parameters
        self._reset(0)

    def _reset(self, now: int) -> None:
        self.state = State.WAITING
        self._state_start = now
        self.decision: Decision | None = None
        self.latency = LatencyMonitor()
        self._now = now
        self._brick = Brick()
        self._detector = FallDetector(self.parameters.gravity_accel)
        self._is_refused = False
        """Whether the brick was found to be unreachable and has since moved only straight down."""
        self._finished_fall: Fall | None = None
        """Fall that ended below the platform before a decision was made."""
        self._tracker = RobotTracker(self.parameters.max_velocity, self.latency)
        self._ramp = TiltRamp(now)

    def observe_brick(self, stamp: int, position: Vector, is_attached: bool = False) -> bool:
        """
        Record the position of the brick.

        :param stamp: timestamp of the position (ns)
        :param position: center (m) of the brick in the world frame, ignored beyond MAX_COORDINATE
        :param is_attached: whether the platform is the parent frame of the brick
        :return: Whether a new fall was detected. If so, call `update` immediately.
        """
        x, y, z = position
        if not abs(x) + abs(y) + abs(z) <= MAX_COORDINATE:
            return False
        self.latency.record_brick_stamp(stamp)
        x_before, y_before, z_before = self._brick.position
        if z > z_before + POSITION_TOLERANCE or x != x_before or y != y_before:
            self._is_refused = False
        fall = self._detector.fall
        is_new_fall = self._detector.observe(stamp, x, y, z)
        before, self._brick = self._brick, self._brick.observe(stamp, position, is_attached)
        height = resting_height(self.parameters)
        has_landed = is_attached or (before.has_landed and not before.is_attached)
        if fall is not None and self._detector.fall is None:
            if not self._is_decided(fall) and z < height - HEIGHT_TOLERANCE:
                self._finished_fall = fall
            # The brick has landed if it was above the platform and must have reached the platform
            # by now. Otherwise, the `place` service has moved the brick.
            if (z_before > height - HEIGHT_TOLERANCE
                    and fall.height(stamp, self._detector.gravity) < height + HEIGHT_TOLERANCE):
                has_landed = True
        self._brick = self._brick._replace(
            has_landed=has_landed and abs(z - height) <= HEIGHT_TOLERANCE)
        return is_new_fall

    def update(self, now: int, platform: Platform | None) -> list[Action]:
        """
        Update the state and return the decisions and commands to publish.

        Call this method at least 50 times per second. If `now` decreases, the catcher is reset.

        :param now: current time (ns)
        :param platform: platform of the robot, or None if the platform is unavailable
        """
        actions: list[Action] = []
        if now < self._now:
            self._reset(now)
            actions.append(TiltCommand(0.0))
        self._now = now
        level_time = self._ramp.command_age(now) if self._ramp.angle == 0.0 else 0.0
        robot = self._tracker.observe(now, platform, level_time)
        decision = self._decide(robot)
        if decision is not None:
            self.decision = decision
            self._is_refused = not decision.reachable
            actions.append(decision)
        observation = Observation(
            self.parameters, now, (now - self._state_start) * SECONDS_PER_NS, self._brick,
            is_in_free_fall=self._detector.fall is not None,
            has_reachable_fall=decision is not None and decision.reachable,
            robot=robot, platform=platform, tracker=self._tracker,
            is_level_commanded=self._ramp.angle == 0.0)
        previous = self.state
        self.state = transition(previous, observation)
        if observation.has_reachable_fall or self.state is not previous:
            self._state_start = now
            self._ramp.start(now)
        return (actions + self._drive_goals(previous, observation)
                + self._tilt_commands(observation))

    def _decide(self, robot: RobotMotion | None) -> Decision | None:
        """Return a decision about a new fall, or None if there is no fall or no decision yet."""
        finished_fall, self._finished_fall = self._finished_fall, None
        if finished_fall is not None:
            late = self._reachability(finished_fall, robot, self._tracker.excess)
            return late._replace(reachable=False, reason=(
                f'the fall was detected {-late.available:.3f} s after the brick had landed'))
        fall = self._detector.fall
        age = abs(self._now - self._brick.stamp) * SECONDS_PER_NS
        if fall is None or self._is_decided(fall) or age > CLOCK_DIFFERENCE:
            return None
        excess = self._tracker.excess
        available = self._reachability(fall, robot, excess).available
        excess += self.latency.expected_standstill(self._now, available)
        decision = self._reachability(fall, robot, excess)
        if decision.reachable or decision.available <= DECISION_DEADLINE:
            return decision
        # Wait if later observations of the robot may show that the brick is reachable.
        best_case = robot._replace(uncertainty=0.0) if robot else RobotMotion(fall.x, fall.y)
        return None if self._reachability(fall, best_case, excess).reachable else decision

    def _reachability(self, fall: Fall, robot: RobotMotion | None, excess: float) -> Decision:
        return decide_reachability(fall, self._now, robot, self.parameters, excess)

    def _is_decided(self, fall: Fall) -> bool:
        return self._is_refused or (self.decision is not None and self.decision.fall is fall)

    def _drive_goals(self, previous: State, observation: Observation) -> list[Action]:
        """Return a new goal, or the last goal if it is recent and messages are being lost."""
        goal = self._new_goal(previous, observation)
        if goal is not None:
            self._tracker.record_goal(self._now, goal)
            return [DriveGoal(*goal)]
        if self._tracker.is_goal_at_risk(self._now):
            return [DriveGoal(*self._tracker.goal)]
        return []

    def _new_goal(self, previous: State, observation: Observation) -> tuple[float, float] | None:
        """Return a new goal (m) in the world frame, or None if there is no new goal."""
        robot, state = observation.robot, self.state
        if self.decision is not None and observation.has_reachable_fall:
            return self.decision.fall.position[:2]
        if state is State.CARRYING and previous is not State.CARRYING:
            return CENTER
        if robot is None:
            return None
        if state is State.LEVELING and previous in DRIVING_STATES:
            # A moving robot stops at a point straight ahead.
            return within_arena(*(robot.destinations or ((robot.x, robot.y),))[0])
        if (state in DRIVING_STATES and robot.at_rest
                and not observation.has_arrived_at(self._tracker.goal)):
            # The goal was lost, or another node has published a different goal.
            return self._tracker.goal
        return None

    def _tilt_commands(self, observation: Observation) -> list[Action]:
        """Return new tilt commands, or repeat a recent command if messages are being lost."""
        commands: list[Action] = []
        if observation.has_reachable_fall:
            self._ramp = TiltRamp(self._now)
            commands.append(TiltCommand(0.0))
        goal = self.parameters.tilt_angle if self.state is State.TILTING else 0.0
        has_changed = self._ramp.advance(self._now, goal)
        is_recent = self._ramp.command_age(self._now) < LEVEL_LATENCY + self._tracker.excess
        if has_changed or (self.latency.loses_messages(self._now) and is_recent):
            commands.append(TiltCommand(self._ramp.angle))
        return commands
