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

"""Every member of World, by examples and closed forms."""

import inspect
from math import inf, nan, pi, sin

import pytest
from turtle_brick.core.geometry import IDENTITY, Pose
from turtle_brick.core.platform import Platform
from turtle_brick.physics import Phase, World
from worlds import (advance, axes_of, brick_in, DT, gap, GRAVITY, HINGE, in_phase, LIFT,
                    on_platform, PLACES, platform_at, RADIUS, riding, SIZE, THICKNESS, TOP,
                    upright_of)


def words(text):
    """Return the words of a docstring, however it is laid out."""
    return ' '.join(text.split()).rstrip('.')


@pytest.mark.parametrize(('member', 'signature', 'docstring'), [
    (World.__init__, '(self, brick, gravity, radius, dt)', """
        Initialize the world.

        Args:
          brick - The (x,y,z) location of the brick
          gravity - the acceleration due to gravity in m/s^2
          radius - the radius of the platform
          dt - timestep in seconds of the physics simulation
     """),
    (World.brick.fget, '(self)', """
        Get the brick's location.

        Return:
           (x,y,z) location of the brick
     """),
    (World.brick.fset, '(self, location)', """
        Set the brick's location.

        Args:
          location - the (x,y,z) location of the brick
     """),
    (World.drop, '(self)', """
        Update the brick's location by having it fall in gravity for one timestep
     """),
])
def test_definition_is_that_of_the_assignment(member, signature, docstring):
    assert str(inspect.signature(member)) == signature
    assert words(member.__doc__) == words(docstring)


def test_class_is_documented_as_in_the_assignment():
    assert World.__doc__ == 'Keep track of the physics of the world.'


def test_init_places_a_brick_that_hovers():
    world = World((1.0, 2.0, 3.0), 9.81, 0.5, 0.004)
    assert world.brick == (1.0, 2.0, 3.0)
    assert world.phase is Phase.HOVERING
    assert world.size == (0.0, 0.0, 0.0)
    assert world.thickness == 0.0
    assert world.platform is None
    world.step()
    assert world.brick == (1.0, 2.0, 3.0)


NO_LENGTHS = (nan, inf, -inf, -1e-9, 10 ** 400, '1', None, True, (1.0,))


@pytest.mark.parametrize('value', NO_LENGTHS)
@pytest.mark.parametrize('name', ('gravity', 'radius', 'dt'))
def test_init_refuses_what_cannot_be(name, value):
    """The sentence names what and which, and has no more digits than one reads."""
    with pytest.raises(ValueError, match=f'^{name} is .{{1,20}}, but must be') as refusal:
        World(**{'brick': (1.0, 2.0, 3.0), 'gravity': 9.81, 'radius': 0.5, 'dt': 0.004,
                 name: value})
    assert repr(value)[:5] in str(refusal.value) or value == 10 ** 400


@pytest.mark.parametrize('name', ('gravity', 'dt'))
def test_init_refuses_zero_where_nothing_would_ever_fall(name):
    with pytest.raises(ValueError, match=f'^{name} is 0, but must be finite and above 0$'):
        World(**{'brick': (1.0, 2.0, 3.0), 'gravity': 9.81, 'radius': 0.5, 'dt': 0.004, name: 0})


@pytest.mark.parametrize('value', NO_LENGTHS)
def test_size_and_thickness_refuse_what_cannot_be(value):
    world = brick_in((1.0, 2.0, 3.0))
    for wrong in ((value, 0.2, 0.12), (0.4, value, 0.12), (0.4, 0.2, value)):
        with pytest.raises(ValueError, match='^size is'):
            world.size = wrong
    with pytest.raises(ValueError, match='^thickness is'):
        world.thickness = value
    assert world.size == SIZE
    assert world.thickness == THICKNESS


def test_size_that_would_reach_into_the_ground_is_refused():
    world = World((1.0, 2.0, 0.1), 9.81, 0.5, 0.004)
    with pytest.raises(ValueError, match='^at z = 0.1 m the bottom of the brick, 0.15 m below '
                                         'its center, would be under the ground$'):
        world.size = (0.3, 0.3, 0.3)
    assert world.size == (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match='^at z = -1 m the bottom of the brick would be under'):
        world.brick = (0.0, 0.0, -1.0)


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


def test_brick_is_a_tuple_of_floats_of_its_own():
    """No list that is handed in, and nothing that is handed out, is the world's own."""
    location = [1, 2, 3]
    world = World(location, 9.81, 0.5, 0.004)
    location[2] = 99
    before = world.brick
    assert before == (1.0, 2.0, 3.0)
    assert type(before) is tuple
    assert all(type(value) is float for value in before)
    world.brick = location
    location[0] = 99
    assert world.brick == (1.0, 2.0, 99.0)
    world.drop()
    assert before == (1.0, 2.0, 3.0)
    assert type(world.brick) is tuple


def test_brick_on_a_platform_is_a_tuple_of_floats():
    world = riding((0.1, 0.1))
    world.platform = platform_at(tilt=0.3)
    world.step()
    assert type(world.brick) is tuple
    assert all(type(value) is float for value in world.brick)


@pytest.mark.parametrize('phase', Phase)
def test_setter_stops_whatever_the_brick_does(phase):
    world = in_phase(phase)
    world.brick = (1.0, 2.0, 30.0)
    assert world.phase is Phase.HOVERING
    world.step()
    assert world.brick == (1.0, 2.0, 30.0)
    world.drop()
    assert gap(world.brick, (1.0, 2.0, 30.0 - 0.5 * GRAVITY * DT ** 2)) <= 1e-12


def test_drop_falls_for_one_timestep():
    world = World((1.0, 2.0, 3.0), 10.0, 0.5, 0.1)
    for expected in (2.95, 2.8, 2.55, 2.2):
        world.drop()
        assert gap(world.brick, (1.0, 2.0, expected)) <= 1e-12


@pytest.mark.parametrize('phase', (Phase.RIDING, Phase.GROUNDED))
def test_drop_leaves_alone_what_lies(phase):
    world = in_phase(phase)
    before = world.brick
    world.drop()
    assert world.brick == before
    assert world.phase is phase


def assert_undisturbed(world, phase):
    """See that a brick goes on like one of the same phase that nothing has happened to."""
    other = in_phase(phase)
    for _ in range(3):
        world.step()
        other.step()
        assert world.brick == other.brick


@pytest.mark.parametrize('phase', Phase)
@pytest.mark.parametrize(('location', 'value'), [
    ((nan, 0.0, 1.0), 'nan'), ((0.0, inf, 1.0), 'inf'), ((0.0, 0.0, -inf), '-inf'),
    ((0.0, 0.0, -1.5), '-1.5'), ((0.0, 0.0, 0.0599), '0.0599')])
def test_impossible_location_is_refused_and_nothing_changes(phase, location, value):
    world = in_phase(phase)
    before = world.brick
    with pytest.raises(ValueError, match=value):
        world.brick = location
    assert world.brick == before
    assert world.phase is phase
    assert_undisturbed(world, phase)


def test_brick_may_stand_on_the_ground():
    world = brick_in((0.0, 0.0, 5.0))
    world.brick = (1.0, 1.0, LIFT)
    assert world.brick == (1.0, 1.0, LIFT)
    world.release()
    world.step()
    assert world.phase is Phase.GROUNDED
    assert world.brick == (1.0, 1.0, LIFT)


@pytest.mark.parametrize('phase', (Phase.FALLING, Phase.RIDING, Phase.GROUNDED))
def test_release_is_refused_with_what_the_brick_does(phase):
    world = in_phase(phase)
    with pytest.raises(ValueError, match=PLACES[phase]):
        world.release()
    assert world.phase is phase
    assert_undisturbed(world, phase)


def test_fall_time_is_that_of_the_present_fall_or_the_last():
    world = brick_in((0.0, 0.0, 3.0))
    assert world.fall_time == 0.0
    world.release()
    for step in range(1, 6):
        world.step()
        assert world.fall_time == pytest.approx(step * DT)
    world.brick = (0.0, 0.0, 3.0)
    world.step()
    assert world.fall_time == pytest.approx(5 * DT)
    world.release()
    assert world.fall_time == 0.0
    steps = len(advance(world, Phase.FALLING)) - 1
    world.step()
    assert world.fall_time == pytest.approx(steps * DT)


def test_floating_brick_falls_from_where_it_floats():
    world = in_phase(Phase.FLOATING)
    x, y, z = world.brick
    world.platform = platform_at(x=9.0)
    world.release()
    world.step()
    assert gap(world.brick, (x, y, z - 0.5 * GRAVITY * DT ** 2)) <= 1e-12


def test_edge_of_the_platform_carries():
    world = brick_in((RADIUS, 0.0, 5.0), platform=platform_at())
    world.release()
    advance(world, Phase.FALLING)
    assert world.phase is Phase.RIDING
    world = brick_in((RADIUS + 1e-9, 0.0, 5.0), platform=platform_at())
    world.release()
    advance(world, Phase.FALLING)
    assert world.phase is Phase.GROUNDED


def test_brick_released_on_the_platform_stays_there():
    """Its bottom is at the top, above it by no more than rounding, or below it by as much."""
    for error in (0.0, 1e-10, -1e-10):
        world = brick_in((0.1, 0.2, TOP + LIFT + error), platform=platform_at())
        world.release()
        world.step()
        assert world.phase is Phase.RIDING
        assert gap(world.brick, (0.1, 0.2, TOP + LIFT)) <= 1e-12


def test_point_brick_and_sheet_platform_unless_told_otherwise():
    world = World((0.1, 0.0, 2.0), 9.81, 0.5, 0.004)
    world.platform = Platform(Pose((0.0, 0.0, 1.0), IDENTITY))
    world.release()
    advance(world, Phase.FALLING)
    assert world.phase is Phase.RIDING
    assert gap(world.brick, (0.1, 0.0, 1.0)) <= 1e-12


def test_brick_waits_where_it_is_while_no_platform_is_known():
    """And goes on where the platform is once that is known again."""
    world = riding((0.1, 0.2), yaw=0.3)
    before = world.brick
    world.platform = None
    for _ in range(500):
        world.step()
    assert world.brick == before
    assert world.phase is Phase.RIDING
    assert upright_of(world.orientation) == (0.0, 0.0, 1.0)
    world.platform = platform_at(4.0, 5.0, 0.3)
    world.step()
    assert gap(world.brick, on_platform((0.1, 0.2), 4.0, 5.0, 0.3, 0.0)) <= 1e-12


@pytest.mark.parametrize('tilt', (0.7, -0.7))
@pytest.mark.parametrize('rate', (0.5, 2.0))
def test_slide_on_a_platform_that_is_being_tilted(tilt, rate):
    """
    With angle = rate * time, path = g / rate * (t - sin(rate t) / rate): a limit, here.

    A step takes the angle at its end for the whole of it, which is an error of at most
    g * rate * dt in the acceleration; it vanishes with the step.
    """
    time = abs(tilt) / rate
    sign = tilt / abs(tilt)
    exact = sign * GRAVITY / rate * (time - sin(rate * time) / rate)
    errors = []
    for steps in (200, 400, 800):
        dt = time / steps
        # Far from the edge, so that it never gets there.
        world = riding(dt=dt, radius=10.0)
        for step in range(1, steps + 1):
            world.platform = platform_at(tilt=sign * rate * step * dt)
            world.step()
        ex, _, _ = axes_of(0.0, tilt)
        path = sum((a - b) * e for a, b, e in zip(world.brick, (0.0, 0.0, HINGE), ex))
        errors.append(abs(path - exact))
        assert errors[-1] <= 0.5 * GRAVITY * rate * dt * time ** 2 + 1e-9
    assert errors[1] < 0.55 * errors[0]
    assert errors[2] < 0.55 * errors[1]


@pytest.mark.parametrize('angle', (pi / 2.0, -pi / 2.0, 2.0, -2.0, pi, -pi))
@pytest.mark.parametrize('yaw', (0.0, 1.0, -2.5))
def test_platform_tilted_by_90_degrees_lets_go(angle, yaw):
    world = riding((0.1, -0.05), yaw=yaw)
    world.platform = platform_at(yaw=yaw, tilt=angle)
    world.step()
    assert world.phase is Phase.FLOATING
    before = world.brick
    world.step()
    assert world.brick == before


@pytest.mark.parametrize('angle', (pi / 2.0 - 1e-3, -pi / 2.0 + 1e-3))
def test_platform_tilted_by_less_does_not(angle):
    world = riding()
    world.platform = platform_at(tilt=angle)
    world.step()
    assert world.phase is Phase.RIDING
