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
World, by examples and by its laws under random input: closed forms and invariants.

What a platform's axes are, how far a rectangle is from a point and where a brick must be are
computed here by hand or by the referee, not by the modules under test.
"""

import inspect
from math import cos, floor, hypot, inf, nan, pi, sin, sqrt

from hypothesis import assume, given
from hypothesis import strategies as st
from laws import law
import numpy
import pytest
from turtle_brick.core.geometry import IDENTITY, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.tilting_platform import LEVEL_TOLERANCE, Platform
from turtle_brick.physics import Phase, World
from turtle_referee.graph_client.geometry import (distance_to_rectangle, Pose as Frame,
                                                  pose as frame, turn)

GRAVITY = 9.81
RADIUS = 0.5
DT = 0.004
SIZE = (0.4, 0.2, 0.12)
LIFT = SIZE[2] / 2.0
THICKNESS = 0.04
HINGE = 3.0
TOP = HINGE + THICKNESS

VISIBLY_TILTED = 0.002
"""Angle (rad) from which a platform catches nothing: a millimeter at its rim."""

headings = st.floats(-pi, pi)
coordinates = st.floats(-20.0, 20.0)
gravities = st.floats(0.5, 30.0)
time_steps = st.sampled_from((0.004, 0.01, 0.0333))
tilts = st.builds(lambda angle, sign: sign * angle,
                  st.floats(0.1, 1.5), st.sampled_from((1.0, -1.0)))


@st.composite
def discs(draw, radius):
    """Draw a point within a radius of the origin."""
    distance, angle = radius * sqrt(draw(st.floats(0.0, 0.999))), draw(headings)
    return distance * cos(angle), distance * sin(angle)


def frame_at(x, y, yaw, tilt):
    """Return the frame of a platform: turned to the left, then lowered in front."""
    return Frame((x, y, HINGE), turn((0.0, 0.0, 1.0), yaw) @ turn((0.0, 1.0, 0.0), tilt))


def on_platform(place, *where):
    """Return the world's coordinates of the center of a brick at a place on a platform."""
    return frame_at(*where).transform((*place, THICKNESS + LIFT))


def turned(yaw, tilt, right):
    """Return the axes of a brick on a platform, turned by so much to its right."""
    return frame_at(0.0, 0.0, yaw, tilt).axes @ turn((0.0, 0.0, 1.0), -right)


def axes_of(quaternion):
    """Return the axes that an orientation stands for."""
    return frame((0.0, 0.0, 0.0), quaternion).axes


def gap(one, other):
    """Return the largest difference between the numbers of two vectors or matrices."""
    return numpy.abs(numpy.subtract(one, other)).max()


def platform_at(x=0.0, y=0.0, yaw=0.0, tilt=0.0):
    """Return a platform; its frame is at the hinge."""
    a, b = yaw / 2.0, tilt / 2.0
    turn = (-sin(a) * sin(b), cos(a) * sin(b), sin(a) * cos(b), cos(a) * cos(b))
    return Platform(Pose((x, y, HINGE), turn))


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


# ------------------------------------------------------------------------------------- examples

@pytest.mark.parametrize(('member', 'signature', 'docstring'), [
    (World.__init__, '(self, brick, gravity, radius, dt)',
     'Initialize the world. Args: brick - The (x,y,z) location of the brick gravity - the '
     'acceleration due to gravity in m/s^2 radius - the radius of the platform dt - timestep in '
     'seconds of the physics simulation'),
    (World.brick.fget, '(self)',
     "Get the brick's location. Return: (x,y,z) location of the brick"),
    (World.brick.fset, '(self, location)',
     "Set the brick's location. Args: location - the (x,y,z) location of the brick"),
    (World.drop, '(self)',
     "Update the brick's location by having it fall in gravity for one timestep"),
])
def test_definition_is_that_of_the_assignment(member, signature, docstring):
    assert inspect.getdoc(World).startswith('Keep track of the physics of the world.\n')
    assert str(inspect.signature(member)) == signature
    assert ' '.join(member.__doc__.split()).rstrip('.') == docstring


def test_init_makes_a_point_over_a_sheet_that_is_nowhere_and_the_point_hovers():
    world = World((0.1, 0.0, 2.0), 9.81, 0.5, 0.004)
    assert (world.size, world.thickness, world.platform) == ((0.0, 0.0, 0.0), 0.0, None)
    world.step()
    assert (world.brick, world.phase) == ((0.1, 0.0, 2.0), Phase.HOVERING)
    world.platform = Platform(Pose((0.0, 0.0, 1.0), IDENTITY))
    world.release()
    advance(world, Phase.FALLING)
    assert world.phase is Phase.RIDING
    assert gap(world.brick, (0.1, 0.0, 1.0)) <= 1e-12


def test_parameters_make_a_world_of_250_steps_per_second():
    parameters = load()
    world = World.from_parameters(parameters)
    assert (world.brick, world.size) == (parameters.brick_start, parameters.brick_size)
    assert world.thickness == parameters.platform_thickness
    world.drop()
    fallen = parameters.brick_start[2] - world.brick[2]
    assert fallen == pytest.approx(parameters.gravity_accel / 2 / 250 ** 2)


def test_places_and_releases_that_cannot_be_are_refused():
    """The sentence says why, and nothing changes."""
    world = brick_in((1.0, 1.0, 3.0), platform=platform_at())
    for location, word in (((0.0, nan, 1.0), 'nan'), ((-inf, 0.0, 1.0), 'inf'),
                           ((0.0, 0.0, inf), 'inf'),
                           ((1.0, 1.0, 0.99 * LIFT), 'under the ground')):
        with pytest.raises(ValueError, match=word):
            world.brick = location
        assert (world.brick, world.phase) == ((1.0, 1.0, 3.0), Phase.HOVERING)
    world.release()
    for phase, why in ((Phase.FALLING, 'already falling$'),
                       (Phase.GROUNDED, 'on the ground: place it first$')):
        with pytest.raises(ValueError, match=why):
            world.release()
        assert world.phase is phase
        advance(world, Phase.FALLING)
    world.drop()
    assert world.phase is Phase.GROUNDED
    with pytest.raises(ValueError, match='on the platform$'):
        riding().release()
    world.brick = (1.0, 1.0, LIFT)  # It may lie.


def test_brick_rides_on_when_the_platform_is_out_of_sight():
    world = riding((0.1, 0.0))
    before = world.brick
    world.platform = None
    world.step()
    assert (world.brick, world.phase, world.pose_on_platform) == (before, Phase.RIDING, None)
    world.platform = platform_at(7.0)
    world.step()
    assert gap(world.brick, on_platform((0.1, 0.0), 7.0, 0.0, 0.0, 0.0)) <= 1e-9


@pytest.mark.parametrize('steps', (1, 7, 250, 9_991))
def test_drop_is_a_step_of_the_closed_form_at_any_timestep(steps):
    world = World((1.5, -2.5, 10.0), 9.81, 0.5, 1.0 / steps)
    for step in range(1, steps + 1):
        world.drop()
        assert gap(world.brick, (1.5, -2.5, 10.0 - 9.81 / 2.0 * (step / steps) ** 2)) <= 1e-9


@pytest.mark.parametrize('x, z, phase', [
    (0.1, TOP + LIFT, Phase.RIDING), (0.1, TOP + LIFT + 1e-10, Phase.RIDING),
    (0.1, TOP + LIFT - 0.9e-9, Phase.RIDING), (0.1, TOP + LIFT - 2e-9, Phase.GROUNDED),
    (RADIUS, 5.0, Phase.RIDING), (RADIUS + 1e-9, 5.0, Phase.GROUNDED),
    (0.1, LIFT, Phase.GROUNDED)])
def test_edge_and_top_of_the_platform_carry_and_so_does_the_ground(x, z, phase):
    world = brick_in((x, 0.0, z), platform=platform_at())
    world.release()
    advance(world, Phase.FALLING)
    assert world.phase is phase
    assert gap(world.brick, (x, 0.0, TOP + LIFT if phase is Phase.RIDING else LIFT)) <= 1e-12


@pytest.mark.parametrize('angle, phase', [
    (pi / 2, Phase.FLOATING), (-pi / 2, Phase.FLOATING), (2.0, Phase.FLOATING),
    (-pi, Phase.FLOATING), (pi / 2 - 1e-3, Phase.RIDING), (-pi / 2 + 1e-3, Phase.RIDING)])
def test_platform_tilted_by_90_degrees_lets_go(angle, phase):
    world = riding((0.1, -0.05), yaw=1.0)
    world.platform = platform_at(yaw=1.0, tilt=angle)
    world.step()
    assert world.phase is phase


@law(15)
@given(yaw=headings, tilt=st.floats(-0.999, 0.999) | st.sampled_from((-0.999, 0.999)))
def test_platform_is_level_within_the_tolerance_and_tells_places_at_any_tilt(yaw, tilt):
    assert platform_at(yaw=yaw, tilt=tilt * LEVEL_TOLERANCE).is_level
    for over in (pi, 0.01, 1.001 * LEVEL_TOLERANCE):
        assert not platform_at(yaw=yaw, tilt=over).is_level
    leaning = platform_at(1.0, 2.0, yaw, tilt)
    assert gap(leaning.coordinates_of(leaning.point(0.3, -0.2, 0.5)), (0.3, -0.2)) <= 1e-9


# ----------------------------------------------------------------------------------------- laws

@law(40)
@given(place=discs(2.0), yaw=headings, height=st.floats(1e-3, 5.0), radius=st.floats(0.05, 2.0),
       gravity=gravities, dt=time_steps, late=st.integers(-3, 3) | st.integers(0, 100),
       comes=st.booleans(), away=st.sampled_from((None, 'elsewhere', VISIBLY_TILTED, pi)) | tilts)
def test_brick_lands_if_the_platform_is_there_in_the_step_that_leads_below_its_top(
        place, yaw, height, radius, gravity, dt, late, comes, away):
    """
    Within the radius of its axis, and level: before and after, it may be anywhere.

    A brick that has passed is never caught.
    """
    crossing = floor(sqrt(2.0 * height / gravity) / dt) + 1
    after, before = (0.5 * gravity * (step * dt) ** 2 for step in (crossing, crossing - 1))
    assume(before < height - 1e-6 and height + 1e-6 < after)
    (u, v), x, y = place, 3.0, -2.0
    assume(abs(hypot(u, v) - radius) > 1e-9)
    here = platform_at(x, y, yaw)
    if away is not None:
        away = platform_at(x + 5.0, y) if away == 'elsewhere' else platform_at(x, y, yaw, away)
    world = brick_in((x + u, y + v, TOP + LIFT + height), gravity, dt, radius,
                     away if comes else here)
    world.release()
    world.step()  # the beginning
    step = 0
    while world.phase is Phase.FALLING:
        course = TOP + LIFT + height - 0.5 * gravity * (step * dt) ** 2
        assert gap(world.brick, (x + u, y + v, course)) <= 1e-9
        step += 1
        if step == max(crossing + late, 1):
            world.platform = here if comes else away
        world.step()
    if comes == (late <= 0) and hypot(u, v) < radius:
        assert (world.phase, step) == (Phase.RIDING, crossing)
        assert gap(world.brick, (x + u, y + v, TOP + LIFT)) <= 1e-12
    else:
        assert world.phase is Phase.GROUNDED
        assert gap(world.brick, (x + u, y + v, LIFT)) <= 1e-12


@law(30)
@given(place=discs(RADIUS), yaw=headings, gravity=gravities, dt=time_steps,
       program=st.lists(st.tuples(st.floats(-1.5, 1.5) | st.just(0.0), st.integers(1, 40),
                                  coordinates, coordinates, headings),
                        min_size=1, max_size=5))
def test_slide_on_a_platform_that_moves_in_every_way(place, yaw, gravity, dt, program):
    """
    Gravity's pull along the platform's x is all there is in its plane; the brick turns with it.

    A change of angle keeps the speed, also a change to level; driving and turning have no force.
    Once the trailing edge has cleared, the brick floats. Placed in the air it is still inclined
    like the platform, with a heading of its own.
    """
    world = riding(place, yaw=yaw, gravity=gravity, dt=dt)
    (u, v), speed = place, 0.0
    for tilt, steps, x, y, heading in program:
        world.platform = platform_at(x, y, heading, tilt)
        pull = gravity * sin(tilt)
        for _ in range(steps):
            if world.phase is not Phase.RIDING:
                break
            world.step()
            u, speed = u + speed * dt + 0.5 * pull * dt ** 2, speed + pull * dt
            assert gap(world.brick, on_platform((u, v), x, y, heading, tilt)) <= 1e-9
            assert gap(axes_of(world.orientation), turned(heading, tilt, yaw)) <= 1e-9
            if world.pose_on_platform:
                seen = world.platform.pose.compose(world.pose_on_platform)
                assert gap(seen.position, world.brick) <= 1e-9
                assert gap(axes_of(seen.orientation), turned(heading, tilt, yaw)) <= 1e-9
            # The brick had a heading of 0 in the world when it landed.
            distance = distance_to_rectangle((u, v), -yaw, SIZE[:2])
            if abs(distance - RADIUS) > 1e-9:
                assert world.phase is (Phase.FLOATING if distance > RADIUS else Phase.RIDING)
    world.brick = place = (x, y, 9.0)
    assert (world.brick, world.phase, world.pose_on_platform) == (place, Phase.HOVERING, None)
    assert gap(axes_of(world.orientation), turned(heading, tilt, heading)) <= 1e-9


@law(10)
@given(roll=tilts)
def test_slide_on_a_platform_that_leans_sideways(roll):
    """Nothing here leans it so, but TF may say that it does."""
    world, axis = riding(), (1.0, 0.0, 0.0)
    world.platform = Platform(Pose((0.0, 0.0, HINGE), (sin(roll / 2), 0.0, 0.0, cos(roll / 2))))
    for step in range(1, 6):
        world.step()
        v = -0.5 * GRAVITY * sin(roll) * (step * DT) ** 2
        leaning = Frame((0.0, 0.0, HINGE), turn(axis, roll))
        assert gap(world.brick, leaning.transform((0.0, v, THICKNESS + LIFT))) <= 1e-12
