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

"""The laws of rolling, and that odom is where the turtle was first seen."""

from math import cos, hypot, isclose, pi, sin

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.turtlesim_kinematics import TICK, Turtle, TurtlePose

RADIUS = 0.2
angles = st.floats(-pi, pi)


def drive(odometer, turtle, command, ticks, start=0.0):
    """Let a turtle obey a command, the odometer watching; return the time and its true path."""
    path = 0.0
    now = start
    for _ in range(ticks):
        turtle.command(*command, 0.0)
        before = turtle.pose
        now += TICK
        odometer.observe(now, turtle.tick(now))
        path += hypot(turtle.pose.x - before.x, turtle.pose.y - before.y)
    return now, path


@law(40)
@given(direction=angles, speed=st.floats(0.1, 10.0), theta=angles)
def test_wheel_rolls_without_slipping(direction, speed, theta):
    """The wheel's angle times its radius is the path; the stem points along the motion."""
    odometer, turtle = Odometer(RADIUS), Turtle(theta=theta, holonomic=True)
    odometer.observe(0.0, turtle.tick(0.0))
    _, path = drive(odometer, turtle, (speed * cos(direction), speed * sin(direction)), 30)
    assert path == pytest.approx(30 * TICK * speed, rel=1e-3)
    assert odometer.wheel_angle * RADIUS == pytest.approx(path, rel=0.01)
    assert isclose(cos(odometer.stem_angle - direction), 1.0, abs_tol=1e-5)
    assert -pi <= odometer.stem_angle < pi


def test_stem_keeps_its_direction_at_rest():
    """A robot that stops looks where it went."""
    odometer, turtle = Odometer(RADIUS), Turtle(holonomic=True)
    odometer.observe(0.0, turtle.tick(0.0))
    now, _ = drive(odometer, turtle, (0.0, 1.0), 10)
    stem, wheel = odometer.stem_angle, odometer.wheel_angle
    drive(odometer, turtle, (0.0, 0.0), 50, now)
    assert (odometer.stem_angle, odometer.wheel_angle) == (stem, wheel)
    assert stem == pytest.approx(pi / 2.0, abs=1e-4)


@pytest.mark.parametrize('direction', [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_wheel_stands_at_a_wall(direction):
    """What turtlesim commands is not what the wheel does: a wall stops both."""
    odometer, turtle = Odometer(RADIUS), Turtle(holonomic=True)
    now, _ = drive(odometer, turtle, (10.0 * direction[0], 10.0 * direction[1]), 60)
    wheel = odometer.wheel_angle
    drive(odometer, turtle, (3.0 * direction[0], 3.0 * direction[1]), 60, now)
    assert turtle.pose.linear_velocity == 3.0
    assert odometer.wheel_angle == wheel


def test_wheel_rolls_along_a_wall():
    """A turtle that a wall deflects rolls as far as it slides."""
    odometer, turtle = Odometer(RADIUS), Turtle(x=11.0, holonomic=True)
    odometer.observe(0.0, turtle.tick(0.0))
    now, _ = drive(odometer, turtle, (3.0, 0.0), 20)
    wheel = odometer.wheel_angle
    drive(odometer, turtle, (3.0, 1.0), 30, now)
    assert (odometer.wheel_angle - wheel) * RADIUS == pytest.approx(30 * TICK, rel=0.01)


@law(50)
@given(x=st.floats(0.0, 11.0), y=st.floats(0.0, 11.0), theta=angles,
       speed=st.sampled_from([0.0, 1.0, 3.0]))
def test_wheel_does_not_roll_in_a_teleport(x, y, theta, speed):
    """Being put somewhere else turns no wheel, whether it drives or not."""
    odometer, turtle = Odometer(RADIUS), Turtle(holonomic=True)
    now, _ = drive(odometer, turtle, (speed, 0.0), 10)
    wheel = odometer.wheel_angle
    far = hypot(turtle.pose.x - x, turtle.pose.y - y) > 0.2
    turtle.teleport_absolute(x, y, theta)
    drive(odometer, turtle, (speed, 0.0), 1, now)
    if far:
        assert odometer.wheel_angle == wheel


@law(50)
@given(st.lists(st.tuples(st.floats(0.0, 11.0), st.floats(0.0, 11.0), angles), min_size=1,
                max_size=10))
def test_odom_stays_and_composes(poses):
    """The first pose is odom for ever; odom after base_link-in-odom is the pose in the world."""
    odometer = Odometer(RADIUS)
    for number, (x, y, theta) in enumerate(poses):
        odometer.observe(number * TICK, TurtlePose(x, y, theta, 0.0, 0.0))
    assert odometer.origin == poses[0]
    world = odometer.origin.compose(odometer.pose)
    x, y, theta = poses[-1]
    assert hypot(world.x - x, world.y - y) < 1e-9
    assert isclose(cos(world.yaw - theta), 1.0, abs_tol=1e-12)
    assert odometer.wheel_angle == 0.0
