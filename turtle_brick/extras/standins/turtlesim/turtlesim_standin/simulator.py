# SPDX-License-Identifier: Apache-2.0

"""Simulate all turtles of a turtlesim window."""

import math

from turtlesim_standin.turtlesim_arena import ARENA_CENTER, ARENA_SIZE, float32, TurtlePose
from turtlesim_standin.turtlesim_kinematics import normalize, Turtle

HEADING_TOLERANCE = 0.02
"""Remaining rotation (rad) at which a turtle has reached its goal heading."""


class SimulatedTurtle(Turtle):
    """A turtle that can be teleported and turned to a heading, and that detects walls."""

    _x: float
    _y_down: float
    _theta: float

    def __init__(self, *pose: float, holonomic: bool, now: float) -> None:
        """Create a turtle at rest at a given pose (m, rad) and time (s)."""
        super().__init__(*pose, holonomic=holonomic, now=now)
        self._teleports: list[tuple[bool, float, float, float]] = []
        self.clamped: tuple[float, float] | None = None
        """Unclamped position (m, y down) if the turtle hit a wall in the last tick, else None."""
        self.goal: float | None = None
        """Heading (rad) toward which the turtle turns, or None."""
        self.reached = False
        """Whether the turtle has reached its last goal heading."""
        self.remaining = 0.0
        """Rotation (rad) to the last goal heading."""
        self.delta = 0.0
        """Rotation (rad) back to the heading at which the last rotation began."""
        self._start = 0.0
        self._requested_goal: float | None = None

    def clamp(self, x: float, y_down: float) -> tuple[float, float]:
        """Stop the turtle at a wall and record the unclamped position."""
        clamped = super().clamp(x, y_down)
        self.clamped = None if clamped == (x, y_down) else (x, y_down)
        return clamped

    def teleport_absolute(self, x: float, y: float, theta: float) -> None:
        """Request a teleport to a pose (m, rad) at the next tick. The velocity does not change."""
        self._teleports.append((False, float32(x), float32(y), float32(theta)))

    def teleport_relative(self, linear: float, angular: float) -> None:
        """Request a turn (rad) and then a jump (m) along the new heading at the next tick."""
        self._teleports.append((True, float32(linear), 0.0, float32(angular)))

    def rotate_to(self, theta: float) -> None:
        """Request a rotation at 1 rad/s to a heading (rad), beginning at the next tick."""
        self._requested_goal, self.reached = theta, False

    def stop(self) -> None:
        """Set the velocities to zero and remove the goal heading."""
        self._linear_x = self._linear_y = self._angular = 0.0
        self.goal = self._requested_goal = None

    def take_command(self, now: float) -> None:
        """Take the oldest velocity command, if there is one, which removes the goal heading."""
        if self._queue:
            self.goal = None
        super().take_command(now)

    def update(self, now: float) -> TurtlePose:
        """Execute all requested teleports, then move the turtle, and return the new pose."""
        if self._requested_goal is not None:
            self.goal, self._requested_goal = self._requested_goal, None
            self._start, self.delta = self._theta, 0.0
        self._teleport()
        if self.goal is not None:
            self._turn_to_goal(self.goal, now)
        return super().update(now)

    def _turn_to_goal(self, goal: float, now: float) -> None:
        goal = normalize(goal)
        self.remaining = float32(normalize(goal - float32(self._theta)))
        self.delta = float32(normalize(float32(self._start - self._theta)))
        self.reached = abs(normalize(float32(self._theta) - goal)) < HEADING_TOLERANCE
        if self.reached:
            self.stop()
        else:
            self._linear_x = self._linear_y = 0.0
            self._angular = -1.0 if self.remaining < 0.0 else 1.0
            self._commanded_at = now

    def _teleport(self) -> None:
        for relative, x_or_linear, y, theta in self._teleports:
            if relative:
                self._theta += theta
                # For the cosine of infinity, Python raises an exception, but C++ returns NaN.
                heading = self._theta if math.isfinite(self._theta) else math.nan
                self._x += math.cos(heading) * x_or_linear
                self._y_down += -math.sin(heading) * x_or_linear
            else:
                self._x = x_or_linear
                self._y_down = max(0.0, ARENA_SIZE - y)
                self._theta = theta
        self._teleports.clear()


class TurtleSim:
    """Simulate turtles in an arena that initially contains only turtle1, at the center."""

    def __init__(self, holonomic: bool = False, now: float = 0.0) -> None:
        """Create a simulator that starts at time `now` (s)."""
        self.turtles: dict[str, SimulatedTurtle] = {}
        """Turtles in their update order, keyed by name."""
        self._holonomic = holonomic
        self._names = 0
        self._started = False
        self.reset(now)

    def set_holonomic(self, holonomic: bool) -> None:
        """Set whether all turtles can move sideways."""
        self._holonomic = holonomic
        for turtle in self.turtles.values():
            turtle.holonomic = holonomic

    def spawn(self, x: float, y: float, theta: float, name: str = '', now: float = 0.0) -> str:
        """
        Add a turtle and return its name, or an empty string if the name is in use.

        An empty name is replaced with the next unused name, such as turtle2.
        """
        if name in self.turtles:
            return ''
        while not name:
            self._names += 1
            candidate = f'turtle{self._names}'
            name = '' if candidate in self.turtles else candidate
        self.turtles[name] = SimulatedTurtle(
            x, y, theta, holonomic=self._holonomic, now=now)
        self.turtles = dict(sorted(self.turtles.items()))
        return name

    def kill(self, name: str) -> bool:
        """Remove a turtle and return whether it existed."""
        return self.turtles.pop(name, None) is not None

    def reset(self, now: float = 0.0) -> None:
        """Remove all turtles and add turtle1 at rest at the center of the arena."""
        self.turtles = {}
        self._names = 0
        self.spawn(ARENA_CENTER, ARENA_CENTER, 0.0, now=now)

    def tick(self, now: float) -> dict[str, TurtlePose]:
        """
        Execute one 16 ms tick and return the turtles' poses, keyed by name.

        The first call takes one command from each turtle's queue, but does not return any poses.
        """
        if not self._started:
            self._started = True
            for turtle in self.turtles.values():
                turtle.take_command(now)
            return {}
        return {name: turtle.tick(now) for name, turtle in self.turtles.items()}
