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
"""Test the goals and decisions of the catcher with random falls."""

from dataclasses import replace
from math import cos, dist, pi, sin

from defaults import GRAVITY, make_world, PARAMETERS, REST_Z, seconds
from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from test_catch_logic import CatchBench
from turtle_brick.core.catch_logic import CENTER, State
from turtle_brick.core.turtlesim_arena import nearest_in_arena
from turtle_brick.physics import BrickState, STEP_NS


@law(8)
@given(angle=st.floats(-pi, pi), time=st.floats(0.0, 1.2), speed=st.floats(1.0, 10.0))
def test_goals_are_inside_the_arena(angle, time, speed):
    bench = CatchBench(replace(PARAMETERS, max_velocity=speed))
    x, y = CENTER[0] + 8.0 * cos(angle), CENTER[1] + 8.0 * sin(angle)
    bench.drop(*nearest_in_arena(x, y), 2000.0)
    bench.run(0.1 + time)
    assert bench.catcher.state is State.APPROACHING
    bench.world.brick = (5.0, 5.0, 1.0)
    bench.reach_state(State.WAITING, 3.0)
    _, stop = bench.goals
    assert stop == nearest_in_arena(*stop)
    assert dist(stop, bench.robot) <= 0.15 * speed


@law(100)
@given(data=st.data(), height=st.floats(REST_Z + 0.5, 9.0), platform_x=st.sampled_from((5.0, 9.0)))
def test_one_decision_per_fall_whatever_the_order_of_the_positions(data, height, platform_x):
    """Positions are lost, repeated, wrong and delayed, so that some arrive after the landing."""
    world, now, arrivals, falls = make_world(), seconds(200.0), [], {}
    delays = data.draw(st.lists(st.sampled_from((0.0, 0.0, 0.0, 0.004, 0.05, 2.0)), min_size=1))
    copies = data.draw(st.lists(st.sampled_from((1, 1, 1, 0, 2)), min_size=1, max_size=9))
    wrong = data.draw(st.sets(st.integers(2, 200), max_size=4))
    for _ in range(2):
        world.brick = (5.0, 5.0, height)
        world.release()
        release = now
        for number in range(1, 375):
            now += STEP_NS
            world.step()
            x, y, z = world.brick
            is_right = number not in wrong
            falls[now] = release if world.state is BrickState.FALLING and is_right else None
            for copy in range(copies[number % len(copies)]):
                delay = seconds(delays[(number // 5 + copy) % len(delays)])
                arrivals.append((now + delay, now, (x, y, z if is_right else z - 0.5)))
    bench, newest, seen, detectable = CatchBench(), 0, [], []
    bench.robot = bench.goal = (platform_x, 5.0)
    for bench.now, stamp, brick in sorted(arrivals):
        if stamp > newest:
            newest = stamp
            seen.append(falls[stamp])
            if seen[-1] and seen[-1] not in detectable and seen[-3:].count(seen[-1]) == 3:
                detectable.append(seen[-1])
        bench.catcher.brick.observe(stamp, brick)
        if bench.catcher.is_update_due(bench.now):
            bench.update()
    decided = [decision.fall.release_time(GRAVITY) for decision in bench.decisions]
    assert decided == pytest.approx(detectable, abs=1_000_000)
