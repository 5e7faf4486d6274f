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
The robot's dimensions (m), which follow from the four configured ones.

The robot stands on z = 0. From the ground up, it consists of:

- the wheel;
- the stem above it, which turns about the vertical axis and holds the wheel;
- the cube of base_link;
- the post, fixed on the cube;
- the platform, hinged on the post's top at the center of its base.

The platform may turn over: all of it is within `Chassis.reach` of the hinge, and the cube is below
that sphere. urdf/turtle.urdf.xacro derives the same dimensions by the same rules.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

MIN_ROOM = 0.05
"""Least height (m) between the wheel's top and the turning platform: neck, cube and clearance."""

LEAST_PROPORTION, GREATEST_PROPORTION = 1 / 3, 20
"""The platform's radius may be this many times that of the wheel."""


def least_room(platform_radius: float, wheel_radius: float) -> float:
    """
    Return the least `Chassis.room` (m) that leaves a visible cube.

    :param platform_radius: the platform's radius (m)
    :param wheel_radius: the wheel's radius (m)
    :return: The least room: the cube's side is then at least half the wheel's radius and a twelfth
        of the platform's.
    """
    return max(MIN_ROOM, wheel_radius, platform_radius / 5)


@dataclass(frozen=True)
class Chassis:
    """The robot's dimensions (m); heights are above the ground, in base_link."""

    platform_height: float
    """The level platform's top."""
    platform_radius: float
    """The platform's radius."""
    platform_thickness: float
    """The platform's thickness."""
    wheel_radius: float
    """The wheel's radius, and the height of its axle."""
    wheel_width: float
    """The wheel's extent along its axle."""
    wheel_top: float
    """The wheel's highest point."""
    hinge_height: float
    """The platform's hinge, at the center of its base and on the post's top."""
    reach: float
    """The distance of the platform's farthest point from the hinge."""
    room: float
    """The height between the wheel's top and the lowest point of the turning platform."""
    neck: float
    """The height between the wheel's top and the cube."""
    cube_side: float
    """The side of base_link's cube."""
    cube_bottom: float
    """The cube's underside, where the stem begins."""
    cube_top: float
    """The cube's upper side, where the post begins."""
    stem_length: float
    """The length of the stem's cylinder, which ends a little above the wheel."""
    stem_radius: float
    """The radius of the stem's cylinder."""
    post_length: float
    """The length of the post."""
    post_radius: float
    """The radius of the post."""

    @classmethod
    def from_dimensions(
        cls,
        platform_height: float,
        platform_radius: float,
        platform_thickness: float,
        wheel_radius: float,
    ) -> Chassis:
        """
        Derive the dimensions from the four configured ones.

        :param platform_height: the level platform's top above the ground (m)
        :param platform_radius: the platform's radius (m)
        :param platform_thickness: the platform's thickness (m)
        :param wheel_radius: the wheel's radius (m)
        :return: The dimensions of that robot.
        :raises ValueError: The platform would hit base_link when it turns over, or base_link would
            be out of proportion.
        """
        least, greatest = LEAST_PROPORTION * wheel_radius, GREATEST_PROPORTION * wheel_radius
        if not least <= platform_radius <= greatest:
            raise ValueError(
                f'platform_radius {platform_radius:g} m is out of proportion: with wheel_radius '
                f'{wheel_radius:g} m it must be from {least:g} to {greatest:g} m')
        hinge_height = platform_height - platform_thickness
        reach = math.hypot(platform_radius, platform_thickness)
        wheel_top = 2 * wheel_radius
        room = hinge_height - reach - wheel_top
        min_room = least_room(platform_radius, wheel_radius)
        if room < min_room:
            raise ValueError(
                f'platform_height {platform_height:g} m is too low for a platform that turns over '
                f'freely: with platform_radius {platform_radius:g} m, platform_thickness '
                f'{platform_thickness:g} m and wheel_radius {wheel_radius:g} m it must be at '
                f'least {wheel_top + reach + platform_thickness + min_room:g} m')
        cube_side = min(0.52 * room, 1.8 * wheel_radius, 1.5 * platform_radius)
        neck = 0.5 * cube_side
        cube_bottom = wheel_top + neck
        cube_top = cube_bottom + cube_side
        return cls(
            platform_height=platform_height,
            platform_radius=platform_radius,
            platform_thickness=platform_thickness,
            wheel_radius=wheel_radius,
            wheel_width=0.3 * wheel_radius,
            wheel_top=wheel_top,
            hinge_height=hinge_height,
            reach=reach,
            room=room,
            neck=neck,
            cube_side=cube_side,
            cube_bottom=cube_bottom,
            cube_top=cube_top,
            stem_length=0.8 * neck,
            stem_radius=0.16 * cube_side,
            post_length=hinge_height - cube_top,
            post_radius=0.1 * cube_side)
