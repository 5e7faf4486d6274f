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
Test turtlesim_kinematics with examples and with recordings of turtlesim.

A recording contains every published pose and the publication time of each command. The arrival
times of the commands are known only to within a few milliseconds. The test therefore tries every
possible order of commands, calls and ticks. One of these orders must reproduce every recorded pose
exactly.
"""

from bisect import bisect_left, bisect_right
from itertools import product
import json
from math import hypot, inf, nan
from pathlib import Path
import pickle
from struct import pack
from typing import NamedTuple

import pytest
from turtle_brick.core.turtlesim_arena import ARENA_CENTER, ARENA_SIZE, float32, TICK, TurtlePose
from turtle_brick.core.turtlesim_kinematics import Turtle, TurtleSim

RECORDINGS = sorted((Path(__file__).parents[1] / 'data' / 'turtlesim').glob('*.json'))
assert len(RECORDINGS) == 38, '19 scenarios, each with the turtle holonomic and not'

ARRIVAL_JITTER = 0.004
"""Maximum delay (s) between a tick of turtlesim and the recorded arrival of the resulting pose."""


def test_turtle_stays_inside_the_arena() -> None:
    """Motions and teleports beyond a wall end at this wall."""
    turtle = Turtle(x=ARENA_SIZE - 0.01, y=ARENA_SIZE - 1.0, theta=0.0, holonomic=True)
    turtle.command(1.0, -2.0, 0.0)
    assert turtle.tick(0.0).linear_velocity == float32(hypot(1.0, 2.0))
    assert turtle.pose[:2] == (ARENA_SIZE, pytest.approx(ARENA_SIZE - 1.032, abs=1e-6))
    for x, y in ((0.0, 0.0), (ARENA_SIZE, ARENA_SIZE), (5.0, 20.0), (5.0, -2.0)):
        turtle.command(0.0, 0.0, 0.0)
        turtle.teleport_absolute(x, y, 0.0)
        assert turtle.tick(TICK)[:2] == (x, min(max(y, 0.0), ARENA_SIZE))


def test_invalid_numbers_do_not_end_the_simulation() -> None:
    for value, act in product((nan, inf, -inf, 1e300), (
            lambda turtle, value: turtle.command(value, value, value),
            lambda turtle, value: turtle.teleport_absolute(value, value, value),
            lambda turtle, value: turtle.teleport_relative(value, value))):
        sim = TurtleSim(holonomic=True)
        sim.tick(0.0)
        act(sim.turtles['turtle1'], value)
        for tick in (1, 2):
            assert isinstance(sim.tick(tick * TICK)['turtle1'], TurtlePose)
        sim.reset()
        assert sim.tick(3 * TICK)['turtle1'][:2] == (ARENA_CENTER, ARENA_CENTER)


class Call(NamedTuple):
    """A recorded service call, or the recorded poses of two turtles at a given time (s)."""

    begin: float
    end: float
    service: str
    request: dict
    reply: dict


def calls_of(events: list[list]) -> list[Call]:
    calls = []
    for index, (begin, kind, name, content) in enumerate(events):
        if kind == 'call':
            end = next(row[0] for row in events[index:] if row[1] == 'done')
            replies = [row[3] for row in events[index + 1:index + 3] if row[1] == 'reply']
            calls.append(Call(begin, end, name.split('/')[-1], content, *replies or [{}]))
        elif kind == 'poses':
            calls.append(Call(begin, begin, 'poses', {}, {'poses': content['rows']}))
    return calls


def perform(call: Call, sim: TurtleSim, now: float) -> bool:
    """Repeat a recorded call, and return whether the result is the same."""
    if call.service == 'poses':
        poses = {sim.turtles[name].pose[:3] for name in ('far', 'turtle2')}
        return poses == {tuple(row) for row in call.reply['poses']}
    if call.service == 'spawn':
        return sim.spawn(**call.request, now=now) == call.reply['name']
    if call.service == 'kill':
        assert sim.kill(**call.request) == (call.request['name'] != 'nosuch')
    elif call.service == 'reset':
        sim.reset(now)
    else:
        getattr(sim.turtles['turtle1'], call.service)(**call.request)
    return True


@pytest.mark.parametrize('path', RECORDINGS, ids=lambda path: path.stem)
def test_every_recorded_tick_is_reproduced(path: Path) -> None:
    recording = json.loads(path.read_text())
    commands = recording['commands']['rows']
    published = [command[0] for command in commands]
    calls = calls_of(recording['events'])
    begins, ends = [call.begin for call in calls], [call.end for call in calls]
    sim = TurtleSim(recording['holonomic'])
    assert sim.tick(0.0) == {}
    # A state contains the numbers of received commands and executed calls, and a simulator.
    states = {(0, 0, pickle.dumps(sim))}
    for number, (time, *recorded) in enumerate(recording['pose']):
        following = set()
        for old_taken, old_served, pickled in states:
            first_served = max(bisect_left(ends, time - ARRIVAL_JITTER), old_served)
            first_taken = max(bisect_right(published, time - ARRIVAL_JITTER), old_taken)
            last_taken = max(bisect_right(published, time), old_taken)
            for served, taken in product(range(first_served, bisect_left(begins, time) + 1),
                                         range(first_taken, last_taken + 1)):
                sim = pickle.loads(pickled)
                if all(perform(call, sim, time) for call in calls[old_served:served]):
                    for command in commands[old_taken:taken]:
                        sim.turtles['turtle1'].command(*command[1:])
                    if pack('5f', *sim.tick(time)['turtle1']) == pack('5f', *recorded):
                        following.add((taken, served, pickle.dumps(sim)))
        states = following
        assert states, f'tick {number} at {time:.3f} s: no order of arrivals gives {recorded}'
    assert {state[:2] for state in states} == {(len(commands), len(calls))}
