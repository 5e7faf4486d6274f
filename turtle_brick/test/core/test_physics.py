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


"""Every member of World, by examples."""

import inspect
from math import inf, nan, pi

import pytest
from turtle_brick.core.geometry import IDENTITY, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.physics import Phase, World
from worlds import advance, brick_in, gap, LIFT, platform_at, RADIUS, riding, SIZE, THICKNESS, TOP


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


def test_init_refuses_what_cannot_be():
    """The sentence names what and which, and has no more digits than one reads."""
    for name in ('gravity', 'radius', 'dt'):
        for value in (nan, inf, -inf, -1e-9, '1', None, True, (1.0,)):
            with pytest.raises(ValueError, match=f'^{name} is .{{1,20}}, but must be') as refusal:
                World(**{'brick': (1, 2, 3), 'gravity': 9.81, 'radius': 0.5, 'dt': 0.1,
                         name: value})
            assert repr(value) in str(refusal.value)
    assert World((1, 2, 3), 9.81, 0, 0.1)
    for gravity, dt in ((0, 0.1), (9.81, 0)):  # nothing would ever fall
        with pytest.raises(ValueError, match=' is 0, but must be a finite number, above 0$'):
            World((1.0, 2.0, 3.0), gravity, 0.5, dt)


def test_size_and_thickness_refuse_what_cannot_be():
    world = brick_in((1.0, 2.0, 0.1))
    for value in (nan, inf, -1e-9, '1', None, True):
        for wrong in ((value, 0.2, 0.12), (0.4, value, 0.12), (0.4, 0.2, value)):
            with pytest.raises(ValueError, match='^size is'):
                world.size = wrong
        with pytest.raises(ValueError, match='^thickness is'):
            world.thickness = value
    with pytest.raises(ValueError, match='^at z = 0.1 m the bottom of the brick, 0.15 m below '
                                         'its center, would be under the ground$'):
        world.size = (0.3, 0.3, 0.3)
    assert (world.size, world.thickness) == (SIZE, THICKNESS)


def test_brick_is_a_tuple_of_floats_of_its_own():
    """No list that is handed in, and nothing that is handed out, is the world's own."""
    location = [1, 2, 3]
    world, sliding = World(location, 9.81, 0.5, 0.004), riding((0.1, 0.1))
    before = world.brick
    location[2] = 99
    assert world.brick == before == (1.0, 2.0, 3.0)
    world.drop()
    sliding.platform = platform_at(tilt=0.3)
    sliding.step()
    for brick in (before, world.brick, sliding.brick):
        assert type(brick) is tuple and {type(value) for value in brick} == {float}


@pytest.mark.parametrize('steps', (1, 7, 250, 9_991))
def test_drop_is_a_step_of_the_closed_form_at_any_timestep(steps):
    world = World((1.5, -2.5, 10.0), 9.81, 0.5, 1.0 / steps)
    for step in range(1, steps + 1):
        world.drop()
        assert gap(world.brick, (1.5, -2.5, 10.0 - 9.81 / 2.0 * (step / steps) ** 2)) <= 1e-9


def test_step_is_drop_while_the_brick_falls(monkeypatch):
    """The member that the assignment asks for is what the arena runs."""
    dropped = []
    drop = World.drop
    monkeypatch.setattr(World, 'drop', lambda world: (dropped.append(world.phase), drop(world)))
    world = brick_in((1.0, 2.0, 3.0))
    world.step()
    assert dropped == []
    world.release()
    world.step()
    assert dropped == [Phase.FALLING]


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
