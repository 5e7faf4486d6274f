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
"""Test the wheel odometry with random drives and teleports."""

from math import cos, hypot, isclose, pi, sin

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.odometry import MIN_MOTION, Odometer
from turtle_brick.core.turtlesim_arena import TICK, TurtlePose
from turtle_brick.core.turtlesim_kinematics import Turtle

RADIUS = 0.2
angles = st.floats(-pi, pi)


@law(30)
@given(direction=angles, speed=st.floats(0.1, 10.0), theta=angles, stem_angle=angles)
def test_wheel_rolls_without_slipping_up_to_a_wall(direction, speed, theta, stem_angle):
    """The displacement along the stem's direction is the wheel angle times the wheel radius."""
    turtle, odometer = Turtle(theta=theta, holonomic=True), Odometer(RADIUS)
    odometer.observe(0.0, turtle.pose, stem_angle)
    for tick in range(1, 121):
        last, angle = turtle.pose, odometer.wheel_angle
        turtle.command(speed * cos(direction), speed * sin(direction), 0.0)
        odometer.observe(tick * TICK, turtle.tick(tick * TICK), stem_angle)
        dx, dy = turtle.pose.x - last.x, turtle.pose.y - last.y
        along = turtle.pose.theta + stem_angle
        way = dx * cos(along) + dy * sin(along)
        rolled = (odometer.wheel_angle - angle) * RADIUS
        assert rolled == pytest.approx(way if hypot(dx, dy) > MIN_MOTION else 0.0, abs=1e-9)


@law(20)
@given(poses=st.lists(st.tuples(st.integers(0, 11), st.integers(0, 11), angles), min_size=1,
                      max_size=10), speed=st.sampled_from([0.0, 1.0, 3.0]))
def test_teleports_change_neither_odom_nor_the_wheel(poses, speed):
    """Composing the robot's first pose with its odom pose yields its pose in the world frame."""
    odometer = Odometer(RADIUS)
    for number, (x, y, theta) in enumerate(poses):
        odometer.observe(number * TICK, TurtlePose(x, y, theta, speed, 0.0), 0.0)
        assert odometer.wheel_angle == 0.0
    assert odometer.origin == poses[0]
    world = odometer.origin.compose(odometer.pose)
    assert hypot(world.x - x, world.y - y) < 1e-9
    assert isclose(cos(world.yaw - theta), 1.0, abs_tol=1e-12)
