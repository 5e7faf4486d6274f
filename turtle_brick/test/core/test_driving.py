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

"""Test Driver with examples."""

from math import pi

import pytest
from turtle_brick.core.driving import (BRAKING_TIME, COMMAND_DELAY, COMMAND_PERIOD, Driver,
                                       POSE_TIMEOUT)
from turtle_brick.core.turtlesim_arena import TICK, TurtlePose


def at(x, y=5.0, theta=0.0):
    return TurtlePose(x, y, theta, 0.0, 0.0)


def driver_to(x, y=5.0, pose=at(5.0)):
    driver = Driver(3.0)
    driver.observe(1.0, pose)
    driver.drive_to(x, y)
    return driver


def test_driver_stops_without_a_goal_or_a_recent_pose():
    driver = Driver(3.0)
    driver.observe(1.0, at(5.0))
    assert (driver.goal, driver.command(1.0)) == (None, (0.0, 0.0))
    driver.drive_to(1.0, 1.0)
    assert driver.command(1.0 + POSE_TIMEOUT) != (0.0, 0.0)
    assert driver.command(1.001 + POSE_TIMEOUT) == (0.0, 0.0)
    driver = Driver(3.0)
    driver.drive_to(1.0, 1.0)
    assert (driver.pose, driver.command(0.0), driver.arrived) == (None, (0.0, 0.0), False)


def test_speed_is_the_maximum_until_the_driver_brakes():
    """Seven commands of 3 m/s, each lasting 10 ms, move the predicted position by 21 cm."""
    driver = driver_to(5.4)
    speeds = [driver.command(1.0 + COMMAND_PERIOD * count)[0] for count in range(10)]
    assert speeds[:7] == [3.0] * 7
    assert speeds[9] == pytest.approx((0.4 - sum(speeds[:9]) * COMMAND_PERIOD) / BRAKING_TIME)


@pytest.mark.parametrize('age', (0.99 * COMMAND_DELAY, 1.01 * COMMAND_DELAY))
def test_prediction_contains_the_commands_that_a_pose_cannot_show(age):
    driver = driver_to(9.0)
    driver.command(1.0)
    driver.observe(1.0 + age, at(5.0))
    driver.drive_to(5.0, 5.0)
    velocity = driver.command(1.0 + age)
    if age < COMMAND_DELAY:
        assert velocity == (pytest.approx(-3.0 * COMMAND_PERIOD / BRAKING_TIME), pytest.approx(0))
    else:
        assert velocity == (0.0, 0.0)


@pytest.mark.parametrize(('away', 'arrived'), [
    ((0.0004,), True), ((0.0006,), False), ((0.0004, 0.0029), True), ((0.0004, 0.0031), False)])
def test_driver_stops_near_its_goal_and_starts_again_farther_away(away, arrived):
    driver = Driver(3.0)
    driver.drive_to(5.0, 5.0)
    for tick, distance in enumerate(away):
        driver.observe(tick * TICK, at(5.0 + distance))
        driver.command(tick * TICK)
    assert driver.arrived is arrived


def test_stem_points_along_the_last_nonzero_command():
    """For a turtle that faces north, a goal to the east is on its right."""
    driver = driver_to(9.0, pose=at(5.0, theta=pi / 2.0))
    driver.command(1.0)
    assert driver.stem_angle == pytest.approx(-pi / 2.0)
    driver.drive_to(5.0, 9.0)
    driver.command(1.01)
    assert abs(driver.stem_angle) < 0.02
    turned = driver.stem_angle
    driver.observe(2.0, at(5.0, 9.0, pi / 2.0))
    assert driver.command(2.0) == (0.0, 0.0) and driver.stem_angle == turned
