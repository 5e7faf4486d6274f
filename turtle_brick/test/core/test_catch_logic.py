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
Catching: the states, and the Catcher.

The Catcher here has an ideal robot, which drives and tilts as told without delay; the real one's
delays are in test_closed_loop.
"""

from collections import deque
from dataclasses import replace
from itertools import product
from math import cos, dist, hypot, pi, sin, sqrt
from random import Random

from hypothesis import given
from hypothesis import strategies as st
from laws import law, seconds
import pytest
from turtle_brick.core.catch_logic import (AT_GOAL, Catcher, CENTER, DriveOrder, LAST_WORD,
                                           Observation, PATIENCE, RAMP, State, TiltOrder,
                                           transition)
from turtle_brick.core.geometry import from_pitch, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.platform import Platform
from turtle_brick.core.reachability import Decision, resting_height
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase, STEP, World

PARAMETERS = load()
GRAVITY = PARAMETERS.gravity_accel
REST = resting_height(PARAMETERS)
SECOND = 1_000_000_000


# Each state's ways out, in the order of their priority; none taken: the state stays.
WAYS_OUT = {
    State.WAITING: [
        (State.CARRYING, lambda seen: seen.lying)],
    State.APPROACHING: [
        (State.CARRYING, lambda seen: seen.on_platform),
        (State.LEVELING, lambda seen: not seen.falling)],
    State.CARRYING: [
        (State.LEVELING, lambda seen: not seen.on_platform),
        (State.TILTING, lambda seen: seen.at_center)],
    State.TILTING: [
        (State.LEVELING, lambda seen: seen.off_platform or seen.out_of_patience)],
    State.LEVELING: [
        (State.WAITING, lambda seen: seen.level)],
}

OBSERVATIONS = [Observation(*values) for values in product(
    (None, False, True), *[(False, True)] * 7)]


@pytest.mark.parametrize('state', State)
def test_every_state_under_every_observation(state):
    assert len(OBSERVATIONS) == 384
    for seen in OBSERVATIONS:
        following = next((other for other, leads in WAYS_OUT[state] if leads(seen)), state)
        if seen.decision:
            following = State.APPROACHING
        assert transition(state, seen) is following


@pytest.mark.parametrize('state', State)
def test_every_state_leads_back_to_waiting(state):
    gone = Observation(off_platform=True)
    for _ in range(3):
        state = transition(state, gone)
    assert state is State.WAITING


class Stage:
    """A Catcher, a World, and a robot that does what it is told without delay."""

    def __init__(self, parameters=PARAMETERS, robot=CENTER, every=1, noise=0.0):
        self.parameters = parameters
        self.catcher = Catcher(parameters)
        self.world = World.from_parameters(parameters)
        self.world.brick = (5.0, 5.0, 9.0)
        self.robot = robot
        self.goal = robot
        self.angle = 0.0
        self.visible = True
        self.every = every
        self.noise = noise
        self.random = Random(1)
        self.now = 100 * SECOND
        self.steps = 0
        self.actions = []
        self.states = []
        self.run(0.3)

    def platform(self):
        """Return the platform as it is seen."""
        x, y = (value + self.random.uniform(-self.noise, self.noise) for value in self.robot)
        hinge = self.parameters.platform_height - self.parameters.platform_thickness
        return Platform(Pose((x, y, hinge), from_pitch(self.angle)))

    def run(self, time, until=lambda: False):
        """Let time (s) pass until a condition holds; return whether it came to."""
        end = self.now + seconds(time)
        while self.now < end:
            self.now += STEP
            self.steps += 1
            self.move()
            self.world.platform = self.platform() if self.visible else None
            self.world.step()
            seen = self.steps % self.every == 0 and self.see()
            if seen or self.steps % 5 == 0:
                self.decide()
            if until():
                return True
        return False

    def see(self):
        """Have the catcher see the brick; return whether it began to fall."""
        position = tuple(value + self.random.uniform(-self.noise, self.noise)
                         for value in self.world.brick)
        return self.catcher.see_brick(self.now, position)

    def move(self):
        """Drive towards the goal for one step, at full speed."""
        dx, dy = self.goal[0] - self.robot[0], self.goal[1] - self.robot[1]
        part = min(self.parameters.max_velocity * STEP * 1e-9 / max(hypot(dx, dy), 1e-9), 1.0)
        self.robot = self.robot[0] + part * dx, self.robot[1] + part * dy

    def decide(self):
        """Have the catcher decide, and the robot obey."""
        before = self.catcher.state
        actions = self.catcher.update(self.now, self.platform() if self.visible else None)
        for action in actions:
            self.actions.append((self.now, action))
            if isinstance(action, DriveOrder):
                self.goal = (action.x, action.y)
            elif isinstance(action, TiltOrder):
                self.angle = action.angle
        if self.catcher.state is not before:
            self.states.append(self.catcher.state)

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

    def refusals(self):
        """Return the decisions that a brick is unreachable."""
        return [decision for decision in self.told(Decision) if not decision.reachable]

    def told(self, kind):
        """Return the actions of a kind."""
        return [action for _, action in self.actions if isinstance(action, kind)]


COURSE = [State.APPROACHING, State.CARRYING, State.TILTING, State.LEVELING, State.WAITING]


@pytest.mark.parametrize('every', (1, 2, 3, 4, 5))
def test_catches_carries_and_tips_off_any_number_of_bricks(every):
    """Also where the brick is seen no more than 50 times per second."""
    stage = Stage(every=every)
    for x, y in ((7.0, 7.0), (4.0, 5.5), (5.5, 5.5), (9.0, 2.0)):
        stage.drop(x, y, 16.0)
        stage.reach_state(State.CARRYING)
        assert stage.world.phase is Phase.RIDING
        stage.reach_state(State.TILTING)
        assert hypot(stage.robot[0] - CENTER[0], stage.robot[1] - CENTER[1]) <= AT_GOAL
        assert stage.world.phase is Phase.RIDING
        stage.reach_state(State.WAITING)
        assert stage.world.phase is Phase.FLOATING
        assert stage.angle == 0.0
        assert stage.states == COURSE
        assert stage.told(DriveOrder) == [DriveOrder(x, y), DriveOrder(*CENTER)]
        assert stage.refusals() == []


def test_rounding_is_no_motion():
    """Two transforms of what stands still need not be equal to the last bit."""
    stage = Stage(noise=1e-12)
    # A robot at rest, with so little to spare that a moving one would be refused.
    stage.drop(7.0, 5.5, REST + 0.5 * GRAVITY * 0.5 ** 2)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING
    assert stage.catcher.decision.margin < 0.1


def test_platform_is_tilted_and_leveled_smoothly():
    stage = Stage()
    stage.drop(6.0, 6.0, 9.0)
    stage.reach_state(State.TILTING)
    stage.actions.clear()
    stage.reach_state(State.WAITING)
    wanted = PARAMETERS.tilt_angle
    angles = [(time, action.angle) for time, action in stage.actions]
    top = next(index for index, (_, angle) in enumerate(angles) if angle == wanted)
    up, down = angles[:top + 1], angles[top:]
    assert down[-1][1] == 0.0
    assert [angle for _, angle in up] == sorted(angle for _, angle in up)
    assert [angle for _, angle in down] == sorted((angle for _, angle in down), reverse=True)
    for part in (up, down[1:]):
        assert (part[-1][0] - part[0][0]) * 1e-9 == pytest.approx(RAMP, abs=0.05)
    # A half wave is at most pi / 2 times as steep as a straight line.
    for (begin, before), (end, after) in zip(angles, angles[1:]):
        if end - begin <= 20_000_000:
            assert abs(after - before) <= 1.001 * wanted * pi / 2.0 / RAMP * 0.02


def test_decides_once_per_fall():
    stage = Stage()
    stage.drop(6.0, 6.0, 12.0)
    decision = None
    decisions = 0
    while stage.world.phase is Phase.FALLING:
        stage.run(STEP * 1e-9)
        if stage.catcher.decision is not decision:
            decision = stage.catcher.decision
            decisions += 1
    assert decisions == 1
    assert decision.reachable
    assert stage.told(DriveOrder)[0] == DriveOrder(6.0, 6.0)
    # It is known 8 ms after the release, and when it will be down.
    assert (stage.now - decision.contact) * 1e-9 == pytest.approx(0.0, abs=0.005)
    assert decision.available == pytest.approx(sqrt(2.0 * (12.0 - REST) / GRAVITY) - 0.012,
                                               abs=0.005)


@pytest.mark.parametrize(('brick', 'robot', 'reason'), [
    ((10.0, 10.0, 3.0), (1.0, 1.0), 'too early'),
    ((5.0, 5.0, REST - 0.1), (5.0, 5.0), 'below'),
    ((11.2, 5.0, 9.0), (10.5, 5.0), 'outside')])
def test_says_unreachable_once_where_the_brick_is(brick, robot, reason):
    stage = Stage(robot=robot)
    for _ in range(2):
        stage.drop(*brick)
        stage.run(3.0)
        assert stage.world.phase is Phase.GROUNDED
        (_, decision), = stage.actions
        assert stage.refusals() == [decision]
        assert decision.fall.position[:2] == brick[:2]
        assert 0.0 <= brick[2] - decision.fall.position[2] < 0.01
        assert reason in stage.catcher.decision.reason
        assert stage.states == []


def test_brick_that_is_caught_by_luck_is_tipped_off():
    """It was called unreachable, but there it lies: it is carried like any other."""
    stage = Stage(robot=(11.0, 5.0))
    stage.drop(11.2, 5.0, 9.0)
    stage.reach_state(State.WAITING)
    assert len(stage.refusals()) == 1
    assert stage.states == COURSE[1:]
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('start', (CENTER, (3.0, 8.0)))
@pytest.mark.parametrize('above', (0.0, 1e-9, 1e-4, 3e-4, 4e-4, 0.001, 0.01, 0.1))
def test_brick_that_is_dropped_onto_the_robot_from_just_above_is_carried_off(above, start):
    """It is never called unreachable, however late its fall is seen, if it is seen at all."""
    stage = Stage(robot=start)
    stage.drop(start[0] + 0.1, start[1], REST + above)
    stage.reach_state(State.CARRYING, 1.2)
    stage.reach_state(State.WAITING)
    assert stage.refusals() == []
    assert stage.world.phase is Phase.FLOATING
    assert stage.told(DriveOrder)[-1] == DriveOrder(*CENTER)


@pytest.mark.parametrize('stage_of_death', COURSE[:3])
def test_catcher_that_comes_back_carries_the_brick_off(stage_of_death):
    """A new one knows nothing, but sees a brick at rest on the level platform."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(stage_of_death)
    stage.run(0.1)
    stage.catcher = Catcher(PARAMETERS)
    stage.states.clear()
    stage.run(8.0)
    assert stage.world.phase in (Phase.FLOATING, Phase.GROUNDED)
    if stage_of_death is State.CARRYING:
        assert stage.states[-4:] == COURSE[1:]
    # Whatever the angle it was left with: the next one is caught.
    stage.drop(4.0, 5.0, 9.0)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE


def test_brick_that_hovers_at_the_platform_is_tried_once():
    """It does not come along: the robot returns under it and waits until it moves."""
    stage = Stage(robot=(3.0, 4.0))
    stage.world.brick = (3.1, 4.0, REST)
    stage.run(10.0)
    assert stage.states == [State.CARRYING, State.LEVELING, State.WAITING]
    assert stage.world.phase is Phase.HOVERING
    assert dist(stage.robot, (3.1, 4.0)) < 1e-6
    stage.states.clear()
    # Dropped, it does not move either; but if its frame becomes the platform's, that is news.
    stage.world.release()
    stage.run(0.1)
    stage.catcher.see_brick(stage.now, stage.world.brick, 'platform')
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE[1:]
    assert stage.world.phase is Phase.FLOATING


def test_brick_that_stalls_on_the_tilted_platform_has_not_left_it():
    """Seen at one place for 0.2 s, as after a stall of the arena, it is not given up."""
    stage = Stage()
    stage.drop(5.6, 5.5, 9.0)
    stage.reach_state(State.TILTING)
    stage.run(0.2)
    for _ in range(50):
        stage.now += STEP
        stage.see()
        stage.decide()
    assert stage.catcher.state is State.TILTING
    stage.reach_state(State.WAITING)
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('back', (0.01, 0.5, 5.0, 99.0))
@pytest.mark.parametrize('state', COURSE[:4])
def test_clock_that_is_set_back_at_any_stage(state, back):
    """What was begun is brought to its end, and the next brick is caught as ever."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(state)
    stage.run(0.1)
    stage.now -= seconds(back)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING
    stage.drop(4.0, 5.0, 9.0)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE


def test_verdict_waits_until_the_clocks_agree():
    """The brick's stamps are set back first: no verdict is given on the difference."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.now -= 5 * SECOND
    behind = stage.now
    # The catcher's own clock is still ahead for three looks at the brick.
    decide, stage.decide = stage.decide, lambda: stage.catcher.update(
        stage.now + 5 * SECOND, stage.platform())
    stage.run(0.02)
    assert stage.catcher.decision is None
    stage.decide = decide
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.refusals() == []
    assert stage.catcher.decision.fall.stamp > behind


def test_robot_that_comes_in_sight_is_not_taken_to_be_at_rest():
    """Until it has been seen for a while it may be going anywhere."""
    brick, distance = REST + 0.5 * GRAVITY * 0.9 ** 2, 2.5
    decisions = []
    for visible in (False, True):
        stage = Stage(robot=(5.0, 5.0))
        stage.visible = visible
        stage.drop(5.0 + distance, 5.0, brick)
        stage.visible = True
        stage.run(0.05)
        decisions.append(stage.catcher.decision)
    assert decisions[0].distance == decisions[1].distance
    assert decisions[0].needed > decisions[1].needed


@pytest.mark.parametrize('unseen', (0.0, 0.3, 0.6, 0.9))
def test_waits_for_a_robot_that_is_out_of_sight_as_long_as_there_is_time(unseen):
    """As a catcher that was asleep does: it may see the brick before the robot."""
    stage = Stage()
    stage.visible = False
    stage.drop(6.5, 6.0, REST + 0.5 * GRAVITY * 1.3 ** 2)
    stage.run(unseen)
    assert stage.actions == []
    stage.visible = True
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.refusals() == []
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('height, place', ((9.0, (-0.1, 5.0)), (REST - 0.1, CENTER)))
def test_does_not_wait_for_a_robot_that_could_not_help(height, place):
    stage = Stage()
    stage.visible = False
    stage.drop(*place, height)
    stage.run(0.1)
    (_, action), = stage.actions
    assert stage.refusals() == [action]


@pytest.mark.parametrize('lost', (1, 2, 3))
def test_order_that_is_lost_is_given_again(lost):
    """Until the robot is seen to obey."""
    stage = Stage()
    decide = stage.decide

    def decide_deaf():
        nonlocal lost
        drives, goal = len(stage.told(DriveOrder)), stage.goal
        decide()
        if len(stage.told(DriveOrder)) > drives and lost:
            lost, stage.goal = lost - 1, goal

    stage.decide = decide_deaf
    stage.drop(6.5, 6.0, REST + 0.5 * GRAVITY * 1.3 ** 2)
    stage.reach_state(State.WAITING)
    assert lost == 0
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('height', (REST + 0.2, 5.0, 9.0))
def test_says_unreachable_while_the_robot_is_out_of_sight(height):
    """Once, when it has the last word, and before the brick is down."""
    stage = Stage()
    stage.visible = False
    stage.drop(5.0, 5.0, height)
    stage.run(2.0)
    (told, action), = stage.actions
    assert stage.refusals() == [action]
    time = (stage.catcher.decision.contact - told) * 1e-9
    assert 0.8 * LAST_WORD - 1e-6 <= time <= LAST_WORD
    assert 'no robot' in stage.catcher.decision.reason


@pytest.mark.parametrize('state', COURSE[:4])
@pytest.mark.parametrize('place', (
    (2.0, 3.0, 7.0), (9.0, 9.0, REST), (6.0, 6.0, REST + 0.1), (5.0, 5.0, 0.06)))
def test_brick_that_is_taken_away_at_any_stage(state, place):
    """Wherever it is put, the robot levels and waits, and catches the next."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(state)
    stage.run(0.21)
    stage.world.brick = place
    assert stage.run(2.5, lambda: stage.catcher.state is State.WAITING), stage.states
    assert stage.angle == 0.0
    stage.run(1.0)
    assert stage.catcher.state is State.WAITING
    stage.drop(4.0, 5.0, 9.0)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('state', COURSE[:4])
def test_brick_that_is_dropped_anew_at_any_stage(state):
    """The platform is leveled at once, and the robot is under the new place."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(state)
    stage.run(0.21)
    stage.states.clear()
    stage.actions.clear()
    stage.world.brick = (4.0, 4.0, 14.0)
    stage.world.release()
    stage.reach_state(State.CARRYING)
    assert stage.world.phase is Phase.RIDING
    assert stage.told(DriveOrder)[-2:] == [DriveOrder(4.0, 4.0), DriveOrder(*CENTER)]
    stage.reach_state(State.WAITING)
    assert stage.states[-4:] == COURSE[1:]
    assert stage.refusals() == []


@pytest.mark.parametrize('state', COURSE[:4])
def test_robot_that_is_lost_at_any_stage(state):
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(state)
    stage.run(0.1)
    stage.visible = False
    stage.run(3.0)
    assert stage.catcher.state is State.WAITING
    assert stage.angle == 0.0
    stage.visible = True
    stage.drop(6.0, 5.0, 9.0)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE


@pytest.mark.parametrize('state, seconds', [
    (State.APPROACHING, 0.3), (State.CARRYING, 0.8), (State.TILTING, 0.8)])
def test_robot_that_is_lost_for_a_moment(state, seconds):
    """As on a machine that stands still: it goes on where it was."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(state)
    stage.run(0.1)
    stage.visible = False
    stage.run(seconds)
    assert stage.catcher.state is state
    stage.visible = True
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING


def test_robot_that_somebody_else_sends_away_while_it_carries():
    """It arrives there, and is sent to the center again."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(State.CARRYING)
    stage.run(0.1)
    stage.goal = (9.0, 9.0)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.told(DriveOrder) == [DriveOrder(7.0, 6.0), DriveOrder(*CENTER), DriveOrder(*CENTER)]
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('delay', (0.1, 0.3, 0.45))
def test_brick_that_comes_far_behind_is_still_carried(delay):
    """On a busy machine the arena moves it with where the platform was some time ago."""
    stage = Stage()
    stage.drop(8.5, 8.0, 14.0)
    stage.reach_state(State.CARRYING)
    past = deque(maxlen=round(delay / (STEP * 1e-9)))
    while stage.catcher.state is State.CARRYING:
        stage.now += STEP
        stage.move()
        past.append(stage.platform())
        stage.world.platform = past[0]
        stage.world.step()
        stage.see()
        stage.decide()
    assert stage.states[-1] is State.TILTING
    assert dist(stage.robot, CENTER) <= 0.02
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING


def test_platform_that_somebody_tilted_is_leveled_for_the_catch():
    stage = Stage()
    stage.angle = 0.4
    stage.run(0.1)
    stage.drop(6.0, 6.0, 9.0)
    stage.reach_state(State.CARRYING)
    assert stage.told(TiltOrder)[0] == TiltOrder(0.0)
    assert stage.world.phase is Phase.RIDING


@law(30)
@given(angle=st.floats(-pi, pi), time=st.floats(0.0, 1.2), speed=st.floats(1.0, 10.0))
def test_never_orders_the_robot_out_of_the_arena(angle, time, speed):
    """Nor, when the brick is taken away while it drives, far from where it is."""
    stage = Stage(replace(PARAMETERS, max_velocity=speed))
    stage.drop(min(max(CENTER[0] + 8.0 * cos(angle), 0.0), ARENA_SIZE),
               min(max(CENTER[1] + 8.0 * sin(angle), 0.0), ARENA_SIZE), 2000.0)
    stage.run(0.1 + time)
    assert stage.catcher.state is State.APPROACHING
    stage.world.brick = (5.0, 5.0, 1.0)
    stage.reach_state(State.WAITING, 3.0)
    stop = stage.told(DriveOrder)[-1]
    assert len(stage.told(DriveOrder)) == 2
    for drive in stage.told(DriveOrder):
        assert 0.0 <= drive.x <= ARENA_SIZE
        assert 0.0 <= drive.y <= ARENA_SIZE
    assert hypot(stop.x - stage.robot[0], stop.y - stage.robot[1]) <= 0.15 * speed


def test_gives_up_a_brick_that_keeps_moving_on_the_platform():
    """As one would that somebody else holds there."""
    stage = Stage()
    stage.drop(6.0, 6.0, 9.0)
    stage.reach_state(State.TILTING)
    tilted = stage.now
    catcher, random = stage.catcher, Random(1)
    while catcher.state is State.TILTING and stage.now - tilted < seconds(2.0 * PATIENCE):
        stage.now += STEP
        catcher.see_brick(stage.now, (*stage.robot, REST + random.uniform(-1e-3, 1e-3)))
        stage.decide()
    assert (stage.now - tilted) * 1e-9 == pytest.approx(PATIENCE, abs=0.05)
    assert catcher.state is State.LEVELING


def test_brick_that_arena_stops_broadcasting_is_not_taken_for_gone():
    """While the platform is tilted nothing is known of it: the robot waits."""
    stage = Stage()
    stage.drop(6.0, 6.0, 9.0)
    stage.reach_state(State.TILTING)
    for _ in range(round(0.9 * PATIENCE / 0.02)):
        stage.now += 5 * STEP
        stage.decide()
    assert stage.catcher.state is State.TILTING
    stage.reach_state(State.WAITING)
    assert stage.world.phase is Phase.FLOATING
