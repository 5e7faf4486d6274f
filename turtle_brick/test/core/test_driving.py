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
from itertools import pairwise
from math import cos, dist, hypot, nan, pi, sin
from random import Random

from hypothesis import assume, given
from hypothesis import strategies as st
from laws import law, PARAMETERS
import pytest
from turtle_brick.core.driving import (COMMAND_PERIOD, CommandQueue, Driver, POSE_TIMEOUT,
                                       TickClock, travel_time)
from turtle_brick.core.reachability import QUEUE_LATENCY
from turtle_brick.core.turtlesim_kinematics import (ARENA_SIZE, TICK, Turtle, TurtlePose,
                                                    within_arena)
from turtle_brick.tools.simulation import Delays, JITTER, Simulation


def test_driver_stops_without_a_goal_or_a_recent_pose():
    driver = Driver(3.0)
    driver.observe(1.0, TurtlePose(5.0, 5.0, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match='is not finite'):
        driver.drive_to(5.0, nan)
    assert (driver.goal, driver.command(1.0)) == (None, (0.0, 0.0))
    driver.drive_to(1.0, 1.0)
    assert driver.command(1.0 + POSE_TIMEOUT) != (0.0, 0.0)
    assert driver.command(1.001 + POSE_TIMEOUT) == (0.0, 0.0)
    driver = Driver(3.0)
    driver.drive_to(1.0, 1.0)
    assert (driver.pose, driver.command(0.0), driver.arrived) == (None, (0.0, 0.0), False)


@pytest.mark.parametrize(('away', 'arrived'), [
    ((0.0004,), True), ((0.0006,), False), ((0.0004, 0.0029), True), ((0.0004, 0.0031), False)])
def test_driver_stops_near_its_goal_and_starts_again_farther_away(away, arrived):
    driver = Driver(3.0)
    driver.drive_to(5.0, 5.0)
    for tick, distance in enumerate(away):
        driver.observe(tick * TICK, TurtlePose(5.0 + distance, 5.0, 0.0, 0.0, 0.0))
        driver.command(tick * TICK)
    assert driver.arrived is arrived


def test_travel_time_without_a_final_approach():
    assert travel_time(distance=3.5, radius=0.5, max_velocity=3.0) == 1.0
    assert travel_time(distance=0.5, radius=0.5, max_velocity=3.0) == 0.0


def test_tick_clock_follows_the_poses():
    """The clock restarts after one very early pose or three late poses."""
    for period in (0.99 * TICK, 1.01 * TICK):
        clock = TickClock()
        for number in range(1000):
            clock.observe(number * period)
            assert abs(clock.last - number * period) < 0.22 * TICK
    clock = TickClock()
    for now, grid in ((0.0, 0.0), (1.4, 1.02), (1.41, 1.41), (3.0, 2.41), (4.0, 3.41), (5.0, 5.0)):
        clock.observe(now * TICK)
        assert clock.last == pytest.approx(grid * TICK)


def record_results(thing, method, results):
    call = getattr(thing, method)

    def record(now):
        results.append((now, call(now)))
        return results[-1][1]

    setattr(thing, method, record)


class Bench(Simulation):

    def __init__(self, speed, start=(5.5, 5.5, 0.0), seed=0, jitter=True, driver=None):
        super().__init__(replace(PARAMETERS, max_velocity=speed), seed,
                         JITTER if jitter else Delays(), start)
        self.driver = driver or self.driver
        self.speed = speed
        self.poses, self.commands = [], []
        record_results(self.turtle, 'tick', self.poses)
        record_results(self.driver, 'command', self.commands)
        self.rest(0.3)

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


@law(24)
@given(data=st.data(), jitter=st.booleans())
def test_driver_arrives_in_time_without_overshoot(data, jitter):
    """The path is straight, with or without jitter (2 ms for ticks, 0.3 ms for commands)."""
    bench, goal = data.draw(drives(jitter=jitter))
    start, distance, speed = bench.turtle.pose, bench.distance(goal), bench.speed
    begin, radius = bench.now * 1e-9, PARAMETERS.platform_radius
    bench.driver.drive_to(*goal)
    bench.assert_rests(goal, distance / speed + 0.6, 0.6)
    reached = next(time for time, pose in bench.poses if dist(pose[:2], goal) <= radius)
    assert reached - begin <= max(distance - radius, 0.0) / speed + 0.12
    ex, ey = (goal[0] - start.x) / distance, (goal[1] - start.y) / distance
    for time, pose in bench.poses:
        dx, dy = pose.x - goal[0], pose.y - goal[1]
        assert dx * ex + dy * ey <= (0.020 * speed if jitter else 0.001 * speed + 1e-5)
        # An overshoot may move the turtle along a wall.
        assert time > reached or abs(dx * ey - dy * ex) <= 0.005
    assert max(hypot(*command) for _, command in bench.commands) == pytest.approx(
        min(speed, 0.5 * distance / TICK))
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
    record_results(bench.turtle, 'tick', bench.poses)
    bench.rest(TICK)
    bench.driver.observe = observe
    silent = [command for at, command in bench.commands if last + POSE_TIMEOUT + 0.001 < at]
    assert len(silent) >= (pause - POSE_TIMEOUT - TICK) / COMMAND_PERIOD - 2
    assert all(command == (0.0, 0.0) for command in silent)
    # Queued commands may move the turtle away from the goal.
    bench.assert_rests(
        goal, bench.distance(goal) / bench.speed + 0.6 + QUEUE_LATENCY + COMMAND_PERIOD)


class Wanderer(CommandQueue):
    """A driver that changes direction randomly and gives each command a different speed."""

    def __init__(self, random, hold):
        super().__init__()
        self.random, self.hold = random, hold
        self.predicted = {}

    def command(self, now):
        count, speed = len(self.predicted), 0.0
        if count % self.hold == 0:
            self.angle = self.random.uniform(-pi, pi)
        if self.pose is not None:
            speed = round(0.5 + 0.01 * count, 4)
            self.predicted[speed] = self.predict(now)
        velocity = speed * cos(self.angle), speed * sin(self.angle)
        self.publish(now, *velocity)
        return velocity


@law(20)
@given(seed=seeds, theta=headings, hold=st.integers(1, 30), x=st.sampled_from((0.05, 5.5)))
def test_command_queue_predicts_the_position_at_which_a_command_takes_effect(seed, theta, hold, x):
    """The prediction is correct after any sequence of commands, even at a wall."""
    driver = Wanderer(Random(seed), hold)
    bench = Bench(2.0, (x, 5.5, theta), seed, jitter=False, driver=driver)
    bench.rest(0.72)
    compared = 0
    for (_, before), (_, pose) in pairwise(bench.poses):
        predicted = driver.predicted.pop(round(pose.linear_velocity, 4), None)
        if predicted is not None:
            assert dist(before[:2], predicted) <= 1e-5
            compared += 1
    # turtlesim executes 62.5 % of the commands.
    assert compared >= 55


@law(24)
@given(speed=speeds, radius=st.floats(0.02, 2.0), part=st.floats(0.0, 1.5), angle=headings,
       seed=seeds)
def test_travel_time_is_an_upper_bound(speed, radius, part, angle, seed):
    distance = min(radius + part * speed, 5.4)
    bench = Bench(speed, (5.5, 5.5, 0.3), seed, jitter=False)
    goal = 5.5 + distance * cos(angle), 5.5 + distance * sin(angle)
    start, distance = bench.turtle.pose, bench.distance(goal)
    bench.driver.drive_to(*goal)
    bench.rest(distance / speed + 0.6)
    first = next((time for time, pose in bench.poses if pose[:2] != start[:2]), 0.0)
    reached = next(time for time, pose in bench.poses if dist(pose[:2], goal) <= radius)
    # Starting the final approach during a tick adds at most 0.09 ticks to the travel time.
    assert reached - first <= travel_time(distance, radius, speed) + 0.09 * TICK


@law(30)
@given(speed=speeds, part=st.floats(0.1, 1.0), ticks=st.integers(1, 8))
def test_travel_time_is_one_tick_per_half_of_the_final_approach(speed, part, ticks):
    distance = part * 2.0 * speed * TICK
    time = travel_time(distance, distance * 0.5 ** ticks, speed)
    assert time == pytest.approx(ticks * TICK)
