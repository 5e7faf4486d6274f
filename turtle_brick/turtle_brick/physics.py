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
The physics of the arena: a brick that hovers, falls, rides on a platform, slides off and floats.

A fall is free fall in closed form, z = z0 - g t^2 / 2 of the whole time since the release, not a
sum of steps; a slide is that of a body on a smooth incline, with the constant acceleration
g sin(angle) over each step.

The brick is a box; its location is its center, and it touches something with its bottom, half its
height below. It is inclined like the platform at all times, or as the platform was seen last; it
is flat only where no platform was ever seen.
"""

from __future__ import annotations

from enum import Enum
from math import hypot, isfinite
from typing import TYPE_CHECKING

from turtle_brick.core.geometry import (distance_to_rectangle, from_yaw, multiply, Pose,
                                        Quaternion, Vector)
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS
if TYPE_CHECKING:
    # No more than the names of the numbers: physics reads no configuration.
    from turtle_brick.core.parameters import ArenaParameters

STEP_NS = 4_000_000
"""Time (ns) of one step in the arena: 250 Hz."""

CONTACT_TOLERANCE = 1e-9
"""How far (m) below a platform's top the brick's bottom may be and still count as above it."""

VERTICAL = 1e-9
"""Upward part of a platform's normal at and below which the platform is tilted by 90 degrees."""


class Phase(Enum):
    """What the brick does."""

    HOVERING = 'hovering'
    FALLING = 'falling'
    RIDING = 'riding'
    FLOATING = 'floating'
    GROUNDED = 'grounded'


class World:
    """
    Keep track of the physics of the world.

    The four arguments alone make a brick that is a point and a platform of no thickness, which is
    nowhere until it is set: `size`, `thickness` and `platform` say more.

    Like the setter of `brick`, the constructor raises ValueError if the location is not three
    finite numbers, or so low that the brick's bottom would be under the ground.
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
        self._radius = radius
        self._dt = dt
        self.size: Vector = (0.0, 0.0, 0.0)
        """Length, width and height (m) of the brick; a point unless set."""
        self.thickness = 0.0
        """Distance (m) from the platform's frame to its top, where bricks land; 0 unless set."""
        self._platform: Platform | None = None
        self._last_platform: Platform | None = None
        """As it was seen last."""
        self._release_height = 0.0
        self._steps_fallen = 0
        """Steps since the beginning of the fall, which is the step after a release."""
        self._place: tuple[float, float] = (0.0, 0.0)
        """Where the brick is on the platform, along its x and y (m)."""
        self._speed: tuple[float, float] = (0.0, 0.0)
        """How fast it slides there (m/s)."""
        self._relative_yaw = 0.0
        """Heading of the brick relative to the hinge (rad)."""
        self._yaw = 0.0
        """Heading of the brick in the world (rad)."""
        self._phase = Phase.HOVERING
        self.brick = brick

    @classmethod
    def from_parameters(cls, parameters: ArenaParameters) -> World:
        """Return the world with these parameters and STEP_NS as its timestep."""
        world = cls(parameters.brick_start, parameters.gravity_accel, parameters.platform_radius,
                    STEP_NS * SECONDS_PER_NS)
        world.size = parameters.brick_size
        world.thickness = parameters.platform_thickness
        return world

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
        if not (isfinite(x) and isfinite(y) and isfinite(z)):
            raise ValueError(f'the location ({x:g}, {y:g}, {z:g}) is not finite')
        height = self.size[2]
        if z < height / 2.0:
            below = f', {height / 2.0:g} m below its center,' if height else ''
            raise ValueError(
                f'at z = {z:g} m the bottom of the brick{below} would be under the ground')
        self._brick: Vector = (x, y, z)
        self._phase = Phase.HOVERING
        self._yaw = 0.0

    def drop(self):
        """Update the brick's location by having it fall in gravity for one timestep."""
        if self._phase in (Phase.HOVERING, Phase.FLOATING):
            self.release()
            self._steps_fallen = 0
        if self._phase is Phase.FALLING:
            self._fall()

    @property
    def platform(self) -> Platform | None:
        """Where the platform is in the world; None if it is not known."""
        return self._platform

    @platform.setter
    def platform(self, platform: Platform | None) -> None:
        self._platform = platform
        self._last_platform = platform or self._last_platform

    @property
    def phase(self) -> Phase:
        """Get what the brick does."""
        return self._phase

    @property
    def orientation(self) -> Quaternion:
        """
        Orientation of the brick in the world.

        Its inclination is the platform's at all times; its heading is its own, and turns with the
        platform while the brick is on it.
        """
        platform = self._last_platform
        if platform is None:
            return from_yaw(self._yaw)
        return multiply(platform.pose.orientation, from_yaw(self._yaw - platform.hinge_yaw))

    @property
    def pose_on_platform(self) -> Pose | None:
        """
        Pose of the brick in the platform's frame while it rides on a platform in sight, else None.

        It holds also where the platform's own pose is known later or better than here.
        """
        if self._phase is not Phase.RIDING or self._platform is None:
            return None
        u, v = self._place
        return Pose((u, v, self._height_on_platform), from_yaw(self._relative_yaw))

    def release(self) -> None:
        """
        Let the brick go: at the next step, which shows it still at its place, its fall begins.

        :raises ValueError: it is neither hovering nor floating; the text says what it does instead
        """
        if self._phase is Phase.FALLING:
            raise ValueError('the brick is already falling')
        if self._phase is Phase.RIDING:
            raise ValueError('the brick is already on the platform')
        if self._phase is Phase.GROUNDED:
            raise ValueError('the brick is on the ground: place it first')
        self._phase = Phase.FALLING
        self._release_height = self._brick[2]
        self._steps_fallen = -1

    def step(self) -> None:
        """Advance by one timestep: a falling brick drops, one on the platform rides with it."""
        if self._phase is Phase.FALLING:
            self.drop()
        elif self._phase is Phase.RIDING and self._platform is not None:
            self._ride(self._platform)

    def _fall(self) -> None:
        """Fall for one timestep, onto the platform or the ground if they are in the way."""
        x, y, previous = self._brick
        self._steps_fallen += 1
        time = self._steps_fallen * self._dt
        z = self._release_height - 0.5 * self._gravity * time * time
        half_height = self.size[2] / 2.0
        platform = self._platform
        if platform is not None and platform.is_level:
            top_x, top_y, top_z = platform.point(0.0, 0.0, self.thickness)
            rest = top_z + half_height
            if (previous >= rest - CONTACT_TOLERANCE and z < rest
                    and hypot(x - top_x, y - top_y) <= self._radius):
                self._land(platform, (x, y, top_z))
                return
        if z <= half_height:
            z = half_height
            self._phase = Phase.GROUNDED
        self._brick = (x, y, z)

    def _land(self, platform: Platform, contact: Vector) -> None:
        """Come to rest on the platform: from here on the place on it is what counts."""
        self._place = platform.coordinates_of(contact)
        self._speed = (0.0, 0.0)
        self._relative_yaw = self._yaw - platform.hinge_yaw
        self._phase = Phase.RIDING
        self._carry(platform)

    def _ride(self, platform: Platform) -> None:
        """Slide along the platform for one timestep and go where it goes."""
        ex, ey, normal = platform.axes
        u, v = place = self._place
        speed_u, speed_v = self._speed
        # Gravity along the platform's x and y, g sin(angle) in all.
        pull_u = -self._gravity * ex[2]
        pull_v = -self._gravity * ey[2]
        dt = self._dt
        self._place = (u + speed_u * dt + 0.5 * pull_u * dt * dt,
                       v + speed_v * dt + 0.5 * pull_v * dt * dt)
        self._speed = (speed_u + pull_u * dt, speed_v + pull_v * dt)
        self._carry(platform)
        if normal[2] <= VERTICAL or self._place != place and self._is_clear():
            self._phase = Phase.FLOATING

    def _carry(self, platform: Platform) -> None:
        """Set the brick's location and heading in the world from its place on the platform."""
        self._brick = platform.point(*self._place, self._height_on_platform)
        self._yaw = platform.hinge_yaw + self._relative_yaw

    @property
    def _height_on_platform(self) -> float:
        """Height (m) of a riding brick's center in the platform's frame."""
        return self.thickness + self.size[2] / 2.0

    def _is_clear(self) -> bool:
        """Tell whether no point of the brick's bottom is within the platform's radius."""
        length, width, _ = self.size
        return distance_to_rectangle(
            *self._place, self._relative_yaw, length, width) > self._radius
