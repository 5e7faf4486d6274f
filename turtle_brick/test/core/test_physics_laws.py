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
"""Test World with random input against closed-form solutions."""

from math import cos, floor, hypot, pi, sin, sqrt

from hypothesis import assume, given
from hypothesis import strategies as st
from laws import law
import pytest
from rigid import axes_of, distance_to_rectangle, Frame, X, Y, Z
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose
from turtle_brick.core.tilting_platform import LEVEL_TOLERANCE, Platform
from turtle_brick.physics import BrickState, World

GRAVITY = 9.81
RADIUS = 0.5
DT = 0.004
SIZE = (0.4, 0.2, 0.12)
LIFT = SIZE[2] / 2.0
THICKNESS = 0.04
HINGE = 3.0
TOP = HINGE + THICKNESS

headings = st.floats(-pi, pi)
coordinates = st.floats(-20.0, 20.0)
gravities = st.floats(0.5, 30.0)
time_steps = st.sampled_from((0.004, 0.01, 0.0333))
tilts = st.builds(lambda angle, sign: sign * angle,
                  st.floats(0.1, 1.5), st.sampled_from((1.0, -1.0)))


@st.composite
def discs(draw, radius):
    """Return a random point within a given distance (m) of the origin."""
    distance, angle = radius * sqrt(draw(st.floats(0.0, 0.999))), draw(headings)
    return distance * cos(angle), distance * sin(angle)


def frame_at(x, y, yaw, tilt):
    return Frame((x, y, HINGE)).turned(Z, yaw).turned(Y, tilt)


def on_platform(place, *where):
    return frame_at(*where).transform((*place, THICKNESS + LIFT))


def turning_gap(quaternion, yaw, tilt, right):
    expected = frame_at(0.0, 0.0, yaw, tilt).turned(Z, -right).axes
    return max(map(gap, axes_of(quaternion), expected))


def gap(one, other):
    return max(abs(a - b) for a, b in zip(one, other))


def platform_at(x=0.0, y=0.0, yaw=0.0, tilt=0.0):
    return Platform(Pose((x, y, HINGE), multiply(from_yaw(yaw), from_pitch(tilt))))


def released(brick, platform, gravity=GRAVITY, dt=DT, radius=RADIUS):
    world = World(brick, gravity, radius, dt)
    world.size, world.thickness, world.platform = SIZE, THICKNESS, platform
    world.release()
    return world


def landed(*arguments, **keywords):
    world = released(*arguments, **keywords)
    while world.state is BrickState.FALLING:
        world.step()
    return world


def riding(place=(0.0, 0.0), yaw=0.0, **keywords):
    x, y, z = on_platform(place, 0.0, 0.0, yaw, 0.0)
    world = landed((x, y, z + 0.02), platform_at(yaw=yaw), **keywords)
    assert world.state is BrickState.RIDING
    return world


@pytest.mark.parametrize('x, z, state', [
    (0.1, TOP + LIFT, BrickState.RIDING), (0.1, TOP + LIFT + 1e-10, BrickState.RIDING),
    (0.1, TOP + LIFT - 0.9e-9, BrickState.RIDING), (0.1, TOP + LIFT - 2e-9, BrickState.GROUNDED),
    (RADIUS, 5.0, BrickState.RIDING), (RADIUS + 1e-9, 5.0, BrickState.GROUNDED),
    (0.1, LIFT, BrickState.GROUNDED)])
def test_brick_lands_on_edge_and_top_of_the_platform_and_on_the_ground(x, z, state):
    world = landed((x, 0.0, z), platform_at())
    assert world.state is state
    assert gap(world.brick, (x, 0.0, TOP + LIFT if state is BrickState.RIDING else LIFT)) <= 1e-12


@pytest.mark.parametrize('tilt, is_level', [
    (0.999 * LEVEL_TOLERANCE, True), (-0.999 * LEVEL_TOLERANCE, True),
    (1.001 * LEVEL_TOLERANCE, False), (0.01, False), (pi, False)])
def test_platform_has_a_level_tolerance(tilt, is_level):
    assert platform_at(yaw=1.0, tilt=tilt).is_level is is_level


@law(40)
@given(place=discs(2.0), yaw=headings, height=st.floats(1e-3, 5.0), radius=st.floats(0.05, 2.0),
       gravity=gravities, dt=time_steps, late=st.integers(-3, 3) | st.integers(0, 100),
       comes=st.booleans(), away=st.sampled_from((None, 'elsewhere', 0.002, pi)) | tilts)
def test_brick_lands_only_if_the_platform_is_there_when_it_reaches_its_top(
        place, yaw, height, radius, gravity, dt, late, comes, away):
    """The platform moves, tilts, appears or disappears at about the time the brick lands."""
    crossing = floor(sqrt(2.0 * height / gravity) / dt) + 1
    after, before = (0.5 * gravity * (step * dt) ** 2 for step in (crossing, crossing - 1))
    assume(before < height - 1e-6 and height + 1e-6 < after)
    (u, v), x, y = place, 3.0, -2.0
    assume(abs(hypot(u, v) - radius) > 1e-9)
    here = platform_at(x, y, yaw)
    if away is not None:
        away = platform_at(x + 5.0, y) if away == 'elsewhere' else platform_at(x, y, yaw, away)
    world = released((x + u, y + v, TOP + LIFT + height), away if comes else here, gravity, dt,
                     radius)
    step = 0
    while world.state is BrickState.FALLING:
        course = TOP + LIFT + height - 0.5 * gravity * (step * dt) ** 2
        assert gap(world.brick, (x + u, y + v, course)) <= 1e-9
        step += 1
        if step == max(crossing + late, 1):
            world.platform = here if comes else away
        world.step()
    if comes == (late <= 0) and hypot(u, v) < radius:
        assert (world.state, step) == (BrickState.RIDING, crossing)
        assert gap(world.brick, (x + u, y + v, TOP + LIFT)) <= 1e-12
    else:
        assert world.state is BrickState.GROUNDED
        assert gap(world.brick, (x + u, y + v, LIFT)) <= 1e-12


@law(30)
@given(place=discs(RADIUS), yaw=headings, gravity=gravities, dt=time_steps,
       program=st.lists(st.tuples(st.floats(-1.5, 1.5) | st.just(0.0), st.integers(1, 40),
                                  coordinates, coordinates, headings),
                        min_size=1, max_size=5))
def test_slide_on_a_moving_platform(place, yaw, gravity, dt, program):
    """Only gravity accelerates the brick. The brick floats after it has left the platform."""
    world = riding(place, yaw=yaw, gravity=gravity, dt=dt)
    (u, v), speed = place, 0.0
    for tilt, steps, x, y, heading in program:
        world.platform = platform_at(x, y, heading, tilt)
        pull = gravity * sin(tilt)
        for _ in range(steps):
            if world.state is not BrickState.RIDING:
                break
            world.step()
            u, speed = u + speed * dt + 0.5 * pull * dt ** 2, speed + pull * dt
            assert gap(world.brick, on_platform((u, v), x, y, heading, tilt)) <= 1e-9
            assert turning_gap(world.orientation, heading, tilt, yaw) <= 1e-9
            if world.pose_on_platform:
                below, (position, turned) = world.platform.pose, world.pose_on_platform
                assert gap(below.transform(position), world.brick) <= 1e-9
                assert turning_gap(multiply(below.orientation, turned), heading, tilt, yaw) <= 1e-9
            # The heading of the brick was 0 when it landed.
            distance = distance_to_rectangle((u, v), -yaw, SIZE[:2])
            if abs(distance - RADIUS) > 1e-9:
                expected = BrickState.FLOATING if distance > RADIUS else BrickState.RIDING
                assert world.state is expected
    world.brick = place = (x, y, 9.0)
    assert (world.brick, world.state, world.pose_on_platform) == (place, BrickState.HOVERING, None)
    assert turning_gap(world.orientation, heading, tilt, heading) <= 1e-9


@law(10)
@given(roll=tilts)
def test_slide_on_a_platform_with_roll(roll):
    """In other robot models, the platform frame may have a nonzero roll angle."""
    world, leaning = riding(), Frame((0.0, 0.0, HINGE)).turned(X, roll)
    world.platform = Platform(Pose((0.0, 0.0, HINGE), (sin(roll / 2), 0.0, 0.0, cos(roll / 2))))
    for step in range(1, 6):
        world.step()
        v = -0.5 * GRAVITY * sin(roll) * (step * DT) ** 2
        assert gap(world.brick, leaning.transform((0.0, v, THICKNESS + LIFT))) <= 1e-12
