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
"""
The Driver with turtlesim's kinematics in the loop, at the real rates, and CommandPath alone.

turtlesim ticks every 16 ms and takes one command per tick from its queue of seven; commands are
published every 10 ms; both jitter, and messages take some time. `Bench` plays this in the order
of time, with random phases.
"""

from collections import deque
from math import cos, exp, hypot, log, pi, sin
from random import Random

from hypothesis import assume, given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.driving import CommandPath, Driver, PERIOD, STALE, travel_time, within_arena
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE, TICK, Turtle, TurtlePose

RADIUS = 0.5
TRANSPORT = 0.0004
# The longest time from publishing a command to the tick that takes it.
QUEUE = 0.077


class Bench:
    """turtlesim, a Driver and what lies between them; instants in s from the start."""

    def __init__(self, max_velocity, start=(5.5, 5.5, 0.0), seed=0, jitter=True):
        self.random = Random(seed)
        self.max_velocity = max_velocity
        self.turtle = Turtle(*start, holonomic=True)
        self.driver = Driver(max_velocity)
        self.tick_jitter, self.cycle_jitter = (0.002, 0.0003) if jitter else (0.0, 0.0)
        self.now = 0.0
        self.tick_grid = self.tick_at = self.random.uniform(0.0, TICK)
        self.cycle_grid = self.cycle_at = self.random.uniform(0.0, PERIOD)
        self.commands_on_their_way = deque()
        self.poses_on_their_way = deque()
        self.poses = []
        self.commands = []

    def run(self, until):
        """Let time pass up to an instant."""
        while min(self.tick_at, self.cycle_at) <= until:
            if self.tick_at <= self.cycle_at:
                self.now = self.tick_at
                self.tick()
            else:
                self.now = self.cycle_at
                self.cycle()
        self.now = until

    def tick(self):
        """Do what turtlesim does every 16 ms."""
        now, inbox = self.now, self.commands_on_their_way
        while inbox and inbox[0][0] <= now:
            _, linear_x, linear_y = inbox.popleft()
            self.turtle.command(linear_x, linear_y, 0.0)
        pose = self.turtle.tick(now)
        self.poses.append((now, pose))
        self.poses_on_their_way.append((now + TRANSPORT, pose))
        self.tick_grid += TICK
        self.tick_at = max(self.tick_grid + self.random.gauss(0.0, self.tick_jitter), now + 1e-4)

    def cycle(self):
        """Do what the robot does 100 times per second, for each cycle that is due."""
        now = self.now
        self.hear(now)
        due = 1
        self.cycle_grid += PERIOD
        while self.cycle_grid < now - PERIOD / 2.0:
            self.cycle_grid += PERIOD
            due += 1
        for _ in range(due):
            command = self.driver.command(now)
            assert hypot(*command) <= self.max_velocity * (1.0 + 1e-12)
            self.commands.append((now, *command))
            self.commands_on_their_way.append((now + TRANSPORT, *command))
        self.cycle_at = max(
            self.cycle_grid + self.random.gauss(0.0, self.cycle_jitter), now + 1e-4)

    def hear(self, now):
        """Let the driver have the poses that have arrived by now."""
        inbox = self.poses_on_their_way
        while inbox and inbox[0][0] <= now:
            self.driver.observe(*inbox.popleft())

    def stall_robot(self, length):
        """Keep the robot busy with something else: it hears and says nothing for a while."""
        end = self.now + length
        while self.tick_at < end:
            self.now = self.tick_at
            self.tick()
        # Everything that arrived meanwhile is heard when it is over, timers first.
        self.now = self.cycle_at = end
        late, self.poses_on_their_way = self.poses_on_their_way, deque()
        self.cycle()
        for _, pose in late:
            self.driver.observe(end + 1e-4, pose)

    def stall_turtlesim(self, length):
        """Keep turtlesim from ticking for a while; the ticks are lost, its queue is not."""
        self.tick_at = self.now + length
        while self.tick_grid < self.tick_at:
            self.tick_grid += TICK

    def restart_turtlesim(self, away, start):
        """Replace turtlesim by a new one after a while; what is sent meanwhile is lost."""
        self.tick_at = self.tick_grid = self.now + 2.0 * away
        self.run(self.now + away)
        self.commands_on_their_way.clear()
        self.turtle = Turtle(*start, holonomic=True, now=self.now)
        self.tick_at = self.tick_grid = self.now

    def distance(self, goal):
        """Return how far the turtle is from a goal."""
        return hypot(self.turtle.pose.x - goal[0], self.turtle.pose.y - goal[1])

    def assert_rests(self, goal, since, until):
        """See that the turtle rests at its goal from an instant on, and is told nothing else."""
        self.run(until)
        assert self.poses[-1][0] > until - 0.1
        for time, pose in self.poses:
            assert time < since or hypot(pose.x - goal[0], pose.y - goal[1]) <= 0.005
        for time, linear_x, linear_y in self.commands:
            assert time < since or linear_x == linear_y == 0.0
        assert self.driver.arrived


@st.composite
def places(draw):
    """Draw a place in the arena."""
    inside = st.floats(0.0, ARENA_SIZE)
    return draw(inside), draw(inside)


speeds = st.builds(exp, st.floats(log(0.1), log(10.0)))
headings = st.floats(-pi, pi)
seeds = st.integers(0, 2 ** 32)


@st.composite
def drives(draw, longest=3.0):
    """Draw a speed, a start with heading and a goal that is at most so many seconds away."""
    speed = draw(speeds)
    x, y = draw(places())
    angle = draw(headings)
    way = speed * draw(st.one_of(st.floats(0.0, longest), st.floats(0.0, 0.05)))
    goal = within_arena(x + way * cos(angle), y + way * sin(angle))
    assume(hypot(goal[0] - x, goal[1] - y) > 1e-3)
    return speed, (x, y, draw(headings)), goal


def measure(bench, goal):
    """
    Drive to a goal that is given at 0.3 s, straight, in time and without hunting.

    :return: the overshoot (m), from the pose at which the order finds it at rest
    """
    bench.run(0.3)
    x, y = bench.turtle.pose[:2]
    distance, speed = bench.distance(goal), bench.max_velocity
    bench.driver.drive_to(*goal)
    bench.assert_rests(goal, 0.3 + distance / speed + 0.6, 0.3 + distance / speed + 1.2)

    reached = next(time for time, pose in bench.poses
                   if hypot(pose.x - goal[0], pose.y - goal[1]) <= RADIUS)
    assert reached - 0.3 <= max(distance - RADIUS, 0.0) / speed + 0.12
    ex, ey = (goal[0] - x) / distance, (goal[1] - y) / distance
    # Beyond, what jitter makes it overshoot may lead it along a wall.
    assert all(abs((pose.x - x) * ey - (pose.y - y) * ex) <= 0.005
               for time, pose in bench.poses if time <= reached)
    assert max(hypot(*command[1:]) for command in bench.commands) == pytest.approx(
        min(speed, 0.5 * distance / TICK))
    return max((pose.x - goal[0]) * ex + (pose.y - goal[1]) * ey for _, pose in bench.poses)


# --------------------------------------------------------------------------------- the closed loop

@law(70)
@given(drive=drives(), seed=seeds, jitter=st.booleans())
def test_arrives_in_time_without_overshoot_and_rests(drive, seed, jitter):
    """With ticks that jitter by 2 ms and commands that jitter by 0.3 ms, or without."""
    speed, start, goal = drive
    bench = Bench(speed, start, seed, jitter)
    assert measure(bench, goal) <= (0.020 * speed if jitter else 0.001 * speed + 1e-5)
    # The goal that is sent again moves nothing, not even the millimetre that jitter has left.
    bench.driver.drive_to(*goal)
    since = bench.now
    bench.assert_rests(goal, since, since + 0.3)


@law(40)
@given(drive=drives(1.5), second=places(), part=st.floats(0.0, 1.2), seed=seeds)
def test_goal_may_change_at_any_time(drive, second, part, seed):
    """It first obeys what is in the queue, then drives to the new goal as to any other."""
    speed, start, goal = drive
    bench = Bench(speed, start, seed)
    bench.run(0.3)
    bench.driver.drive_to(*goal)
    changed = 0.3 + part * bench.distance(goal) / speed
    bench.run(changed)
    way = min(bench.distance(second), 1.5 * speed) / max(bench.distance(second), 1e-9)
    x, y = bench.turtle.pose[:2]
    second = x + way * (second[0] - x), y + way * (second[1] - y)
    bench.driver.drive_to(*second)
    # What is in the queue, and the wait for the next cycle, may lead away from it.
    rest = changed + bench.distance(second) / speed + 0.6 + QUEUE + PERIOD
    bench.assert_rests(second, rest, rest + 0.3)


@law(25)
@given(speed=speeds, seed=seeds, away=st.floats(0.0, 4e-4), angle=headings)
def test_goal_where_it_stands_moves_nothing(speed, seed, away, angle):
    bench = Bench(speed, seed=seed)
    bench.run(0.2)
    bench.driver.drive_to(5.5 + away * cos(angle), 5.5 + away * sin(angle))
    bench.run(0.6)
    assert all(command[1:] == (0.0, 0.0) for command in bench.commands)
    assert bench.driver.arrived


@law(30)
@given(drive=drives(), theta=headings, part=st.floats(0.0, 1.0), place=places(), seed=seeds)
def test_teleported_turtle_drives_straight_to_its_goal(drive, theta, part, place, seed):
    """From wherever it was put with whatever heading, once its queue has been obeyed."""
    speed, start, goal = drive
    bench = Bench(speed, start, seed)
    bench.run(0.3)
    bench.driver.drive_to(*goal)
    bench.run(0.3 + part * bench.distance(goal) / speed)
    away = min(1.0, 1.5 * speed / max(hypot(place[0] - goal[0], place[1] - goal[1]), 1e-9))
    bench.turtle.teleport_absolute(goal[0] + away * (place[0] - goal[0]),
                                   goal[1] + away * (place[1] - goal[1]), theta)
    bench.run(bench.now + QUEUE + 2.0 * TICK)
    seen = len(bench.poses)
    x, y = bench.turtle.pose[:2]
    distance = bench.distance(goal)
    rest = bench.now + distance / speed + 0.6
    bench.assert_rests(goal, rest, rest + 0.3)
    assume(distance > 0.01)
    for _, pose in bench.poses[seen:]:
        aside = ((pose.x - x) * (goal[1] - y) - (pose.y - y) * (goal[0] - x)) / distance
        assert abs(aside) <= 0.005 + 0.005 * speed


# --------------------------------------------------------------------------------- what goes wrong

def test_stands_still_without_a_goal_and_without_a_pose():
    driver = Driver(3.0)
    assert driver.pose is None
    for cycle in range(50):
        assert driver.command(cycle * PERIOD) == (0.0, 0.0)
    driver.drive_to(1.0, 1.0)
    for cycle in range(50, 100):
        assert driver.command(cycle * PERIOD) == (0.0, 0.0)
    assert not driver.arrived
    bench = Bench(3.0)
    bench.run(0.5)
    assert bench.driver.goal is None
    assert all(command[1:] == (0.0, 0.0) for command in bench.commands)


@law(30)
@given(speed=speeds, start=places(), theta=headings, restart=places(), again=headings,
       after=st.floats(0.0, 0.4), away=st.floats(0.3, 1.5), seed=seeds)
def test_stands_while_the_pose_is_stale_and_goes_on_with_a_new_turtlesim(
        speed, start, theta, restart, again, after, away, seed):
    """Which begins at another place, with another heading and an empty queue."""
    way = min(1.0, speed / 12.0)
    restart = start[0] + way * (restart[0] - start[0]), start[1] + way * (restart[1] - start[1])
    goal = within_arena(start[0] + speed, start[1])
    bench = Bench(speed, (*start, theta), seed)
    bench.run(0.3)
    bench.driver.drive_to(*goal)
    bench.run(0.3 + after)
    gone, last = bench.now, bench.poses[-1][0]
    bench.restart_turtlesim(away, (*restart, again))
    silent = [command for command in bench.commands if last + STALE + 0.001 < command[0]]
    assert len(silent) >= (away - STALE - TICK) / PERIOD - 2
    assert all(command[1:] == (0.0, 0.0) for command in silent)
    assert bench.now == pytest.approx(gone + away)
    rest = bench.now + bench.distance(goal) / speed + 0.6
    bench.poses.clear()
    bench.commands.clear()
    bench.assert_rests(goal, rest, rest + 0.3)


def test_pose_becomes_stale_after_so_long():
    path = CommandPath()
    assert path.is_stale(0.0)
    path.observe(1.0, TurtlePose(5.0, 5.0, 0.0, 0.0, 0.0))
    assert not path.is_stale(1.0 + STALE)
    assert path.is_stale(1.001 + STALE)


@law(50)
@given(drive=drives(1.0), part=st.floats(0.0, 1.0), length=st.floats(0.01, 0.6), seed=seeds,
       own=st.booleans())
def test_survives_a_stall(drive, part, length, seed, own):
    """
    Of turtlesim, which takes one command per tick all the same, or its own.

    In one of its own, what turtlesim has in its queue lasts for seven ticks; then turtlesim goes
    on with the last command.
    """
    speed, start, goal = drive
    bench = Bench(speed, start, seed)
    bench.run(0.3)
    (x, y), distance = bench.turtle.pose[:2], bench.distance(goal)
    bench.driver.drive_to(*goal)
    bench.run(0.3 + part * distance / speed)
    if own:
        bench.stall_robot(length)
    else:
        bench.stall_turtlesim(length)
    rest = bench.now + length + distance / speed + (0.8 if own else 0.6)
    bench.assert_rests(goal, rest, rest + 0.3)
    ex, ey = (goal[0] - x) / distance, (goal[1] - y) / distance
    overshoot = max((pose.x - goal[0]) * ex + (pose.y - goal[1]) * ey for _, pose in bench.poses)
    assert overshoot <= (0.020 + (length if own else 0.0)) * speed


# ------------------------------------------------------------------------------ what it is made of

@law(30)
@given(seed=seeds, theta=headings, hold=st.integers(1, 30), wall=st.booleans())
def test_predicts_the_pose_at_which_a_command_takes_effect(seed, theta, hold, wall):
    """
    Whatever was commanded before, a while of standing still first; walls included.

    Every command has a speed of its own, so that the poses tell which one a tick has taken.
    """
    random = Random(seed)
    turtle = Turtle(0.05 if wall else 5.5, 5.5, theta, holonomic=True)
    path = CommandPath()
    tick_at, publish_at = random.uniform(0.0, TICK), random.uniform(0.0, PERIOD)
    to_turtle, to_path = deque(), deque()
    predicted, taken_after = {}, {}
    angle = count = 0
    while len(predicted) < 100:
        if tick_at <= publish_at:
            while to_turtle and to_turtle[0][0] <= tick_at:
                _, linear_x, linear_y = to_turtle.popleft()
                turtle.command(linear_x, linear_y, 0.0)
            before = turtle.pose
            pose = turtle.tick(tick_at)
            taken_after.setdefault(round(pose.linear_velocity, 4), before)
            to_path.append((tick_at + TRANSPORT, pose))
            tick_at += TICK
        else:
            while to_path and to_path[0][0] <= publish_at:
                path.observe(*to_path.popleft())
            if count % hold == 0:
                angle = random.uniform(-pi, pi)
            speed = 0.0
            if path.pose is not None:
                speed = round(0.5 + 0.01 * count, 4)
                predicted[speed] = path.predict(publish_at)
            count += 1
            command = speed * cos(angle), speed * sin(angle)
            path.publish(publish_at, *command)
            to_turtle.append((publish_at + TRANSPORT, *command))
            publish_at += PERIOD
    compared = 0
    for speed, (x, y) in predicted.items():
        if speed in taken_after:
            before = taken_after[speed]
            assert hypot(before.x - x, before.y - y) <= 1e-5
            compared += 1
    # 62.5 of 100 are taken, less those that are on their way in the end.
    assert compared >= 55


@law(50)
@given(speed=speeds, radius=st.floats(0.02, 2.0), part=st.floats(0.0, 1.5), angle=headings,
       seed=seeds)
def test_travel_time_is_what_the_way_takes_at_most(speed, radius, part, angle, seed):
    """From the first pose that shows motion to the first one within the radius."""
    distance = min(radius + part * speed, 5.4)
    bench = Bench(speed, (5.5, 5.5, 0.3), seed, jitter=False)
    goal = 5.5 + distance * cos(angle), 5.5 + distance * sin(angle)
    bench.run(0.3)
    rest = bench.turtle.pose
    distance = bench.distance(goal)
    bench.driver.drive_to(*goal)
    bench.run(0.3 + distance / speed + 0.6)
    first = next((time for time, pose in bench.poses if pose[:2] != rest[:2]), 0.0)
    reached = next(time for time, pose in bench.poses
                   if hypot(pose.x - goal[0], pose.y - goal[1]) <= radius)
    # The approach begins in the middle of a tick: that costs up to 0.09 of one.
    assert reached - first <= travel_time(distance, radius, speed) + 0.09 * TICK


@law(60)
@given(distance=st.floats(0.0, 16.0), more=st.floats(0.0, 5.0), radius=st.floats(0.01, 10.0),
       speed=st.floats(0.01, 10.0))
def test_travel_time_is_the_way_over_the_speed(distance, more, radius, speed):
    """As long as the platform covers the approach; never less, and more for a longer way."""
    time = travel_time(distance, radius, speed)
    assert time >= max(distance - radius, 0.0) / speed - 1e-12
    assert travel_time(distance + more, radius, speed) >= time - 1e-12
    assert travel_time(distance, radius + more, speed) <= time + 1e-12
    if radius >= 2.0 * speed * TICK:
        assert time == pytest.approx(max(distance - radius, 0.0) / speed)


def test_within_arena_is_the_nearest_point():
    assert within_arena(3.0, 4.0) == (3.0, 4.0)
    assert within_arena(-1.0, 4.0) == (0.0, 4.0)
    assert within_arena(12.0, -3.0) == (ARENA_SIZE, 0.0)
    assert within_arena(5.0, 1e9) == (5.0, ARENA_SIZE)
