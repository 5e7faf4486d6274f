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
                                       POSE_TIMEOUT, TURN_DISTANCE)
from turtle_brick.core.turtlesim_kinematics import (ARENA_SIZE, TICK, Turtle, TurtlePose,
                                                    within_arena)
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
    """Seven commands of 3 m/s and 10 ms move the predicted position by 21 cm."""
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


def test_stem_points_along_the_command_and_ignores_small_corrections():
    """In the frame of a turtle that faces north, a goal in the east is on the right."""
    driver = driver_to(9.0, pose=at(5.0, theta=pi / 2.0))
    driver.command(1.0)
    assert driver.stem_angle == pytest.approx(-pi / 2.0)
    driver.drive_to(5.0, 9.0)
    driver.command(1.01)
    assert abs(driver.stem_angle) < 0.02
    turned = driver.stem_angle
    driver.observe(2.0, at(5.0, 9.0 + 0.9 * TURN_DISTANCE, pi / 2.0))
    assert driver.command(2.0) != (0.0, 0.0) and driver.stem_angle == turned


class Bench(Simulation):

    def __init__(self, speed, start=(5.5, 5.5, 0.0), seed=0, jitter=True):
        super().__init__(replace(PARAMETERS, max_velocity=speed), seed,
                         JITTER if jitter else Delays(), start)
        self.speed = speed
        self.poses, self.commands = [], []
        self.record(self.turtle, 'tick', self.poses)
        self.record(self.driver, 'command', self.commands)
        self.rest(0.3)

    def record(self, thing, method, results):
        """Append the times and results of all calls of a method to a list."""
        call = getattr(thing, method)

        def recorded(now):
            results.append((now, call(now)))
            return results[-1][1]

        setattr(thing, method, recorded)

    def distance(self, goal):
        return dist(self.turtle.pose[:2], goal)

    def assert_rests(self, goal, after, time=0.3):
        since = self.now * 1e-9 + after
        self.rest(after + time)
        assert all(hypot(*command) <= self.speed * (1.0 + 1e-12) for _, command in self.commands)
        assert self.poses[-1][0] > since + time - 0.1
        assert all(dist(pose[:2], goal) <= 0.005 for at, pose in self.poses if at >= since)
        assert all(command == (0.0, 0.0) for at, command in self.commands if at >= since)
        assert self.driver.arrived


places = st.tuples(*[st.floats(0.0, ARENA_SIZE)] * 2)
speeds = st.floats(-1.0, 1.0).map(lambda exponent: 10.0 ** exponent)
headings = st.floats(-pi, pi)
seeds = st.integers(0, 2 ** 32)


@st.composite
def drives(draw, longest=1.5, jitter=True):
    """Return a robot at rest and a goal at most `longest` seconds away at full speed."""
    speed, (x, y), angle = draw(speeds), draw(places), draw(headings)
    way = speed * draw(st.one_of(st.floats(0.0, longest), st.floats(0.0, 0.05)))
    goal = within_arena(x + way * cos(angle), y + way * sin(angle))
    assume(dist(goal, (x, y)) > 1e-3)
    return Bench(speed, (x, y, draw(headings)), draw(seeds), jitter), goal


def settling_time(distance, speed):
    """Return an upper bound (s) on a drive from rest until the robot stops at its goal."""
    return distance / speed + 12.0 * BRAKING_TIME + 0.2


@law(24)
@given(data=st.data(), jitter=st.booleans())
def test_driver_arrives_in_time_without_overshoot(data, jitter):
    """The path is straight, with or without jitter (2 ms for ticks, 0.3 ms for commands)."""
    bench, goal = data.draw(drives(jitter=jitter))
    start, distance, speed = bench.turtle.pose, bench.distance(goal), bench.speed
    bench.driver.drive_to(*goal)
    bench.assert_rests(goal, settling_time(distance, speed))
    ex, ey = (goal[0] - start.x) / distance, (goal[1] - start.y) / distance
    for _, pose in bench.poses:
        dx, dy = pose.x - goal[0], pose.y - goal[1]
        assert dx * ex + dy * ey <= 0.002
        assert abs(dx * ey - dy * ex) <= 0.005
    # A repeated goal does not move the turtle.
    bench.driver.drive_to(*goal)
    bench.assert_rests(goal, 0.0)


@law(10)
@given(drive=drives(1.0), part=st.floats(0.0, 1.0), angle=headings, theta=headings,
       after=st.floats(0.0, 0.4), pause=st.floats(0.3, 1.5))
def test_driver_continues_after_a_restart_of_turtlesim(drive, part, angle, theta, after, pause):
    """The new turtle has a different pose and an empty queue. Without poses, the robot stops."""
    bench, goal = drive
    bench.driver.drive_to(*goal)
    bench.rest(after)
    last, way = bench.poses[-1][0], part * bench.speed
    start = within_arena(goal[0] + way * cos(angle), goal[1] + way * sin(angle))
    # During the pause, the driver does not receive poses, and all commands are lost.
    observe, bench.driver.observe = bench.driver.observe, lambda now, pose: None
    bench.rest(pause)
    bench.turtle = Turtle(*start, theta, holonomic=True, now=bench.now * 1e-9)
    bench.record(bench.turtle, 'tick', bench.poses)
    bench.rest(TICK)
    bench.driver.observe = observe
    silent = [command for at, command in bench.commands if last + POSE_TIMEOUT + 0.001 < at]
    assert len(silent) >= (pause - POSE_TIMEOUT - TICK) / COMMAND_PERIOD - 2
    assert all(command == (0.0, 0.0) for command in silent)
    # Queued commands may move the turtle away from the goal.
    bench.assert_rests(goal, settling_time(bench.distance(goal), bench.speed) + 0.1)
