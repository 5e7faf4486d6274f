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
"""Test turtlesim_kinematics with examples and with recordings of turtlesim."""

import json
from math import hypot, inf, nan
from pathlib import Path

import pytest
from recordings import assert_reproduced
from turtle_brick.core.turtlesim_arena import ARENA_SIZE, float32, TICK, TurtlePose
from turtle_brick.core.turtlesim_kinematics import COMMAND_TIMEOUT, QUEUE_DEPTH, Turtle

RECORDINGS = sorted((Path(__file__).parents[1] / 'data' / 'turtlesim').glob('*.json'))
assert len(RECORDINGS) == 24, '12 scenarios, each with the turtle holonomic and not'


def test_turtle_executes_one_command_per_tick_and_keeps_the_newest_seven() -> None:
    turtle = Turtle(x=1.0, y=2.0, holonomic=True)
    for speed in range(1, QUEUE_DEPTH + 3):
        turtle.command(float(speed), 0.0, 0.0)
    speeds = [turtle.tick(tick * TICK).linear_velocity for tick in range(QUEUE_DEPTH + 1)]
    assert speeds == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 9.0]
    assert turtle.pose[:2] == (pytest.approx(1.0 + sum(speeds) * TICK), 2.0)
    assert turtle.tick(QUEUE_DEPTH * TICK + COMMAND_TIMEOUT).linear_velocity == 0.0


def test_turtle_stays_inside_the_arena() -> None:
    """A motion beyond a wall ends at this wall."""
    turtle = Turtle(x=ARENA_SIZE - 0.01, y=ARENA_SIZE - 1.0, theta=0.0, holonomic=True)
    turtle.command(1.0, -2.0, 0.0)
    assert turtle.tick(0.0).linear_velocity == float32(hypot(1.0, 2.0))
    assert turtle.pose[:2] == (ARENA_SIZE, pytest.approx(ARENA_SIZE - 1.032, abs=1e-6))


@pytest.mark.parametrize('value', (nan, inf, -inf, 1e300))
def test_invalid_numbers_do_not_end_the_simulation(value: float) -> None:
    turtle = Turtle(holonomic=True)
    turtle.command(value, value, value)
    assert isinstance(turtle.tick(0.0), TurtlePose)
    assert isinstance(turtle.tick(TICK), TurtlePose)


@pytest.mark.parametrize('path', RECORDINGS, ids=lambda path: path.stem)
def test_every_recorded_tick_is_reproduced(path: Path) -> None:
    recording = json.loads(path.read_text())
    assert_reproduced(recording, Turtle(holonomic=recording['holonomic']))
