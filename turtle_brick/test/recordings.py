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
Replay recordings of turtlesim.

A recording contains every published pose and the publication time of each command. The arrival
times of the commands are known only to within a few milliseconds. `assert_reproduced` therefore
tries every possible order of commands, calls and ticks. One of these orders must reproduce every
recorded pose exactly.
"""

from bisect import bisect_left, bisect_right
from itertools import product
import pickle
from struct import pack

ARRIVAL_JITTER = 0.004
"""Maximum delay (s) between a tick of turtlesim and the recorded arrival of the resulting pose."""


def assert_reproduced(recording, simulator, get_turtle=lambda turtle: turtle,
                      tick=lambda turtle, time: turtle.tick(time), calls=(), perform=None):
    """
    Require that a simulator reproduces every pose in a recording.

    :param get_turtle: function that returns the recorded turtle of a simulator
    :param tick: function that executes a tick and returns the pose of this turtle
    :param calls: recorded service calls with the attributes `begin` and `end` (s)
    :param perform: function that repeats a call and returns whether the result is the same
    """
    commands = recording['commands']['rows']
    published = [command[0] for command in commands]
    begins, ends = [call.begin for call in calls], [call.end for call in calls]
    # A state contains the numbers of received commands and executed calls, and a simulator.
    states = {(0, 0, pickle.dumps(simulator))}
    for number, (time, *recorded) in enumerate(recording['pose']):
        following = set()
        for old_taken, old_served, pickled in states:
            first_served = max(bisect_left(ends, time - ARRIVAL_JITTER), old_served)
            first_taken = max(bisect_right(published, time - ARRIVAL_JITTER), old_taken)
            last_taken = max(bisect_right(published, time), old_taken)
            for served, taken in product(range(first_served, bisect_left(begins, time) + 1),
                                         range(first_taken, last_taken + 1)):
                simulator = pickle.loads(pickled)
                if all(perform(call, simulator, time) for call in calls[old_served:served]):
                    for command in commands[old_taken:taken]:
                        get_turtle(simulator).command(*command[1:])
                    if pack('5f', *tick(simulator, time)) == pack('5f', *recorded):
                        following.add((taken, served, pickle.dumps(simulator)))
        states = following
        assert states, f'tick {number} at {time:.3f} s: no order of arrivals gives {recorded}'
    assert {state[:2] for state in states} == {(len(commands), len(calls))}
