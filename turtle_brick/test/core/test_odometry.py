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

"""Test the wheel odometry with examples."""

from math import pi

import pytest
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.turtlesim_arena import TICK, TurtlePose

RADIUS = 0.2


def test_odometry_of_a_robot_that_drives_north():
    odometer = Odometer(wheel_radius=0.5)
    odometer.observe(0.0, TurtlePose(5.0, 5.0, pi / 2.0, 0.0, 0.0), 0.0)
    odometer.observe(TICK, TurtlePose(5.0, 5.016, pi / 2.0, 1.0, 0.0), 0.0)
    assert odometer.pose == pytest.approx((0.016, 0.0, 0.0))
    assert odometer.wheel_angle == pytest.approx(0.032)


def test_wheel_angle_includes_the_motion_of_lost_poses():
    odometer = Odometer(RADIUS)
    for ticks in (0, 1, 6):
        pose = TurtlePose(5.0 + ticks * TICK * 2.0, 5.0, 0.0, 2.0, 0.0)
        odometer.observe(ticks * TICK, pose, 0.0)
    assert odometer.wheel_angle == pytest.approx(6 * TICK * 2.0 / RADIUS)


def test_wheel_rolls_backward_until_the_robot_obeys_a_goal_behind_it():
    odometer = Odometer(RADIUS)
    for tick, x, stem_angle in ((0, 5.0, 0.0), (1, 5.048, 0.0), (2, 5.096, pi), (3, 5.048, pi)):
        odometer.observe(tick * TICK, TurtlePose(x, 5.0, 0.0, 3.0, 0.0), stem_angle)
    assert odometer.wheel_angle == pytest.approx(0.048 / RADIUS)
