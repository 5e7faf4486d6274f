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

# mypy: allow-untyped-defs
# The assignment defines the signatures of World without type hints.
"""
Simulate a brick that falls onto a platform, rides on it and slides off.

    HOVERING --> FALLING --> RIDING --> FLOATING
                    |  ^-------------------'
                    '--> GROUNDED

Releasing the brick starts a fall. Placing the brick makes it hover, regardless of its state.

The height of a falling brick is z = z0 - g t^2 / 2, where t is the time since the release. This
closed-form solution does not accumulate errors. A sliding brick accelerates at g sin(tilt).

The location of the brick is that of its center. Only the bottom of the brick can touch the
platform or the ground. The assignment requires the brick to have the same inclination as the
platform at all times, even while it hovers.

A brick lands on the platform if the brick's center is within the platform's radius. A sliding
brick leaves the platform when the brick's entire bottom is outside the platform's radius, because
the assignment requires the brick's trailing edge to clear the platform.
"""

from enum import Enum

from turtle_brick.core.geometry import (from_yaw, MAX_COORDINATE, multiply, Pose, Pose2D,
                                        Quaternion, Vector)
from turtle_brick.core.tilting_platform import Platform, PlatformShape

STEP_NS = 4_000_000
"""Duration (ns) of one physics step in the arena. The step rate is 250 Hz."""

CONTACT_TOLERANCE = 1e-9
"""Height tolerance (m) for the landing of a brick that touches the platform when released."""

MIN_NORMAL_Z = 1e-9
"""Minimum vertical component of the unit normal of a platform that supports a brick."""


class BrickState(Enum):
    """State of the brick's motion."""

    HOVERING = 'hovering'
    FALLING = 'falling'
    RIDING = 'riding'
    FLOATING = 'floating'
    GROUNDED = 'grounded'


class World:
    """
    Keep track of the physics of the world.

    By default, the brick is a point and there is no platform. Set `size`, `thickness` and
    `platform` to change these defaults. Call `release` once and then `step` repeatedly. For one
    timestep of a fall, `drop` does both.

    The constructor and the `brick` setter raise ValueError if the location is not finite, is too
    far away, or puts the brick below the ground.
    """

    def __init__(self, brick, gravity, radius, dt):  # noqa: D406,D407,D413,D417
        """
        Initialize the world.

        Args:
            brick - The (x,y,z) location of the brick
            gravity - the acceleration due to gravity in m/s^2
            radius - the radius of the platform
            dt - timestep in seconds of the physics simulation

        """
        self._gravity = gravity
        self._shape = PlatformShape(radius)
        self._dt = dt

        self.size: Vector = (0.0, 0.0, 0.0)
        """Length, width and height (m) of the brick."""
        self.thickness = 0.0
        """Distance (m) from the origin of the platform frame to the top of the platform."""
        self._platform: Platform | None = None
        self._last_platform: Platform | None = None
        """Platform at its last known pose, which determines the inclination of the brick."""

        self.state = BrickState.HOVERING
        """State of the brick's motion. Only this class changes it."""
        self._yaw = 0.0
        """Heading (rad) of the brick in the world frame."""
        self._release_height = 0.0
        self._steps_fallen = 0
        """Number of steps since the start of the fall."""

        self._place = Pose2D(0.0, 0.0, 0.0)
        """Pose of a riding brick relative to the platform, with the yaw relative to its hinge."""
        self._slide_velocity: tuple[float, float] = (0.0, 0.0)
        """Velocity (x and y in m/s) of a riding brick in the platform frame."""
        self.brick = brick

    @property
    def brick(self):
        """
        Get the brick's location.

        Return: (x,y,z) location of the brick
        """
        return self._brick

    @brick.setter
    def brick(self, location):  # noqa: D406,D407,D413,D417
        """
        Set the brick's location.

        Args:
            location - the (x,y,z) location of the brick

        """
        x, y, z = (float(value) for value in location)
        if not abs(x) + abs(y) + abs(z) <= MAX_COORDINATE:
            raise ValueError(f'the location ({x:g}, {y:g}, {z:g}) is not finite, or too far away')
        if z < self._half_height:
            raise ValueError(f'z is {z:g} m, but must be at least {self._half_height:g} m so that '
                             'the bottom of the brick is not below the ground')
        self._brick: Vector = (x, y, z)
        self.state = BrickState.HOVERING
        self._yaw = 0.0

    def drop(self):
        """Update the brick's location by having it fall in gravity for one timestep."""
        if self.state in (BrickState.HOVERING, BrickState.FLOATING):
            self.release()
        if self.state is not BrickState.FALLING:
            return
        x, y, previous_z = self._brick
        self._steps_fallen += 1
        time = self._steps_fallen * self._dt
        z = self._release_height - 0.5 * self._gravity * time * time
        if self._platform is not None and self._land(self._platform, previous_z, z):
            return
        if z <= self._half_height:
            z = self._half_height
            self.state = BrickState.GROUNDED
        self._brick = (x, y, z)

    @property
    def platform(self) -> Platform | None:
        """Get the platform, or None if its pose is unknown."""
        return self._platform

    @platform.setter
    def platform(self, platform: Platform | None) -> None:
        self._platform = platform
        if platform is not None:
            self._last_platform = platform

    @property
    def orientation(self) -> Quaternion:
        """Get the brick's orientation in the world frame, including the platform's inclination."""
        platform = self._last_platform
        if platform is None:
            return from_yaw(self._yaw)
        return multiply(platform.pose.orientation, from_yaw(self._yaw - platform.hinge_yaw))

    @property
    def pose_on_platform(self) -> Pose | None:
        """Get the brick's pose in the platform frame, or None if the brick is not riding."""
        if self.state is not BrickState.RIDING or self._platform is None:
            return None
        x, y, yaw = self._place
        return Pose((x, y, self.thickness + self._half_height), from_yaw(yaw))

    def release(self) -> None:
        """
        Release the brick so that it starts to fall in the next step.

        :raises ValueError: if the state is neither HOVERING nor FLOATING
        """
        if self.state is BrickState.FALLING:
            raise ValueError('the brick is already falling')
        if self.state is BrickState.RIDING:
            raise ValueError('the brick is on the platform, so tilt the platform or place the '
                             'brick elsewhere')
        if self.state is BrickState.GROUNDED:
            raise ValueError('the brick is on the ground, so place it first')
        self.state = BrickState.FALLING
        self._release_height = self._brick[2]
        self._steps_fallen = 0

    def step(self) -> None:
        """Advance the simulation by one timestep."""
        if self.state is BrickState.FALLING:
            self.drop()
        elif self.state is BrickState.RIDING and self._platform is not None:
            self._slide(self._platform)

    @property
    def _half_height(self) -> float:
        return self.size[2] / 2.0

    def _land(self, platform: Platform, previous_z: float, z: float) -> bool:
        """Land the brick if it reaches the platform's top, and return whether it has landed."""
        top_z = platform.pose.transform((0.0, 0.0, self.thickness))[2]
        resting_z = top_z + self._half_height
        if not (platform.is_level and previous_z >= resting_z - CONTACT_TOLERANCE
                and z < resting_z):
            return False
        x, y = platform.coordinates_of((*self._brick[:2], top_z))
        if not self._shape.contains(x, y):
            return False
        self._place = Pose2D(x, y, self._yaw - platform.hinge_yaw)
        self._slide_velocity = (0.0, 0.0)
        self.state = BrickState.RIDING
        self._follow(platform)
        return True

    def _slide(self, platform: Platform) -> None:
        axis_x, axis_y, normal = platform.axes
        before = x, y, yaw = self._place
        velocity_x, velocity_y = self._slide_velocity
        gravity_x = -self._gravity * axis_x[2]
        gravity_y = -self._gravity * axis_y[2]
        dt = self._dt
        self._place = Pose2D(x + velocity_x * dt + 0.5 * gravity_x * dt * dt,
                             y + velocity_y * dt + 0.5 * gravity_y * dt * dt, yaw)
        self._slide_velocity = (velocity_x + gravity_x * dt, velocity_y + gravity_y * dt)
        self._follow(platform)
        # A point brick that has landed exactly on the rim may count as clear by a rounding error.
        has_slid_off = self._place != before and self._shape.is_clear_of(
            *self._place, *self.size[:2])
        if has_slid_off or normal[2] <= MIN_NORMAL_Z:
            self.state = BrickState.FLOATING

    def _follow(self, platform: Platform) -> None:
        x, y, yaw = self._place
        self._brick = platform.pose.transform((x, y, self.thickness + self._half_height))
        self._yaw = platform.hinge_yaw + yaw
