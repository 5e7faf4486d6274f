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
"""Test World with plain examples, starting with the members that the assignment requires."""

import inspect
from math import inf, nan, pi

import pytest
from turtle_brick.core.geometry import from_pitch, IDENTITY, Pose
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.physics import BrickState, World


def tilted(angle):
    return Platform(Pose((0.0, 0.0, 1.0), from_pitch(angle)))


def riding(x=0.0):
    world = World((x, 0.0, 1.1), 9.81, 0.5, 0.004)
    world.platform = tilted(0.0)
    world.release()
    while world.state is BrickState.FALLING:
        world.step()
    assert world.state is BrickState.RIDING
    return world


def test_init():
    world = World(brick=(1.0, 2.0, 3.0), gravity=9.81, radius=0.5, dt=0.004)
    assert (world.brick, world.state) == ((1.0, 2.0, 3.0), BrickState.HOVERING)


def test_brick_getter():
    world = World((1.0, 2.0, 3.0), 9.81, 0.5, 0.004)
    assert world.brick == (1.0, 2.0, 3.0)


def test_brick_setter():
    world = World((1.0, 2.0, 3.0), 9.81, 0.5, 0.004)
    world.drop()
    world.brick = (4.0, 5.0, 6.0)
    assert (world.brick, world.state) == ((4.0, 5.0, 6.0), BrickState.HOVERING)


def test_drop():
    world = World((0.0, 0.0, 10.0), gravity=10.0, radius=0.5, dt=0.1)
    world.drop()
    assert world.brick == pytest.approx((0.0, 0.0, 9.95))
    world.drop()
    assert world.brick == pytest.approx((0.0, 0.0, 9.8))


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
def test_definition_of_the_assignment(member, signature, docstring):
    assert inspect.getdoc(World).startswith('Keep track of the physics of the world.\n')
    assert str(inspect.signature(member)) == signature
    assert ' '.join(member.__doc__.split()).rstrip('.') == docstring


@pytest.mark.parametrize('location, reason', [
    ((0.0, nan, 1.0), 'nan'), ((-inf, 0.0, 1.0), 'inf'), ((0.0, 0.0, inf), 'inf'),
    ((1.0, 1.0, 0.09), 'below the ground'), ((-1e19, 1.0, 1.0), 'too far away')])
def test_invalid_location_is_refused(location, reason):
    world = World((1.0, 1.0, 3.0), 9.81, 0.5, 0.004)
    world.size = (0.4, 0.2, 0.2)
    with pytest.raises(ValueError, match=reason):
        world.brick = location
    assert (world.brick, world.state) == ((1.0, 1.0, 3.0), BrickState.HOVERING)
    world.brick = (1.0, 1.0, 0.1)  # The brick may be placed on the ground.


def test_release_starts_the_fall_with_the_next_step():
    world = World((0.0, 0.0, 10.0), gravity=10.0, radius=0.5, dt=0.1)
    world.step()
    assert (world.brick, world.state) == ((0.0, 0.0, 10.0), BrickState.HOVERING)
    world.release()
    assert (world.brick, world.state) == ((0.0, 0.0, 10.0), BrickState.FALLING)
    world.step()
    assert world.brick == pytest.approx((0.0, 0.0, 9.95))


def test_brick_lands_on_the_platform():
    world = riding(0.1)
    assert world.brick == pytest.approx((0.1, 0.0, 1.0))
    assert world.pose_on_platform.position == pytest.approx((0.1, 0.0, 0.0))


def test_brick_slides_off_a_tilted_platform_and_floats():
    world = riding()
    world.platform = tilted(0.5)
    while world.state is BrickState.RIDING:
        world.step()
    x, y, z = world.brick
    assert x > 0.4 and y == pytest.approx(0.0) and z < 0.8
    world.step()
    assert (world.brick, world.state) == ((x, y, z), BrickState.FLOATING)


@pytest.mark.parametrize('angle, state', [
    (pi / 2, BrickState.FLOATING), (-pi / 2, BrickState.FLOATING), (2.0, BrickState.FLOATING),
    (-pi, BrickState.FLOATING), (pi / 2 - 1e-3, BrickState.RIDING),
    (-pi / 2 + 1e-3, BrickState.RIDING)])
def test_platform_tilted_by_90_degrees_loses_the_brick(angle, state):
    world = riding(0.1)
    world.platform = tilted(angle)
    world.step()
    assert world.state is state


def test_riding_brick_stays_in_place_without_a_platform():
    world = riding(0.1)
    before = world.brick
    world.platform = None
    world.step()
    assert (world.brick, world.state, world.pose_on_platform) == (before, BrickState.RIDING, None)
    world.platform = Platform(Pose((7.0, 0.0, 1.0), IDENTITY))
    world.step()
    assert world.brick == pytest.approx((7.1, 0.0, 1.0))


def test_brick_has_the_inclination_of_the_latest_platform():
    world = World((5.0, 5.0, 3.0), 9.81, 0.5, 0.004)
    assert world.orientation == IDENTITY
    world.platform = tilted(0.5)
    world.platform = None
    assert world.orientation == pytest.approx(from_pitch(0.5))


def test_release_is_refused_while_the_brick_falls_rides_or_lies_on_the_ground():
    world = World((5.0, 5.0, 0.1), 9.81, 0.5, 0.004)
    world.size = (0.4, 0.2, 0.12)
    world.release()
    with pytest.raises(ValueError, match='^the brick is already falling$'):
        world.release()
    while world.state is BrickState.FALLING:
        world.step()
    with pytest.raises(ValueError, match='^the brick is on the ground, so place it first$'):
        world.release()
    world.drop()
    assert (world.brick, world.state) == ((5.0, 5.0, 0.06), BrickState.GROUNDED)
    with pytest.raises(ValueError, match='^the brick is on the platform, so tilt the platform '):
        riding().release()
