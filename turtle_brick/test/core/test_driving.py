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

"""Test Driver with examples and in a closed loop with turtlesim's kinematics."""

from dataclasses import replace
from math import cos, dist, hypot, pi, sin

from hypothesis import assume, given
from hypothesis import strategies as st
from laws import law, PARAMETERS
import pytest
from turtle_brick.core.driving import (BRAKING_TIME, COMMAND_DELAY, COMMAND_PERIOD, Driver,
                                       POSE_TIMEOUT)
from turtle_brick.core.turtlesim_arena import ARENA_SIZE, TICK, TurtlePose, within_arena
from turtle_brick.tools.simulation import Delays, JITTER, Simulation


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


places = st.floats(0.0, ARENA_SIZE)
headings = st.floats(-pi, pi)


@law(24)
@given(speed=st.floats(-1.0, 1.0).map(lambda exponent: 10.0 ** exponent), x=places, y=places,
       theta=headings, time=st.floats(0.0, 1.5) | st.floats(0.0, 0.05), angle=headings,
       seed=st.integers(0, 2 ** 32), delays=st.sampled_from((JITTER, Delays())))
def test_driver_arrives_in_time_without_overshoot(speed, x, y, theta, time, angle, seed, delays):
    """The turtle drives in a straight line, even with timer jitter."""
    goal = within_arena(x + time * speed * cos(angle), y + time * speed * sin(angle))
    simulation = Simulation(replace(PARAMETERS, max_velocity=speed), seed, delays, (x, y, theta))
    simulation.rest(0.3)
    start, samples = simulation.turtle.pose, []
    distance = dist(start[:2], goal)
    assume(distance > 1e-3)
    simulation.after_step = lambda: samples.append((simulation.turtle.pose, simulation.commanded))
    simulation.driver.drive_to(*goal)
    simulation.rest(distance / speed + 12.0 * BRAKING_TIME + 0.2)
    ex, ey = (goal[0] - start.x) / distance, (goal[1] - start.y) / distance
    for pose, command in samples:
        assert hypot(*command) <= speed * (1.0 + 1e-12)
        dx, dy = pose.x - goal[0], pose.y - goal[1]
        assert dx * ex + dy * ey <= 0.002
        assert abs(dx * ey - dy * ex) <= 0.005
    # Repeating a goal that has been reached does not move the turtle.
    samples.clear()
    simulation.driver.drive_to(*goal)
    simulation.rest(0.3)
    assert simulation.driver.arrived
    assert all(dist(pose[:2], goal) <= 0.005 and command == (0.0, 0.0)
               for pose, command in samples)
