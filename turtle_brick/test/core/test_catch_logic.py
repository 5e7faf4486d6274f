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

"""Test the states of the catcher with a robot that responds immediately."""

from collections import deque
from itertools import pairwise
from math import dist, hypot, pi
import re

from defaults import GRAVITY, make_world, NS_PER_SECOND, PARAMETERS, REST_Z, seconds
import pytest
from turtle_brick.core.catch_logic import (Catcher, CENTER, LYING_TIME, Observation,
                                           RAMP_TIME, SETTLING_TIME, State, TILTING_TIMEOUT,
                                           transition)
from turtle_brick.core.geometry import from_pitch, Pose
from turtle_brick.core.robot_tracking import GOAL_TOLERANCE
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick.physics import BrickState, STEP_NS


ROBOT_LOST = {'is_beside_platform': True}
"""Values of Observation fields while the robot is unavailable."""

TABLE = [
    # state, observed values, next state
    (State.WAITING, {}, State.WAITING),
    (State.WAITING, {'is_falling': True}, State.WAITING),
    (State.WAITING, {'is_on_platform': True, 'still_for': 9.0}, State.WAITING),
    (State.WAITING, {'is_robot_idle': True, 'still_for': 9.0}, State.WAITING),
    (State.WAITING, {'is_on_platform': True, 'is_robot_idle': True, 'still_for': 0.9},
     State.WAITING),
    (State.WAITING, {'is_on_platform': True, 'is_robot_idle': True, 'still_for': LYING_TIME},
     State.CARRYING),
    (State.APPROACHING, {'is_falling': True}, State.APPROACHING),
    (State.APPROACHING, {'is_falling': True, **ROBOT_LOST}, State.APPROACHING),
    (State.APPROACHING, {}, State.LEVELING),
    (State.APPROACHING, {'is_on_platform': True, 'is_falling': True}, State.CARRYING),
    (State.APPROACHING, {'is_on_platform': True}, State.CARRYING),
    (State.CARRYING, {'is_on_platform': True}, State.CARRYING),
    (State.CARRYING, {'is_on_platform': True, 'still_for': 9.0}, State.CARRYING),
    (State.CARRYING, {'is_on_platform': True, 'is_at_center': True}, State.TILTING),
    (State.CARRYING, {'is_at_center': True}, State.LEVELING),
    (State.TILTING, {'still_for': 9.0}, State.TILTING),
    (State.TILTING, {'is_beside_platform': True, 'still_for': 0.04}, State.TILTING),
    (State.TILTING, {'is_beside_platform': True, 'still_for': SETTLING_TIME}, State.LEVELING),
    (State.TILTING, {'state_time': TILTING_TIMEOUT}, State.TILTING),
    (State.TILTING, {'state_time': TILTING_TIMEOUT + 0.01}, State.LEVELING),
    (State.LEVELING, {'is_level': False}, State.LEVELING),
    (State.LEVELING, {}, State.WAITING),
    (State.LEVELING, ROBOT_LOST, State.WAITING),
    *((state, {'has_reachable_fall': True, **lost}, State.APPROACHING)
      for state in State for lost in ({}, ROBOT_LOST)),
]


@pytest.mark.parametrize(('state', 'observed', 'expected'), TABLE)
def test_transition_table(state, observed, expected):
    after, reason = transition(state, Observation(**observed))
    assert after is expected
    arrow = f'{state.name:<11} --> {after.name:<11} {reason}\n'
    assert reason in ('', 'a reachable brick falls') or arrow in transition.__doc__
    assert (reason == '') == (after is state and not observed.get('has_reachable_fall'))


def test_transition_table_contains_every_arrow():
    arrows = {f'{state.name} --> {after.name}' for state, observed, after in TABLE
              if state is not after and not observed.get('has_reachable_fall')}
    documented = re.findall(r'(\w+) +--> (\w+) {4}', transition.__doc__)
    assert arrows == {' --> '.join(arrow) for arrow in documented}


class CatchBench:
    """A test bench with a Catcher, a World and a robot that executes commands without delay."""

    def __init__(self, parameters=PARAMETERS):
        self.parameters = parameters
        self.catcher = Catcher(parameters)
        self.world = make_world()
        self.robot = self.goal = CENTER
        self.angle = 0.0
        self.visible = True
        self.attaches_brick = False
        self.now = 100 * NS_PER_SECOND
        self.steps = 0
        self.goals, self.tilts, self.decisions, self.states = [], [], [], []
        self.past_platforms = deque(maxlen=1)
        self.run(0.3)

    @property
    def platform(self):
        hinge = self.parameters.platform_height - self.parameters.platform_thickness
        pose = Pose((*self.robot, hinge), from_pitch(self.angle))
        return Platform(pose) if self.visible else None

    def run(self, time, until=lambda: False):
        """Run the simulation until a condition is true. Return False after `time` seconds."""
        end = self.now + seconds(time)
        while self.now < end:
            self.now += STEP_NS
            self.steps += 1
            self.step()
            if self.catcher.undecided_fall or self.steps % 5 == 0:
                self.update()
            if until():
                return True
        return False

    def step(self):
        dx, dy = self.goal[0] - self.robot[0], self.goal[1] - self.robot[1]
        step = self.parameters.max_velocity * STEP_NS * 1e-9
        fraction = min(step / max(hypot(dx, dy), 1e-9), 1.0)
        self.robot = self.robot[0] + fraction * dx, self.robot[1] + fraction * dy
        self.past_platforms.append(self.platform)
        self.world.platform = self.past_platforms[0]
        self.world.step()
        self.observe_brick()

    def observe_brick(self):
        is_attached = self.attaches_brick and self.world.state is BrickState.RIDING
        self.catcher.brick.observe(self.now, self.world.brick, is_attached)

    def update(self):
        before, decided = self.catcher.state, self.catcher.decision
        self.catcher.robot.observe(self.now, self.platform)
        commands = self.catcher.update(self.now)
        if commands.goal is not None:
            self.goals.append(commands.goal)
            self.goal = commands.goal
        if commands.tilt_angle is not None:
            self.tilts.append((self.now, commands.tilt_angle))
            self.angle = commands.tilt_angle
        if self.catcher.decision not in (None, decided):
            self.decisions.append(self.catcher.decision)
        if self.catcher.state is not before:
            self.states.append(self.catcher.state)

    def clear(self):
        del self.goals[:], self.tilts[:], self.decisions[:], self.states[:]

    def drop(self, x, y, z):
        self.world.brick = (x, y, z)
        self.run(0.06)
        self.world.release()
        self.clear()

    def reach_state(self, state, time=20.0):
        assert self.run(time, lambda: self.states[-1:] == [state]), self.states

    def assert_tipped_off(self):
        self.reach_state(State.WAITING)
        assert self.states in (COURSE, COURSE[1:])
        assert (self.world.state, self.angle) == (BrickState.FLOATING, 0.0)
        assert all(decision.reachable for decision in self.decisions)


def bench_in(state, after=0.1):
    bench = CatchBench()
    bench.drop(7.0, 6.0, 9.0)
    bench.reach_state(state)
    bench.run(after)
    return bench


COURSE = [State.APPROACHING, State.CARRYING, State.TILTING, State.LEVELING, State.WAITING]
any_state = pytest.mark.parametrize('state', COURSE[:4])


def test_bricks_are_caught_carried_to_the_center_and_tipped_off():
    bench = CatchBench()
    bench.run(3.0)
    assert (bench.catcher.state, bench.goals, bench.tilts) == (State.WAITING, [], [])
    for x, y in ((7.0, 7.0), (4.0, 5.5), (5.5, 5.5), (9.0, 2.0)):
        bench.drop(x, y, 16.0)
        bench.reach_state(State.CARRYING)
        assert bench.world.state is BrickState.RIDING
        bench.reach_state(State.TILTING)
        assert dist(bench.robot, CENTER) <= GOAL_TOLERANCE
        assert bench.world.state is BrickState.RIDING
        bench.assert_tipped_off()
        assert bench.goals == [(x, y), CENTER]


def test_platform_is_tilted_and_leveled_smoothly():
    bench = bench_in(State.TILTING, 0.0)
    bench.tilts.clear()
    bench.now += 3_000_000  # The tilt ramp ends between two updates of the catcher.
    bench.reach_state(State.WAITING)
    times, angles = zip(*bench.tilts)
    top = angles.index(PARAMETERS.tilt_angle)
    assert angles[:top + 1] == tuple(sorted(angles[:top + 1]))
    assert angles[top + 1:] == tuple(sorted(angles[top + 1:], reverse=True))
    for begin, end in ((0, top), (top + 1, -1)):
        assert (times[end] - times[begin]) * 1e-9 == pytest.approx(RAMP_TIME, abs=0.05)
    assert angles[-1] == 0.0
    # The cosine ramp starts slowly and is at most pi / 2 times as steep as a linear ramp.
    assert 0.0 < angles[0] < 0.01 * PARAMETERS.tilt_angle
    steepest = 1.001 * PARAMETERS.tilt_angle * pi / 2.0 / RAMP_TIME * 0.02
    assert all(abs(after - before) <= steepest for before, after in pairwise(angles))


@pytest.mark.parametrize('start', [CENTER, (ARENA_SIZE, 5.0)])
def test_brick_beside_the_wall_is_caught(start):
    bench = CatchBench()
    bench.robot = bench.goal = start
    bench.run(0.3)
    bench.drop(ARENA_SIZE + 0.3, 5.0, 25.0)
    bench.assert_tipped_off()
    assert bench.goals[0] == (ARENA_SIZE, 5.0)


def test_unreachable_brick_causes_one_decision_and_no_motion():
    bench = CatchBench()
    bench.drop(10.0, 10.0, 3.0)
    bench.run(3.0)
    assert bench.world.state is BrickState.GROUNDED
    decision, = bench.decisions
    assert not decision.reachable and bench.goals == bench.tilts == []
    assert decision.fall.position == pytest.approx((10.0, 10.0, 3.0), abs=0.01)
    assert bench.states == []


def test_refused_brick_is_carried_if_it_lands_on_the_platform():
    """The catcher refuses the brick because the robot is unavailable during the fall."""
    bench = CatchBench()
    bench.visible = False
    bench.drop(5.5, 5.5, 5.0)
    bench.run(0.76)
    assert not bench.catcher.decision.reachable
    bench.visible = True
    bench.decisions.clear()
    bench.assert_tipped_off()


@pytest.mark.parametrize(('brick', 'time'), [
    ((0.5, 0.5, 6.0), 0.5), ((0.5, 0.5, 6.0), 1.0), ((0.5, 0.5, 6.0), 2.0),
    ((7.0, 6.0, 9.0), 0.5), ((7.0, 6.0, 9.0), 10.0), ((*CENTER, REST_Z), 0.5)],
    ids=('falling', 'below the platform', 'on the ground', 'approached', 'tipped off', 'riding'))
def test_brick_placed_above_an_idle_robot_is_not_carried(brick, time):
    """The robot neither drives nor tilts its platform until the brick is released."""
    bench = CatchBench()
    bench.attaches_brick = True
    bench.drop(*brick)
    bench.run(time)
    if bench.states[1:]:
        assert bench.states == COURSE
    for above in (0.009, 0.0):  # A driving robot stops before the brick is placed again.
        bench.world.brick = (*bench.robot, REST_Z + above)
        bench.run(0.5)
    assert bench.states in ([], [State.APPROACHING, State.LEVELING, State.WAITING], COURSE)
    bench.clear()
    bench.run(3.0)
    assert bench.goals == bench.tilts == bench.decisions == bench.states == []
    bench.world.release()
    bench.assert_tipped_off()


def test_brick_at_rest_on_the_tilted_platform_has_not_left_it_before_the_timeout():
    """No brick transforms arrive after the brick has been at rest for 0.2 s."""
    bench = bench_in(State.TILTING, 0.2)
    stopped = bench.now
    while bench.catcher.state is State.TILTING:
        bench.now += STEP_NS
        if bench.now < stopped + seconds(0.2):
            bench.observe_brick()
        bench.update()
        assert bench.now < stopped + seconds(TILTING_TIMEOUT)
    assert bench.now > stopped + seconds(0.9 * TILTING_TIMEOUT)
    assert bench.states[-1] is State.LEVELING


def test_brick_far_behind_the_robot_is_still_carried():
    """The brick's position is computed from a platform pose that is 0.45 s old."""
    bench = CatchBench()
    bench.drop(8.5, 8.0, 14.0)
    bench.reach_state(State.CARRYING)
    bench.past_platforms = deque(maxlen=round(0.45 / STEP_NS / 1e-9))
    bench.reach_state(State.TILTING)
    assert dist(bench.robot, CENTER) <= GOAL_TOLERANCE
    bench.past_platforms = deque(maxlen=1)
    bench.assert_tipped_off()


@any_state
@pytest.mark.parametrize('place', [(9.0, 9.0, REST_Z), (6.0, 6.0, REST_Z + 0.1), None])
def test_catcher_recovers_after_the_brick_or_the_robot_is_lost(state, place):
    bench = bench_in(state)
    if place:
        bench.world.brick = place
    else:
        bench.visible = False
    # The catcher levels the platform even if no transforms of the robot arrive.
    limit = 0.9 if state is State.LEVELING else 2.5
    assert bench.run(limit, lambda: bench.catcher.state is State.WAITING), bench.states
    assert bench.angle == 0.0
    bench.visible = True
    bench.drop(4.0, 5.0, 9.0)
    bench.assert_tipped_off()


@any_state
def test_clock_set_back_resets_the_catcher(state):
    bench = bench_in(state)
    bench.attaches_brick = True
    bench.now -= seconds(0.02 if state is State.CARRYING else 50.0)
    bench.update()
    assert (bench.catcher.state, bench.catcher.decision) == (State.WAITING, None)
    assert bench.tilts[-1] == (bench.now, 0.0)
    bench.run(5.0)
    assert bench.catcher.state is State.WAITING
    # A sliding brick does not stop, because there is no friction.
    expected = BrickState.RIDING if state is State.TILTING else BrickState.FLOATING
    assert bench.world.state is expected
    assert all(decision.reachable for decision in bench.decisions)
    bench.drop(4.0, 5.0, 9.0)
    bench.assert_tipped_off()


@pytest.mark.parametrize('state', [State.APPROACHING, State.CARRYING])
def test_platform_tilted_by_another_node_is_leveled_during_a_catch(state):
    bench = bench_in(state)
    bench.attaches_brick = True
    bench.tilts.clear()
    bench.angle = 0.4
    assert bench.run(0.03, lambda: bench.angle == 0.0)
    bench.assert_tipped_off()


def test_catcher_does_not_wait_before_the_platform_is_level():
    bench = bench_in(State.LEVELING)
    bench.run(1.0, lambda: setattr(bench, 'angle', 0.4))
    assert bench.catcher.state is State.LEVELING
    bench.assert_tipped_off()


def test_platform_tilted_by_another_node_stays_tilted_until_a_reachable_brick_falls():
    bench = CatchBench()
    bench.angle = 0.4
    bench.run(3.0)
    bench.drop(10.0, 10.0, 3.0)  # unreachable
    bench.run(3.0)
    assert (bench.catcher.state, bench.angle, bench.tilts) == (State.WAITING, 0.4, [])
    bench.drop(7.0, 6.0, 9.0)
    bench.assert_tipped_off()


@pytest.mark.parametrize('state', [State.APPROACHING, State.CARRYING])
def test_goal_is_published_again_as_soon_as_the_robot_drives_elsewhere(state):
    bench = CatchBench()
    bench.drop(9.0, 9.0, 14.0)
    bench.reach_state(state)
    bench.run(0.5)
    bench.goal, goals = (1.0, 9.5), len(bench.goals)
    assert bench.run(0.05, lambda: len(bench.goals) > goals)
    assert bench.goals[-1] == bench.goals[-2] == bench.goal
    bench.assert_tipped_off()


def test_goal_is_published_again_if_it_is_lost_or_overridden():
    bench = CatchBench()
    bench.drop(6.5, 6.0, REST_Z + 0.5 * GRAVITY * 1.3 ** 2)
    for count in (1, 2, 3):
        bench.run(0.5, lambda: len(bench.goals) == count)
        bench.goal = CENTER
    bench.reach_state(State.CARRYING)
    bench.goals.clear()
    bench.goal = (9.0, 9.0)
    bench.assert_tipped_off()
    assert bench.goals == [CENTER]
