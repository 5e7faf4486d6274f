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

"""Measured latency: what it follows, and that both promises hold over links of any delay."""

from math import cos, pi, sin
from random import Random

from hypothesis import given
from hypothesis import strategies as st
from laws import law, NS_PER_SECOND, PARAMETERS, seconds
import pytest
from test_catch_logic import COURSE, Stage
from turtle_brick.core.catch_logic import DriveGoal, State, TiltCommand
from turtle_brick.core.driving import COMMAND_PERIOD
from turtle_brick.core.latency import (CLOCK_TOLERANCE, LatencyMonitor, LOSS_RESERVE, MIN_GAPS, WINDOW,
                                       USUAL_AGE)
from turtle_brick.core.reachability import COMMAND_LATENCY, Decision, guaranteed_distance
from turtle_brick.physics import Phase, STEP_NS


@law(40)
@given(ages=st.lists(st.tuples(st.floats(0.0, 0.3), st.floats(0.0, 0.3)), min_size=1,
                     max_size=300))
def test_latency_is_that_of_the_slow_messages_of_the_recent_past(ages):
    """Out and back, each as slow as all but one in a hundred."""
    latency, now = LatencyMonitor(), NS_PER_SECOND
    heard = []
    for pause, age in ages:
        now += seconds(pause)
        latency.record_ages(now, [age])
        heard.append((now, age))
        link = latency.excess(now) / 2.0 + USUAL_AGE
        recent = [age for then, age in heard if (now - then) * 1e-9 <= WINDOW]
        assert sum(age > link + 1e-9 for age in recent) <= 0.01 * len(recent) + 0.5
        assert link == USUAL_AGE or sum(age >= link - 1e-9 for age in recent) >= (
            0.01 * len(recent) - 0.5)
    # Not a delay but nonsense, which anybody may publish.
    before = latency.excess(now)
    latency.record_ages(now, [1.1, -1.1])
    assert latency.excess(now) == before and latency.clock_error(now) == 0.0
    assert latency.excess(now + seconds(WINDOW) + 1) == 0.0


def test_lost_messages_cost_a_reserve_and_a_node_that_stood_still_does_not():
    latency, stamp = LatencyMonitor(), NS_PER_SECOND
    for loss in range(MIN_GAPS):
        assert not latency.loses_messages(stamp) and latency.excess(stamp) == 0.0
        for steps in (1,) * 20 + (2 + 5 * loss,):
            stamp += steps * STEP_NS
            latency.record_brick_stamp(stamp)
    assert latency.loses_messages(stamp) and latency.excess(stamp) == LOSS_RESERVE
    # A brick that isn't broadcast for a while, and comes back on another grid, loses nothing.
    other = LatencyMonitor()
    for begin in range(2, 6):
        for step in range(50):
            other.record_brick_stamp(begin * 2 * NS_PER_SECOND + begin * 1_234_567 + step * STEP_NS)
    assert not other.loses_messages(12 * NS_PER_SECOND)


@pytest.mark.parametrize('rest', [2, 3, 4, 6, 10, 50])
def test_who_is_late_all_the_time_measures_that_and_who_stood_still_for_once_does_not(rest):
    """One call out of so many is late, and with it what it hears of."""
    latency = LatencyMonitor()
    for call in range(1000):
        late = call % rest == 0
        latency.record_ages(NS_PER_SECOND + call * seconds(0.02), [0.1 if late else 0.0], late)
    assert latency.excess(20 * NS_PER_SECOND) == (2.0 * (0.1 - USUAL_AGE) if rest < 5 else 0.0)


@law(20)
@given(pause=st.floats(0.03, 0.5), way=st.floats(0.05, 1.0), time=st.floats(0.3, 2.0),
       starved=st.booleans())
def test_robot_that_stands_still_again_and_again_is_slow(pause, way, time, starved):
    """As slow as in the recent past, and one pause more; not where the listener is on time."""
    latency, stamp = LatencyMonitor(), NS_PER_SECOND
    for _ in range(50):
        latency.record_ages(NS_PER_SECOND, [], starved)
    while stamp < 15 * NS_PER_SECOND:
        for _ in range(round(way / COMMAND_PERIOD)):
            stamp += seconds(COMMAND_PERIOD)
            latency.record_robot_stamp(stamp)
        stamp += seconds(pause)
        latency.record_robot_stamp(stamp)
    still = latency.expected_standstill(stamp, time)
    if starved:
        lost = pause - COMMAND_PERIOD
        part = lost / (round(way / COMMAND_PERIOD) * COMMAND_PERIOD + pause)
        assert still == pytest.approx(part * time + lost, abs=lost / WINDOW * time + 1e-9)
        assert latency.expected_standstill(stamp + seconds(WINDOW) + 1, time) == 0.0
    else:
        assert still == 0.0


@law(20)
@given(ahead=st.floats(0.0, 1.0), link=st.floats(0.0, 0.2), motion=st.floats(0.0, 0.5))
def test_clocks_that_disagree_make_it_careful(ahead, link, motion):
    """Whatever hides in the ages: as much as they disagree, and as the motion showed, is added."""
    latency = LatencyMonitor()
    latency.record_ages(NS_PER_SECOND, [-ahead, link - ahead])
    latency.record_response_delay(NS_PER_SECOND, motion)
    if ahead > CLOCK_TOLERANCE:
        assert latency.clock_error(NS_PER_SECOND) == ahead
        assert latency.excess(NS_PER_SECOND) >= 2.0 * (link - USUAL_AGE) + ahead + motion - 1e-9
    else:
        assert latency.clock_error(NS_PER_SECOND) == 0.0
        assert latency.excess(NS_PER_SECOND) == pytest.approx(
            max(2.0 * max(link - ahead - USUAL_AGE, -ahead - USUAL_AGE, 0.0), motion))


class FarStage(Stage):
    """A Stage whose catcher, arena and robot are on three hosts."""

    def __init__(self, mean, deviation, loss, seed):
        self.mean, self.deviation, self.loss = mean, deviation, loss
        self.link = Random(seed)
        self.goals = []
        self.mail = []
        self.seen = self.shown = None
        self.newest = {}
        self.ages = []
        super().__init__()

    def send(self, kind, content):
        """Send a message over a link; the kinds that tell a state don't come out of order."""
        if self.link.random() >= self.loss:
            delay = max(self.link.gauss(self.mean, self.deviation), 0.0)
            self.mail.append((self.now + seconds(delay), kind, self.now, content))

    def take(self, now):
        """Return what has arrived, but states that newer ones have overtaken."""
        arrived = sorted(mail for mail in self.mail if mail[0] <= now)
        self.mail = [mail for mail in self.mail if mail[0] > now]
        for arrival, kind, sent, content in arrived:
            if sent >= self.newest.get(kind, 0):
                self.newest[kind] = sent
                yield arrival, kind, sent, content

    def step(self):
        """Take a step of the physics; return whether the catcher sees that a fall has begun."""
        if self.steps % 3 == 0:
            # 83 per second: the pose of a robot, and through which links it goes.
            for kind in ('to the arena', 'to the catcher'):
                self.send(kind, self.platform())
        self.world.platform = self.shown
        self.world.step()
        self.send('brick', self.world.brick)
        fell = False
        for arrival, kind, sent, content in self.take(self.now):
            if kind == 'to the arena':
                self.shown = content
            elif kind == 'goal':
                self.goals.append((self.now + seconds(COMMAND_LATENCY - 0.01), content))
            elif kind == 'tilt':
                self.angle = content
            else:
                self.ages.append((arrival - sent) * 1e-9)
                if kind == 'brick':
                    fell |= self.catcher.observe_brick(sent, content)
                else:
                    self.seen = content
        return fell

    def seen_platform(self):
        """Return what the catcher sees of the platform."""
        return self.seen

    def move(self):
        """Drive for one step towards the goal that has gone through the command path."""
        while self.goals and self.goals[0][0] <= self.now:
            self.goal = self.goals.pop(0)[1]
        super().move()

    def decide(self):
        """Have the catcher decide by what has arrived by now."""
        self.catcher.latency.record_ages(self.now, self.ages)
        self.ages.clear()
        super().decide()

    def obey(self, action):
        """Send the robot what it is told."""
        if isinstance(action, DriveGoal):
            self.send('goal', (action.x, action.y))
        elif isinstance(action, TiltCommand):
            self.send('tilt', action.angle)


def test_orders_that_may_be_lost_are_given_again():
    """Each of both kinds, at every decision, until it must have been obeyed; elsewhere not."""
    for loss, times in ((0.0, 1), (0.05, 5)):
        stage = FarStage(0.01, 0.0, loss, seed=3)
        stage.drop(7.0, 6.0, 9.0)
        stage.reach_state(State.APPROACHING)
        stage.run(0.08)
        for kind, order in ((DriveGoal, DriveGoal(7.0, 6.0)), (TiltCommand, TiltCommand(0.0))):
            told = stage.told(kind)
            assert set(told) == {order}
            assert len(told) == 1 if times == 1 else len(told) >= (
                times if kind is DriveGoal else 3)
        stage.reach_state(State.WAITING)


@pytest.mark.parametrize(('mean', 'deviation', 'loss'), [
    (0.0, 0.0, 0.0), (0.06, 0.015, 0.0), (0.005, 0.002, 0.03), (0.03, 0.005, 0.01)])
def test_promises_hold_over_any_link(mean, deviation, loss):
    """Said reachable is caught, and nothing is refused within what the measured latency allows."""
    stage = FarStage(mean, deviation, loss, seed=1)
    random = Random(2)
    caught = refused = 0
    for number in range(12):
        stage.run(1.0)
        excess = stage.catcher.latency.excess(stage.now)
        height = random.uniform(6.0, 12.0)
        limit = guaranteed_distance(height, PARAMETERS, excess)
        way = random.uniform(0.6, 1.1) * min(limit, 4.5)
        angle = random.uniform(-pi, pi)
        x, y = stage.robot
        stage.drop(x + way * cos(angle), y + way * sin(angle), height)
        released = stage.now
        assert stage.run(3.0, lambda: stage.told(Decision) and stage.world.phase in (
            Phase.RIDING, Phase.GROUNDED))
        decision, = stage.told(Decision)
        assert decision.reachable is (stage.world.phase is Phase.RIDING), (number, decision)
        if decision.reachable:
            caught += 1
            stage.reach_state(State.WAITING)
            assert stage.states == COURSE
        else:
            refused += 1
            decided = next(time for time, action in stage.actions if action is decision)
            late = max((decided - released) * 1e-9 - 0.012, 0.0)
            assert way > guaranteed_distance(
                height, PARAMETERS, decision.latency - COMMAND_LATENCY + late), decision
    assert caught and refused
