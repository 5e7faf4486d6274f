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

"""Worlds with a brick and a platform, and where things must be in them, reckoned by hand."""

from math import cos, sin

from turtle_brick.core.geometry import Pose
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.physics import Phase, World

GRAVITY = 9.81
RADIUS = 0.5
DT = 0.004
SIZE = (0.4, 0.2, 0.12)
LIFT = SIZE[2] / 2.0
THICKNESS = 0.04
HINGE = 3.0
TOP = HINGE + THICKNESS


def axes_of(yaw, tilt):
    """Return the axes of a platform in the world: turned to the left, then lowered in front."""
    return ((cos(tilt) * cos(yaw), cos(tilt) * sin(yaw), -sin(tilt)),
            (-sin(yaw), cos(yaw), 0.0),
            (sin(tilt) * cos(yaw), sin(tilt) * sin(yaw), cos(tilt)))


def platform_at(x=0.0, y=0.0, yaw=0.0, tilt=0.0):
    """Return a platform; its frame is at the hinge."""
    a, b = yaw / 2.0, tilt / 2.0
    turn = (-sin(a) * sin(b), cos(a) * sin(b), sin(a) * cos(b), cos(a) * cos(b))
    return Platform(Pose((x, y, HINGE), turn))


def on_platform(place, x, y, yaw, tilt):
    """Return the world's coordinates of the center of a brick at a place on a platform."""
    ex, ey, normal = axes_of(yaw, tilt)
    (u, v), w = place, THICKNESS + LIFT
    return tuple(origin + u * a + v * b + w * c
                 for origin, a, b, c in zip((x, y, HINGE), ex, ey, normal))


def upright_of(quaternion):
    """Return the direction of a frame's z axis: the third column of its rotation matrix."""
    x, y, z, w = quaternion
    return (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))


def gap(one, other):
    """Return the largest difference between two tuples of numbers, of equal length."""
    assert len(one) == len(other)
    return max(abs(a - b) for a, b in zip(one, other))


def brick_in(brick, gravity=GRAVITY, dt=DT, radius=RADIUS, platform=None):
    """Return a world with a brick that has a size, over a platform that has a thickness."""
    world = World(brick, gravity, radius, dt)
    world.size, world.thickness = SIZE, THICKNESS
    world.platform = platform
    return world


def riding(place=(0.0, 0.0), x=0.0, y=0.0, yaw=0.0, **keywords):
    """Return a world whose brick has come to rest on a level platform, with heading 0."""
    above = on_platform(place, x, y, yaw, 0.0)
    world = brick_in((above[0], above[1], above[2] + 0.02), platform=platform_at(x, y, yaw),
                     **keywords)
    world.release()
    while world.phase is Phase.FALLING:
        world.step()
    assert world.phase is Phase.RIDING
    return world


def advance(world, phase, limit=200_000):
    """Let time pass as long as the brick is in a phase; return the locations on the way."""
    locations = [world.brick]
    while world.phase is phase:
        assert len(locations) < limit
        world.step()
        locations.append(world.brick)
    return locations
