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
Which dimensions (m) make a robot whose platform can turn over.

From the ground up, the robot consists of the wheel, the stem that holds it, the cube of base_link,
the post, and the platform, hinged on the post's top at the center of its base. However the
platform is turned, it stays within a sphere about the hinge, and the cube is below that sphere.
urdf/turtle.urdf.xacro has the same rules, and derives the rest of the dimensions.
"""

from math import hypot

MIN_ROOM = 0.05
"""Least height (m) between the wheel's top and the turning platform: neck, cube and clearance."""

LEAST_PROPORTION, GREATEST_PROPORTION = 1 / 3, 20
"""The platform's radius may be this many times that of the wheel."""


def least_height(platform_radius: float, platform_thickness: float, wheel_radius: float) -> float:
    """
    Return the least height (m) of the platform's top that leaves room for a visible cube.

    The cube's side is then at least half the wheel's radius and a twelfth of the platform's.
    """
    return (2 * wheel_radius + hypot(platform_radius, platform_thickness) + platform_thickness
            + max(MIN_ROOM, wheel_radius, platform_radius / 5))


def check_dimensions(platform_height: float, platform_radius: float, platform_thickness: float,
                     wheel_radius: float) -> None:
    """
    Check that there can be such a robot.

    :raises ValueError: The platform would hit base_link when it turns over, or base_link would be
        out of proportion.
    """
    least, greatest = LEAST_PROPORTION * wheel_radius, GREATEST_PROPORTION * wheel_radius
    if not least <= platform_radius <= greatest:
        raise ValueError(
            f'platform_radius {platform_radius:g} m is out of proportion: with wheel_radius '
            f'{wheel_radius:g} m it must be from {least:g} to {greatest:g} m')
    least = least_height(platform_radius, platform_thickness, wheel_radius)
    if platform_height < least:
        raise ValueError(
            f'platform_height {platform_height:g} m is too low for a platform that turns over '
            f'freely: with platform_radius {platform_radius:g} m, platform_thickness '
            f'{platform_thickness:g} m and wheel_radius {wheel_radius:g} m it must be at '
            f'least {least:g} m')
