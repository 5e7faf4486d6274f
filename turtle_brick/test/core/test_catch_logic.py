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
Catching: the states, and the Catcher with an ideal robot.

The robot here drives and tilts as told without delay; the real one's delays are in
test_simulation.
"""

from collections import deque
from dataclasses import replace
from math import cos, dist, hypot, pi, sin
from random import Random

from hypothesis import given
from hypothesis import strategies as st
from laws import GRAVITY, law, NS_PER_SECOND, PARAMETERS, REST_Z, seconds
import pytest
from turtle_brick.core.catch_logic import (GOAL_TOLERANCE, Catcher, CENTER, DriveGoal, DECISION_DEADLINE,
                                           TILTING_TIMEOUT, CatchStatus, RAMP_TIME, State, TiltCommand)
from turtle_brick.core.geometry import from_pitch, Pose
from turtle_brick.core.reachability import Decision
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.turtlesim_kinematics import within_arena
from turtle_brick.physics import Phase, STEP_NS, World


class Stage:
    """A Catcher, a World, and a robot that does what it is told without delay."""

    def __init__(self, parameters=PARAMETERS, robot=CENTER, every=1):
        self.parameters = parameters
        self.catcher = Catcher(parameters)
        self.world = World.from_parameters(parameters)
        self.world.brick = (5.0, 5.0, 9.0)
        self.robot = self.goal = robot
        self.angle = 0.0
        self.visible = True
        self.every = every
        self.random = Random(1)
        self.now = 100 * NS_PER_SECOND
        self.brick_ahead = self.catcher_ahead = 0
        self.steps = 0
        self.actions = []
        self.states = []
        self.run(0.3)

    def platform(self):
        """Return the platform as it is seen: two transforms of what rests need not be equal."""
        x, y = (value + self.random.uniform(-1e-12, 1e-12) for value in self.robot)
        hinge = self.parameters.platform_height - self.parameters.platform_thickness
        return Platform(Pose((x, y, hinge), from_pitch(self.angle)))

    def run(self, time, until=lambda: False):
        """Let time (s) pass until a condition holds; return whether it came to."""
        end = self.now + seconds(time)
        while self.now < end:
            self.now += STEP_NS
            self.steps += 1
            self.move()
            if self.step() or self.steps % 5 == 0:
                self.decide()
            if until():
                return True
        return False

    def step(self):
        """Take a step of the physics; return whether the catcher sees that a fall has begun."""
        self.world.platform = self.seen_platform()
        self.world.step()
        return self.steps % self.every == 0 and self.see()

    def seen_platform(self):
        """Return what the catcher sees of the platform."""
        return self.platform() if self.visible else None

    def see(self):
        """Have the catcher see the brick; return whether it began to fall."""
        x, y, z = self.world.brick
        return self.catcher.observe_brick(
            self.now + self.brick_ahead, (x, y, z + self.random.uniform(-1e-12, 1e-12)))

    def move(self):
        """Drive towards the goal for one step, at full speed."""
        dx, dy = self.goal[0] - self.robot[0], self.goal[1] - self.robot[1]
        part = min(self.parameters.max_velocity * STEP_NS * 1e-9 / max(hypot(dx, dy), 1e-9), 1.0)
        self.robot = self.robot[0] + part * dx, self.robot[1] + part * dy

    def decide(self):
        """Have the catcher decide, and the robot obey."""
        before = self.catcher.state
        for action in self.catcher.update(self.now + self.catcher_ahead, self.seen_platform()):
            self.actions.append((self.now, action))
            self.obey(action)
        if self.catcher.state is not before:
            self.states.append(self.catcher.state)

    def obey(self, action):
        """Have the robot do what it is told."""
        if isinstance(action, DriveGoal):
            self.goal = (action.x, action.y)
        elif isinstance(action, TiltCommand):
            self.angle = action.angle

    def drop(self, x, y, z):
        """Place the brick, wait a little, and drop it; forget what was before."""
        self.world.brick = (x, y, z)
        self.run(0.06)
        self.world.release()
        self.actions.clear()
        self.states.clear()

    def reach_state(self, state, time=20.0):
        """Go on until the catcher enters a state."""
        assert self.run(time, lambda: self.states[-1:] == [state]), self.states

    def told(self, kind):
        """Return the actions of a kind."""
        return [action for _, action in self.actions if isinstance(action, kind)]

    def assert_tipped_off(self):
        """Go on until the catcher waits, after all its states: the brick floats."""
        self.reach_state(State.WAITING)
        assert self.states in (COURSE, COURSE[1:])
        assert self.world.phase is Phase.FLOATING
        assert self.angle == 0.0
        assert all(decision.reachable for decision in self.told(Decision))

    def assert_next_is_caught(self):
        """Drop another brick: it is caught, carried and tipped off."""
        self.drop(4.0, 5.0, 9.0)
        self.assert_tipped_off()


def stage_in(state, after=0.1):
    """Return a stage that has been in a state for a time (s)."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(state)
    stage.run(after)
    return stage


COURSE = [State.APPROACHING, State.CARRYING, State.TILTING, State.LEVELING, State.WAITING]
any_stage = pytest.mark.parametrize('state', COURSE[:4])


@pytest.mark.parametrize('every', (1, 5))
def test_catches_carries_and_tips_off_any_number_of_bricks(every):
    """Also where the brick is seen no more than 50 times per second."""
    stage = Stage(every=every)
    for x, y in ((7.0, 7.0), (4.0, 5.5), (5.5, 5.5), (9.0, 2.0)):
        stage.drop(x, y, 16.0)
        stage.reach_state(State.CARRYING)
        assert stage.world.phase is Phase.RIDING
        stage.reach_state(State.TILTING)
        assert dist(stage.robot, CENTER) <= GOAL_TOLERANCE
        assert stage.world.phase is Phase.RIDING
        stage.assert_tipped_off()
        assert stage.told(DriveGoal) == [DriveGoal(x, y), DriveGoal(*CENTER)]


def test_platform_is_tilted_and_leveled_smoothly():
    stage = stage_in(State.TILTING, 0.0)
    stage.actions.clear()
    stage.catcher_ahead = 3_000_000  # no instant is just RAMP_TIME after the beginning
    stage.reach_state(State.WAITING)
    wanted = PARAMETERS.tilt_angle
    angles = [(time, action.angle) for time, action in stage.actions]
    top = next(index for index, (_, angle) in enumerate(angles) if angle == wanted)
    for part, turned in ((angles[:top + 1], 1.0), (angles[top + 1:], -1.0)):
        assert part == sorted(part, key=lambda entry: turned * entry[1])
        assert (part[-1][0] - part[0][0]) * 1e-9 == pytest.approx(RAMP_TIME, abs=0.05)
    assert angles[-1][1] == 0.0
    # A half wave is at most pi / 2 times as steep as a straight line.
    for (begin, before), (end, after) in zip(angles, angles[1:]):
        if end - begin <= 20_000_000:
            assert abs(after - before) <= 1.001 * wanted * pi / 2.0 / RAMP_TIME * 0.02


@pytest.mark.parametrize('brick', [(10.0, 10.0, 3.0), (*CENTER, REST_Z - 0.1), (11.2, 5.0, 9.0)])
def test_says_unreachable_once_where_the_brick_is(brick):
    stage = Stage()
    for _ in range(2):
        stage.drop(*brick)
        stage.run(3.0)
        assert stage.world.phase is Phase.GROUNDED
        (_, decision), = stage.actions
        assert not decision.reachable
        assert decision.fall.position[:2] == brick[:2]
        assert 0.0 <= brick[2] - decision.fall.position[2] < 0.01
        assert stage.states == []


def test_brick_that_hovers_at_the_platform_is_tried_once():
    """It does not come along: the robot returns under it and waits until it moves."""
    stage = Stage(robot=(3.0, 4.0))
    stage.world.brick = (3.1, 4.0, REST_Z)
    stage.run(10.0)
    assert stage.states == [State.CARRYING, State.LEVELING, State.WAITING]
    assert stage.world.phase is Phase.HOVERING
    assert dist(stage.robot, (3.1, 4.0)) < 1e-6
    stage.states.clear()
    # Dropped, it does not move either; but if its frame becomes the platform's, that is news.
    stage.world.release()
    stage.run(0.1)
    stage.catcher.observe_brick(stage.now, stage.world.brick, 'platform')
    stage.assert_tipped_off()


def test_brick_that_stalls_on_the_tilted_platform_has_not_left_it():
    """At one place for 0.2 s, as after a stall of the arena, then not broadcast any more."""
    stage = stage_in(State.TILTING, 0.2)
    for step in range(round(0.9 * TILTING_TIMEOUT / STEP_NS / 1e-9)):
        stage.now += STEP_NS
        if step < 50:
            stage.see()
        stage.decide()
    assert stage.catcher.state is State.TILTING
    stage.assert_tipped_off()


def test_gives_up_a_brick_that_keeps_moving_on_the_platform():
    """As one would that somebody else holds there."""
    stage = stage_in(State.TILTING, 0.0)
    tilted, random = stage.now, Random(1)
    while stage.catcher.state is State.TILTING and stage.now - tilted < seconds(2.0 * TILTING_TIMEOUT):
        stage.now += STEP_NS
        stage.catcher.observe_brick(stage.now, (*stage.robot, REST_Z + random.uniform(-1e-3, 1e-3)))
        stage.decide()
    assert (stage.now - tilted) * 1e-9 == pytest.approx(TILTING_TIMEOUT, abs=0.05)
    assert stage.catcher.state is State.LEVELING


def test_brick_that_comes_far_behind_is_still_carried():
    """On a busy machine the arena moves it with where the platform was some time ago."""
    stage = Stage()
    stage.drop(8.5, 8.0, 14.0)
    stage.reach_state(State.CARRYING)
    past = deque(maxlen=round(0.45 / STEP_NS / 1e-9))
    while stage.catcher.state is State.CARRYING:
        stage.now += STEP_NS
        stage.move()
        past.append(stage.platform())
        stage.world.platform = past[0]
        stage.world.step()
        stage.see()
        stage.decide()
    assert stage.states[-1] is State.TILTING
    assert dist(stage.robot, CENTER) <= GOAL_TOLERANCE
    stage.assert_tipped_off()


# ---------------------------------------------------------------------------------- at any stage

@any_stage
@pytest.mark.parametrize('place', [(9.0, 9.0, REST_Z), (6.0, 6.0, REST_Z + 0.1), None])
def test_brick_that_is_taken_away_or_robot_that_is_lost_at_any_stage(state, place):
    """Wherever the brick is put, the robot levels and waits, and catches the next."""
    stage = stage_in(state)
    if place:
        stage.world.brick = place
    else:
        stage.visible = False
    # What is leveling already goes on, also blind.
    limit = 0.9 if state is State.LEVELING else 2.5
    assert stage.run(limit, lambda: stage.catcher.state is State.WAITING), stage.states
    assert stage.angle == 0.0
    stage.visible = True
    stage.assert_next_is_caught()


@any_stage
def test_clock_that_is_set_back_at_any_stage(state):
    """The catcher starts afresh, waiting and level, and catches the next as ever."""
    stage = stage_in(state)
    stage.now -= seconds(0.02 if state is State.CARRYING else 50.0)
    stage.decide()
    assert (stage.catcher.status, stage.catcher.decision) == (CatchStatus(), None)
    assert stage.actions[-1] == (stage.now, TiltCommand(0.0))
    stage.run(5.0)
    assert stage.catcher.state is State.WAITING
    # Without friction, what has begun to slide goes on, however slowly.
    assert stage.world.phase is (Phase.RIDING if state is State.TILTING else Phase.FLOATING)
    assert all(decision.reachable for decision in stage.told(Decision))
    stage.assert_next_is_caught()


@pytest.mark.parametrize('late', ('brick_ahead', 'catcher_ahead'))
def test_verdict_waits_until_both_nodes_know_that_the_clock_was_set_back(late):
    """Arena and catcher learn of it one after the other: the difference tells nothing."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.now -= 5 * NS_PER_SECOND
    setattr(stage, late, 5 * NS_PER_SECOND)
    stage.run(0.02)
    assert stage.catcher.decision is None
    setattr(stage, late, 0)
    behind = stage.now
    stage.assert_tipped_off()
    assert stage.catcher.decision.fall.stamp > behind


@pytest.mark.parametrize('state, time', [
    (State.APPROACHING, 0.3), (State.CARRYING, 0.8), (State.TILTING, 0.8)])
def test_robot_that_is_lost_for_a_moment(state, time):
    """As on a machine that stands still: it goes on where it was."""
    stage = stage_in(state)
    stage.visible = False
    stage.run(time)
    assert stage.catcher.state is state
    stage.visible = True
    stage.assert_tipped_off()


# ------------------------------------------------------------------------- a robot of its own will

def test_robot_that_comes_in_sight_is_not_taken_to_be_at_rest():
    """Until it has been seen for a while it may be going anywhere."""
    decisions = []
    for visible in (False, True):
        stage = Stage(robot=(5.0, 5.0))
        stage.visible = visible
        stage.drop(7.5, 5.0, REST_Z + 0.5 * GRAVITY * 0.9 ** 2)
        stage.visible = True
        stage.run(0.05)
        decisions.append(stage.catcher.decision)
    assert decisions[0].needed > decisions[1].needed + 0.1


def test_waits_for_a_robot_that_is_out_of_sight_as_long_as_there_is_time():
    """As a catcher that was asleep does: it may see the brick before the robot."""
    stage = Stage()
    stage.visible = False
    stage.drop(6.5, 6.0, REST_Z + 0.5 * GRAVITY * 1.3 ** 2)
    stage.run(0.9)
    assert stage.actions == []
    stage.visible = True
    stage.assert_tipped_off()


@pytest.mark.parametrize(('brick', 'hoped_for'), [
    ((5.0, 5.0, REST_Z + 0.2), True), ((5.0, 5.0, 9.0), True),
    ((-0.1, 5.0, 9.0), False), ((*CENTER, REST_Z - 0.1), False)])
def test_says_unreachable_while_the_robot_is_out_of_sight(brick, hoped_for):
    """Once: at once if no robot could help, else when it has the last word."""
    stage = Stage()
    stage.visible = False
    stage.drop(*brick)
    stage.run(2.0 if hoped_for else 0.1)
    (told, decision), = stage.actions
    assert not decision.reachable
    assert 'no robot' in decision.reason
    if hoped_for:
        assert 0.8 * DECISION_DEADLINE - 1e-6 <= (decision.contact - told) * 1e-9 <= DECISION_DEADLINE


def test_says_unreachable_of_a_fall_that_was_over_before_it_was_known():
    """Once, as where messages take a second; not where the brick came down on the platform."""
    stage = Stage()
    stage.brick_ahead = -NS_PER_SECOND
    stage.drop(8.0, 8.0, 5.0)
    stage.run(3.0)
    (_, decision), = stage.actions
    assert not decision.reachable and '1.19' in decision.reason
    stage.drop(*CENTER, 5.0)
    stage.run(1.5)
    assert stage.actions == [] and stage.world.phase is Phase.RIDING


def test_says_unreachable_once_though_the_clock_goes_ahead_within_the_fall():
    stage = Stage()
    stage.drop(0.5, 0.5, 5.0)
    stage.run(0.3)
    stage.brick_ahead = stage.catcher_ahead = NS_PER_SECOND
    stage.run(2.0)
    (_, decision), = stage.actions
    assert not decision.reachable


def test_order_that_is_lost_or_that_somebody_overrules_is_given_again():
    """Until the robot is seen to obey; where it was sent elsewhere, once it has arrived there."""
    stage = Stage()
    stage.drop(6.5, 6.0, REST_Z + 0.5 * GRAVITY * 1.3 ** 2)
    for orders in (1, 2, 3):
        stage.run(0.5, lambda: len(stage.told(DriveGoal)) == orders)
        stage.goal = CENTER
    stage.reach_state(State.CARRYING)
    stage.actions.clear()
    stage.goal = (9.0, 9.0)
    stage.assert_tipped_off()
    assert stage.told(DriveGoal) == [DriveGoal(*CENTER)]


@law(8)
@given(angle=st.floats(-pi, pi), time=st.floats(0.0, 1.2), speed=st.floats(1.0, 10.0))
def test_never_orders_the_robot_out_of_the_arena(angle, time, speed):
    """Nor, when the brick is taken away while it drives, far from where it is."""
    stage = Stage(replace(PARAMETERS, max_velocity=speed))
    stage.drop(*within_arena(CENTER[0] + 8.0 * cos(angle), CENTER[1] + 8.0 * sin(angle)), 2000.0)
    stage.run(0.1 + time)
    assert stage.catcher.state is State.APPROACHING
    stage.world.brick = (5.0, 5.0, 1.0)
    stage.reach_state(State.WAITING, 3.0)
    _, stop = stage.told(DriveGoal)
    assert stop == within_arena(*stop)
    assert dist(stop, stage.robot) <= 0.15 * speed
