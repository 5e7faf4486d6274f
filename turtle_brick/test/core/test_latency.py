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

"""Test the excess latency with examples and random input, and test catches over slow links."""

from heapq import heappop, heappush
from math import cos, pi, sin
from random import Random

from hypothesis import given
from hypothesis import strategies as st
from laws import law, NS_PER_SECOND, PARAMETERS, seconds
import pytest
from test_catch_logic import CatchBench, COURSE
from turtle_brick.core.catch_logic import DriveGoal, State, TiltCommand
from turtle_brick.core.driving import COMMAND_PERIOD
from turtle_brick.core.latency import (CLOCK_TOLERANCE, LatencyMonitor, LOSS_RESERVE, MIN_GAPS,
                                       USUAL_AGE, WINDOW)
from turtle_brick.core.reachability import COMMAND_LATENCY, Decision, guaranteed_distance
from turtle_brick.physics import Phase, STEP_NS


def test_age_of_transforms_counts_twice():
    latency = LatencyMonitor()
    assert (latency.excess(NS_PER_SECOND), latency.clock_error(NS_PER_SECOND)) == (0.0, 0.0)
    latency.record_ages(NS_PER_SECOND, [0.1])
    assert latency.excess(NS_PER_SECOND) == pytest.approx(2.0 * (0.1 - USUAL_AGE))


def test_response_delay_counts_at_its_second_occurrence_or_if_transforms_are_late():
    """A node that stops once, for example in a debugger, does not indicate a slow link."""
    latency = LatencyMonitor()
    for time, delay, excess in ((1, 0.9, 0.0), (2, 0.3, 0.3), (3, 0.4, 0.4), (11.5, 0.1, 0.3)):
        latency.record_response_delay(seconds(time), delay)
        assert latency.excess(seconds(time)) == excess
    latency.record_ages(seconds(11.5), [USUAL_AGE + 0.001])
    assert latency.excess(seconds(11.5)) == 0.4


def test_gaps_between_timestamps_indicate_lost_messages():
    latency, stamp = LatencyMonitor(), NS_PER_SECOND
    for gap in range(MIN_GAPS):
        assert not latency.loses_messages(stamp) and latency.excess(stamp) == 0.0
        for steps in (1,) * 20 + (2 + 5 * gap,):
            stamp += steps * STEP_NS
            latency.record_brick_stamp(stamp)
    assert latency.loses_messages(stamp) and latency.excess(stamp) == LOSS_RESERVE


def test_restarts_of_the_brick_broadcaster_do_not_indicate_lost_messages():
    latency = LatencyMonitor()
    for start in (4.002, 6.003, 8.005, 10.006):
        for step in range(50):
            latency.record_brick_stamp(seconds(start) + step * STEP_NS)
    assert not latency.loses_messages(12 * NS_PER_SECOND)


@pytest.mark.parametrize('rest', [2, 3, 4, 6, 10, 50])
def test_late_callbacks_count_only_if_they_are_frequent(rest):
    """One out of every `rest` callbacks is late and receives late transforms."""
    latency = LatencyMonitor()
    for call in range(1000):
        late = call % rest == 0
        latency.record_ages(seconds(1.0 + 0.02 * call), [0.1 if late else 0.0], late)
    assert latency.excess(20 * NS_PER_SECOND) == (2.0 * (0.1 - USUAL_AGE) if rest < 5 else 0.0)


@law(40)
@given(ages=st.lists(st.tuples(st.floats(0.0, 0.3), st.floats(0.0, 0.3)), min_size=1,
                     max_size=300))
def test_excess_latency_covers_99_percent_of_the_recent_transforms(ages):
    latency, now = LatencyMonitor(), NS_PER_SECOND
    recorded = []
    for pause, age in ages:
        now += seconds(pause)
        latency.record_ages(now, [age])
        recorded.append((now, age))
        link = latency.excess(now) / 2.0 + USUAL_AGE
        recent = [age for then, age in recorded if (now - then) * 1e-9 <= WINDOW]
        assert sum(age > link + 1e-9 for age in recent) <= 0.01 * len(recent) + 0.5
        assert link == USUAL_AGE or sum(age >= link - 1e-9 for age in recent) >= (
            0.01 * len(recent) - 0.5)
    # Transform ages of more than 1 s are invalid.
    before = latency.excess(now)
    latency.record_ages(now, [1.1, -1.1])
    assert latency.excess(now) == before and latency.clock_error(now) == 0.0
    assert latency.excess(now + seconds(WINDOW) + 1) == 0.0


@law(20)
@given(pause=st.floats(0.03, 0.5), way=st.floats(0.05, 1.0), time=st.floats(0.3, 2.0),
       overloaded=st.booleans())
def test_pauses_of_the_robot_count_on_an_overloaded_machine(pause, way, time, overloaded):
    """The expected pause time is the duration times the paused fraction, plus one pause."""
    latency, stamp, count = LatencyMonitor(), NS_PER_SECOND, round(way / COMMAND_PERIOD)
    for _ in range(50):
        latency.record_ages(NS_PER_SECOND, [], overloaded)
    while stamp < 15 * NS_PER_SECOND:
        for interval in [COMMAND_PERIOD] * count + [pause]:
            stamp += seconds(interval)
            latency.record_robot_stamp(stamp)
    lost = (pause - COMMAND_PERIOD) * overloaded
    fraction = lost / (count * COMMAND_PERIOD + pause)
    assert latency.expected_standstill(stamp, time) == pytest.approx(
        fraction * time + lost, abs=lost / WINDOW * time + 1e-9)
    assert latency.expected_standstill(stamp + seconds(WINDOW) + 1, time) == 0.0


@law(20)
@given(ahead=st.floats(0.0, 1.0), link=st.floats(0.0, 0.2), motion=st.floats(0.0, 0.5))
def test_clock_error_is_added_to_the_excess_latency(ahead, link, motion):
    latency = LatencyMonitor()
    latency.record_ages(NS_PER_SECOND, [-ahead, link - ahead])
    latency.record_response_delay(NS_PER_SECOND, motion)
    excess = latency.excess(NS_PER_SECOND)
    if ahead > CLOCK_TOLERANCE:
        assert latency.clock_error(NS_PER_SECOND) == ahead
        assert excess >= 2.0 * (link - USUAL_AGE) + ahead + motion - 1e-9
    else:
        assert latency.clock_error(NS_PER_SECOND) == 0.0
        transport = 2.0 * max(link - ahead - USUAL_AGE, 0.0)
        assert excess == pytest.approx(max(transport, motion if transport > 0.0 else 0.0))


class NetworkBench(CatchBench):
    """A CatchBench with the catcher, the arena and the robot on three machines."""

    def __init__(self, mean, deviation, loss, seed):
        self.mean, self.deviation, self.loss = mean, deviation, loss
        self.link = Random(seed)
        self.messages = []
        self.latest = {}
        self.ages = []
        super().__init__()

    def send(self, kind, content, latency=0.0):
        if self.link.random() >= self.loss:
            delay = latency + max(self.link.gauss(self.mean, self.deviation), 0.0)
            heappush(self.messages, (self.now + seconds(delay), kind, self.now, content))

    def step(self):
        if self.steps % 3 == 0:  # The robot publishes 83 poses per second.
            for kind in ('to the arena', 'to the catcher'):
                self.send(kind, self.platform())
        _, self.world.platform = self.latest.get('to the arena', (0, None))
        self.world.step()
        self.send('brick', self.world.brick)
        is_new_fall = False
        while self.messages and self.messages[0][0] <= self.now:
            arrival, kind, sent, content = heappop(self.messages)
            if sent < self.latest.get(kind, (0, None))[0]:
                continue  # A newer message has already arrived.
            self.latest[kind] = (sent, content)
            if kind == 'goal':
                self.goal = content
            elif kind == 'tilt':
                self.angle = content
            elif kind != 'to the arena':
                self.ages.append((arrival - sent) * 1e-9)
                if kind == 'brick':
                    is_new_fall |= self.catcher.observe_brick(sent, content)
        return is_new_fall

    def observed_platform(self):
        return self.latest.get('to the catcher', (0, None))[1]

    def update(self):
        self.catcher.latency.record_ages(self.now, self.ages)
        self.ages.clear()
        super().update()

    def execute(self, action):
        if isinstance(action, DriveGoal):
            self.send('goal', (action.x, action.y), COMMAND_LATENCY - 0.01)
        elif isinstance(action, TiltCommand):
            self.send('tilt', action.angle)


@pytest.mark.parametrize(('loss', 'goals', 'tilts'), [
    (0.0, range(1, 2), range(1, 2)), (0.05, range(5, 10), range(3, 10))])
def test_commands_are_repeated_only_if_messages_are_lost(loss, goals, tilts):
    bench = NetworkBench(0.01, 0.0, loss, seed=3)
    bench.drop(7.0, 6.0, 9.0)
    bench.reach_state(State.APPROACHING)
    bench.run(0.08)
    for command, counts in ((DriveGoal(7.0, 6.0), goals), (TiltCommand(0.0), tilts)):
        published = bench.published(type(command))
        assert set(published) == {command} and len(published) in counts
    bench.reach_state(State.WAITING)


@pytest.mark.parametrize(('mean', 'deviation', 'loss'), [
    (0.0, 0.0, 0.0), (0.06, 0.015, 0.0), (0.005, 0.002, 0.03), (0.03, 0.005, 0.01)])
def test_decisions_are_correct_over_any_link(mean, deviation, loss):
    """Reachable bricks are caught. All bricks within the guaranteed distance are reachable."""
    bench, random = NetworkBench(mean, deviation, loss, seed=1), Random(2)
    caught = refused = 0
    for number in range(12):
        bench.run(1.0)
        excess = bench.catcher.latency.excess(bench.now)
        height = random.uniform(6.0, 12.0)
        limit = guaranteed_distance(height, PARAMETERS, excess)
        way = random.uniform(0.6, 1.1) * min(limit, 4.5)
        angle = random.uniform(-pi, pi)
        bench.drop(bench.robot[0] + way * cos(angle), bench.robot[1] + way * sin(angle), height)
        released = bench.now
        assert bench.run(3.0, lambda: bench.published(Decision) and bench.world.phase in (
            Phase.RIDING, Phase.GROUNDED))
        decision, = bench.published(Decision)
        assert decision.reachable is (bench.world.phase is Phase.RIDING), (number, decision)
        if decision.reachable:
            caught += 1
            bench.reach_state(State.WAITING)
            assert bench.states == COURSE
        else:
            refused += 1
            decided = next(time for time, action in bench.actions if action is decision)
            late = max((decided - released) * 1e-9 - 0.012, 0.0)
            assert way > guaranteed_distance(
                height, PARAMETERS, decision.latency - COMMAND_LATENCY + late), decision
    assert caught and refused
