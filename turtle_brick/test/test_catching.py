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
Catching, piece by piece: telling falls, computing reach, the states, and the Catcher.

The Catcher here has an ideal robot, which drives and tilts as told without delay; the real one's
delays are in test_closed_loop.
"""

from collections import deque
from dataclasses import replace
from itertools import product
from math import cos
from math import dist
from math import hypot
from math import inf
from math import isfinite
from math import isnan
from math import pi
from math import sin
from math import sqrt
from random import Random

from hypothesis import assume
from hypothesis import given
from hypothesis import settings
from hypothesis import strategies as st
import pytest
from turtle_brick.catching import ARRIVED
from turtle_brick.catching import Catcher
from turtle_brick.catching import CENTRE
from turtle_brick.catching import COMMAND_LATENCY
from turtle_brick.catching import Drive
from turtle_brick.catching import Fall
from turtle_brick.catching import FallDetector
from turtle_brick.catching import LAST_WORD
from turtle_brick.catching import LEVEL_LATENCY
from turtle_brick.catching import Observation
from turtle_brick.catching import PATIENCE
from turtle_brick.catching import QUEUE_LATENCY
from turtle_brick.catching import RAMP
from turtle_brick.catching import reach
from turtle_brick.catching import resting_height
from turtle_brick.catching import Robot
from turtle_brick.catching import State
from turtle_brick.catching import Tilt
from turtle_brick.catching import transition
from turtle_brick.catching import Unreachable
from turtle_brick.driving import travel_time
from turtle_brick.geometry import from_pitch
from turtle_brick.geometry import from_yaw
from turtle_brick.geometry import IDENTITY
from turtle_brick.geometry import multiply
from turtle_brick.geometry import Pose
from turtle_brick.parameters import load
from turtle_brick.physics import Phase
from turtle_brick.physics import World
from turtle_brick.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.turtlesim_kinematics import TICK
from turtle_brick.turtlesim_kinematics import Turtle

PARAMETERS = load()
GRAVITY = PARAMETERS.gravity_accel
REST = resting_height(PARAMETERS)
STEP = 4_000_000
SECOND = 1_000_000_000


def law(examples):
    """Check so many random cases, the same ones every time."""
    return settings(max_examples=examples, derandomize=True, deadline=None)


gravities = st.floats(0.5, 30.0)
heights = st.floats(0.5, 30.0)
coordinates = st.floats(-10.0, 20.0)
# The times between samples (ns): at 50 Hz or faster, however irregularly.
intervals = st.one_of(
    st.just([STEP]), st.just([20_000_000]),
    st.lists(st.integers(1_000_000, 20_000_000), min_size=1, max_size=10))


# ----------------------------------------------------------------------------------- telling falls

class Watch:
    """A detector that is shown a brick at intervals that repeat."""

    def __init__(self, spacing=(STEP,), gravity=GRAVITY, now=SECOND):
        self.detector = FallDetector(gravity)
        self.spacing = deque(spacing)
        self.now = now
        self.recognised = 0

    def see(self, x, y, z):
        """Show a position at the present instant, then go on to the next; tell if it's a fall."""
        seen = self.detector.observe(self.now, x, y, z)
        self.recognised += seen
        self.now += self.spacing[0]
        self.spacing.rotate(-1)
        return seen

    def hover(self, x, y, z, samples):
        """Show a brick that stays; tell whether that looked like a fall."""
        return sum(self.see(x, y, z) for _ in range(samples)) > 0

    def fall(self, x, y, z, release, samples):
        """Show a brick that was released at an instant (ns); return the recognised fall."""
        for _ in range(samples):
            time = max(self.now - release, 0) * 1e-9
            if self.see(x, y, z - 0.5 * self.detector.gravity * time * time):
                return self.detector.fall
        return None


@law(500)
@given(x=coordinates, y=coordinates, height=heights, gravity=gravities, spacing=intervals,
       hovering=st.integers(0, 5), part=st.floats(0.0, 1.0))
def test_fall_is_known_by_its_third_sample_with_its_course(
        x, y, height, gravity, spacing, hovering, part):
    """Whenever it is released, and however it is sampled at 50 Hz or more."""
    watch = Watch(spacing, gravity)
    watch.hover(x, y, height, hovering)
    release = watch.now - round(part * watch.spacing[-1]) if hovering else watch.now
    # The first of these may be the release itself; three more are in the fall.
    fall = watch.fall(x, y, height, release, 4)
    assert fall is not None
    assert fall.stamp <= watch.now
    for drop in (0.3, 0.5, 5.0, 25.0):
        contact = release + sqrt(2.0 * drop / gravity) * 1e9
        if contact > fall.stamp:
            estimate = fall.stamp + fall.time_to(height - drop, gravity) * 1e9
            assert abs(estimate - contact) <= 1e6
    assert fall.position[:2] == (x, y)
    # It is one fall, down to the end.
    recognised = watch.recognised
    watch.fall(x, y, height, release, 100)
    assert watch.recognised == recognised == 1


@law(200)
@given(height=heights, speed=st.floats(0.0, 20.0), gravity=gravities, spacing=intervals)
def test_fall_is_known_when_it_is_first_seen_halfway(height, speed, gravity, spacing):
    watch = Watch(spacing, gravity)
    start = watch.now
    for _ in range(3):
        time = (watch.now - start) * 1e-9
        watch.see(1.0, 2.0, height - speed * time - 0.5 * gravity * time * time)
    assert watch.recognised == 1
    time = (watch.detector.fall.stamp - start) * 1e-9
    assert watch.detector.fall.speed == pytest.approx(speed + gravity * time, abs=1e-3)


@law(300)
@given(spacing=intervals, gravity=gravities, places=st.lists(
    st.tuples(st.integers(2, 4), st.sampled_from((0.0, 1.0)), st.one_of(
        st.floats(-1e-2, 1e-2), st.floats(-10.0, 10.0), st.floats(-1e-6, 1e-6))),
    max_size=20))
def test_being_placed_is_no_fall(spacing, gravity, places):
    """Lower, higher or sideways, by any amount, in any succession."""
    watch = Watch(spacing, gravity)
    x, y, z = 5.0, 5.0, 20.0
    for samples, sideways, amount in places:
        x, z = x + sideways * amount, z + (1.0 - sideways) * amount
        watch.hover(x, y, z, samples)
    assert watch.recognised == 0


@law(200)
@given(gravity=gravities, every=st.integers(1, 5), place=st.tuples(
    st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)), programme=st.lists(st.tuples(
        st.integers(1, 30), st.floats(-1.5, 1.5), st.floats(-0.04, 0.04),
        st.floats(-0.04, 0.04), st.floats(-0.3, 0.3)), min_size=1, max_size=8))
def test_riding_and_sliding_are_no_fall(gravity, every, place, programme):
    """On a platform that is tilted at once by up to 86 degrees, drives and turns."""
    world = World((5.0 + place[0], 5.0 + place[1], REST + 0.001), gravity,
                  PARAMETERS.platform_radius, STEP * 1e-9)
    world.size, world.thickness = PARAMETERS.brick_size, PARAMETERS.platform_thickness
    hinge = PARAMETERS.platform_height - PARAMETERS.platform_thickness
    world.platform = Pose((5.0, 5.0, hinge), from_yaw(0.0))
    world.release()
    while world.phase is Phase.FALLING:
        world.step()
    watch = Watch([every * STEP], gravity)
    x = y = 5.0
    yaw = step = 0
    for steps, tilt, dx, dy, dyaw in programme:
        for _ in range(steps):
            x, y, yaw = x + dx, y + dy, yaw + dyaw
            world.platform = Pose((x, y, hinge), multiply(from_yaw(yaw), from_pitch(tilt)))
            world.step()
            step += 1
            if step % every == 0:
                watch.see(*world.brick)
    assert watch.recognised == 0


@pytest.mark.parametrize('tilt', [0.1 * step for step in range(1, 16)] + [1.3, 1.45])
@pytest.mark.parametrize('every', range(1, 6))
def test_slide_on_a_still_platform_is_no_fall(tilt, every):
    """The steeper the slope, the more it is like one: 1.5 rad is the steepest tilt_angle."""
    gravity, path_x, path_z = GRAVITY * sin(tilt), cos(tilt), sin(tilt)
    watch = Watch([every * STEP])
    start = watch.now + STEP
    while True:
        time = max(watch.now - start, 0) * 1e-9
        path = 0.5 * gravity * time * time
        if path > 1.5:
            break
        watch.see(5.0 + path * path_x, 5.0, REST - path * path_z)
    assert watch.recognised == 0


@law(200)
@given(spacing=intervals, factor=st.one_of(st.floats(0.0, 0.88), st.floats(1.12, 3.0)),
       speed=st.floats(0.1, 10.0))
def test_other_accelerations_are_no_fall(spacing, factor, speed):
    watch = Watch(spacing)
    start = watch.now
    for _ in range(50):
        time = (watch.now - start) * 1e-9
        watch.see(1.0, 2.0, 50.0 - speed * time - 0.5 * factor * GRAVITY * time * time)
    assert watch.recognised == 0


@law(200)
@given(spacing=intervals, samples=st.integers(0, 30), sideways=st.booleans(),
       amount=st.builds(lambda size, sign: size * sign, st.floats(0.02, 10.0),
                        st.sampled_from((1.0, -1.0))))
def test_fall_that_is_interrupted_has_ended(spacing, samples, sideways, amount):
    """The brick is placed elsewhere, then dropped again: a fall of its own."""
    watch = Watch(spacing)
    watch.hover(5.0, 5.0, 20.0, 2)
    release = watch.now
    assert watch.fall(5.0, 5.0, 20.0, release, 4)
    watch.fall(5.0, 5.0, 20.0, release, samples)
    time = (watch.now - release) * 1e-9
    x, z = 5.0, 20.0 - 0.5 * GRAVITY * time * time
    x, z = (x + amount, z) if sideways else (x, z + amount)
    watch.see(x, 5.0, z)
    assert watch.detector.fall is None
    assert not watch.hover(x, 5.0, z, 3)
    assert watch.fall(x, 5.0, z, watch.now, 4).stamp < watch.now
    assert watch.recognised == 2


@law(200)
@given(spacing=intervals, samples=st.integers(0, 20),
       amount=st.floats(1e-3, 10.0), gravity=gravities)
def test_falling_brick_that_is_moved_sideways_falls_anew(spacing, samples, amount, gravity):
    """And goes on falling: where it comes down is another place, decided again."""
    watch = Watch(spacing, gravity)
    release = watch.now
    assert watch.fall(5.0, 5.0, 50.0, release, 4)
    watch.fall(5.0, 5.0, 50.0, release, samples)
    fall = watch.fall(5.0 + amount, 5.0, 50.0, release, 4)
    assert fall is not None
    assert fall.x == 5.0 + amount
    contact = release * 1e-9 + sqrt(2.0 * 49.0 / gravity)
    if fall.z > 1.0:
        assert fall.stamp * 1e-9 + fall.time_to(1.0, gravity) == pytest.approx(contact, abs=1e-3)


@law(200)
@given(spacing=intervals, drop=st.floats(0.05, 10.0))
def test_fall_has_ended_once_the_brick_lies(spacing, drop):
    watch = Watch(spacing)
    release = watch.now
    landed = release + round(sqrt(2.0 * drop / GRAVITY) * 1e9)
    while watch.now < landed:
        watch.fall(5.0, 5.0, 2.0 + drop, release, 1)
    since = watch.now
    while watch.now - since < 100_000_000:
        watch.hover(5.0, 5.0, 2.0, 1)
    assert watch.detector.fall is None
    assert watch.recognised <= 1


def test_samples_that_come_twice_count_once():
    watch = Watch()
    release = watch.now
    for _ in range(3):
        time = (watch.now - release) * 1e-9
        z = 5.0 - 0.5 * GRAVITY * time * time
        for _ in range(3):
            seen = watch.detector.observe(watch.now, 1.0, 1.0, z)
            watch.recognised += seen
        watch.now += STEP
    assert watch.recognised == 1


def test_time_that_jumps_back_begins_anew():
    watch = Watch(now=10 * SECOND)
    assert watch.fall(5.0, 5.0, 20.0, watch.now, 4)
    watch.now = 2 * SECOND
    assert not watch.see(5.0, 5.0, 19.0)
    assert watch.detector.fall is None
    assert watch.fall(5.0, 5.0, 19.0, watch.now, 4)


@law(200)
@given(z=heights, speed=st.floats(0.0, 20.0), gravity=gravities, time=st.floats(0.0, 3.0))
def test_course_of_a_fall_is_the_closed_form(z, speed, gravity, time):
    fall = Fall(SECOND, 1.0, 2.0, z, speed)
    height = fall.height(SECOND + round(time * 1e9), gravity)
    assert height == pytest.approx(z - speed * time - 0.5 * gravity * time ** 2, abs=1e-6)
    assume(height < z)
    assert fall.time_to(height, gravity) == pytest.approx(time, abs=1e-6)
    assert fall.time_to(z, gravity) == pytest.approx(0.0, abs=1e-9)
    # It was released where its speed was zero, and has been at every height below since.
    released = z + speed ** 2 / (2.0 * gravity)
    assert isnan(fall.time_to(released + 1e-6, gravity))
    assume(released > z + 1e-6)
    assert fall.time_to(released - 1e-6, gravity) == pytest.approx(
        (sqrt(2.0 * gravity * 1e-6) - speed) / gravity, abs=1e-4)


extremes = st.sampled_from((0.0, 5.0, 1e9, -1e9, 1e200, 1e308, -1e308, inf, -inf, float('nan')))


@law(300)
@given(positions=st.lists(st.tuples(extremes, extremes, extremes), min_size=3, max_size=20))
def test_no_position_is_a_fall_that_cannot_be_reckoned_with(positions):
    """Finite or not: nothing raises, and no verdict has a number that is none."""
    detector, catcher = FallDetector(GRAVITY), Catcher(PARAMETERS)
    for step, position in enumerate(positions):
        detector.observe(step * STEP, *position)
        catcher.see_brick(step * STEP, position)
        catcher.update(step * STEP, Pose((5.0, 5.0, 1.56), IDENTITY))
        for fall in (detector.fall, catcher.decision and catcher.decision.fall):
            assert fall is None or all(map(isfinite, fall))


# ------------------------------------------------------------------------------------------- reach

def seconds(time):
    """Return a time (s) in ns."""
    return round(time * 1e9)


@st.composite
def settings_of_robot(draw):
    """Draw parameters of another robot on another planet."""
    return replace(PARAMETERS, max_velocity=draw(st.floats(0.1, 10.0)),
                   gravity_accel=draw(gravities), platform_height=draw(st.floats(1.5, 5.0)))


inside = st.floats(0.0, ARENA_SIZE)


@law(500)
@given(parameters=settings_of_robot(), x=inside, y=inside, robot_x=inside, robot_y=inside,
       above=st.floats(0.0, 20.0), late=st.floats(0.0, 0.05))
def test_reachable_is_what_the_robot_has_the_time_for(
        parameters, x, y, robot_x, robot_y, above, late):
    """
    (distance - radius) / max_velocity and the latency are within the time until the contact.

    And the promise: no refusal inside max_velocity * (t_fall - 0.13 s) + platform_radius.
    """
    fall = Fall(SECOND, x, y, resting_height(parameters) + above, 0.0)
    decision = reach(fall, SECOND + seconds(late), Robot(robot_x, robot_y), parameters)
    available = sqrt(2.0 * above / parameters.gravity_accel) - late
    distance = hypot(x - robot_x, y - robot_y)
    assert decision.available == pytest.approx(available, abs=1e-6)
    assert decision.distance == pytest.approx(distance)
    assert decision.contact == pytest.approx(SECOND + seconds(available + late), abs=1e3)
    assert decision.margin == decision.available - decision.needed
    way = distance - parameters.platform_radius
    if way <= 0.0:
        assert decision.needed == 0.0
    else:
        assert decision.needed == COMMAND_LATENCY + travel_time(
            distance, parameters.platform_radius, parameters.max_velocity)
        assert decision.needed >= COMMAND_LATENCY + way / parameters.max_velocity - 1e-12
    assert decision.reachable == (decision.needed <= max(decision.available, 0.0))
    assert decision.reachable == (decision.reason == '')
    # A fall is known by its third sample, 8 ms later.
    if way > 0.0 and way <= parameters.max_velocity * (available + late - 0.13) and late <= 0.01:
        assert decision.reachable


@law(300)
@given(parameters=settings_of_robot(), distance=st.floats(0.0, 5.0), more=st.floats(0.0, 5.0),
       above=st.floats(0.0, 20.0), higher=st.floats(0.0, 20.0), angle=st.floats(0.0, 1.5))
def test_nearer_or_higher_is_no_harder_to_reach(
        parameters, distance, more, above, higher, angle):
    def decide(distance, above):
        fall = Fall(SECOND, distance * cos(angle), distance * sin(angle),
                    resting_height(parameters) + above, 0.0)
        return reach(fall, SECOND, Robot(0.0, 0.0), parameters)

    decision = decide(distance, above)
    for easier in (decide(distance, above + higher), decide(distance / (1.0 + more), above)):
        assert easier.margin >= decision.margin - 1e-9
        assert easier.reachable or not decision.reachable


def test_brick_below_the_platform_or_outside_the_arena_is_out_of_reach():
    """However near, and however much time there is; at the very edge it is not."""
    for x, y, z, word in ((5.0, 5.0, REST - 0.01, 'below'), (-0.01, 5.0, 9.0, 'outside'),
                          (5.0, ARENA_SIZE + 0.01, 9.0, 'outside')):
        decision = reach(Fall(SECOND, x, y, z, 0.0), SECOND, Robot(x, y), PARAMETERS)
        assert not decision.reachable
        assert word in decision.reason
    for x, y, z in ((5.0, 5.0, REST), (0.0, 5.0, 9.0), (5.0, ARENA_SIZE, 9.0)):
        assert reach(Fall(SECOND, x, y, z, 0.0), SECOND, Robot(x, y), PARAMETERS).reachable


def test_brick_of_a_robot_that_is_not_known_is_out_of_reach():
    decision = reach(Fall(SECOND, 5.0, 5.0, 9.0, 0.0), SECOND, None, PARAMETERS)
    assert not decision.reachable
    assert 'no robot' in decision.reason
    assert decision.needed == inf


def test_reason_says_what_is_missing():
    decision = reach(Fall(SECOND, 9.0, 5.0, 2.0, 0.0), SECOND, Robot(5.0, 5.0), PARAMETERS)
    assert not decision.reachable
    assert '4.00 m' in decision.reason
    assert f'{decision.needed:.3f} s' in decision.reason
    assert f'{decision.available:.3f} s' in decision.reason
    assert f'{-decision.margin:.3f} s too early' in decision.reason


def test_tilted_platform_must_be_levelled_in_time():
    def decide(time, level):
        fall = Fall(SECOND, 5.0, 5.0, REST + 0.5 * GRAVITY * time ** 2, 0.0)
        return reach(fall, SECOND, Robot(5.0, 5.0, (), level), PARAMETERS)

    assert decide(LEVEL_LATENCY - 0.001, True).reachable
    assert not decide(LEVEL_LATENCY - 0.001, False).reachable
    assert decide(LEVEL_LATENCY + 0.001, False).reachable


@law(200)
@given(bound_for=st.lists(st.tuples(inside, inside), max_size=4), above=st.floats(0.0, 20.0))
def test_robot_that_moves_counts_where_it_may_be_carried_farthest(bound_for, above):
    robot = Robot(5.0, 5.0, tuple(bound_for))
    fall = Fall(SECOND, 6.0, 7.0, REST + above, 0.0)
    decision = reach(fall, SECOND, robot, PARAMETERS)
    margins = [reach(fall, SECOND, Robot(x, y), PARAMETERS).margin
               for x, y in [(5.0, 5.0), *bound_for]]
    assert decision.margin == min(margins)
    assert decision.distance == hypot(1.0, 2.0)


def test_queue_latency_is_turtlesims():
    """The longest time from publishing a changed command to the pose that shows it."""
    random = Random(1)
    longest = 0.0
    for _ in range(300):
        turtle = Turtle(5.5, 5.5, holonomic=True)
        tick_at, publish_at = random.uniform(0.0, TICK), random.uniform(0.0, 0.01)
        changed = None
        inbox = deque()
        while True:
            if tick_at <= publish_at:
                while inbox and inbox[0][0] <= tick_at:
                    turtle.command(inbox.popleft()[1], 0.0, 0.0)
                if turtle.tick(tick_at).linear_velocity:
                    break
                tick_at += TICK
            else:
                if changed is None and publish_at > 0.5:
                    changed = publish_at
                inbox.append((publish_at + 0.0004, 0.0 if changed is None else 1.0))
                publish_at += 0.01
        longest = max(longest, tick_at - changed)
    assert QUEUE_LATENCY - 0.001 < longest <= QUEUE_LATENCY


# -------------------------------------------------------------------------------------- the states

# Each state's ways out, in the order of their priority; none taken: the state stays.
WAYS_OUT = {
    State.WAITING: [
        (State.CARRYING, lambda seen: seen.lying)],
    State.APPROACHING: [
        (State.CARRYING, lambda seen: seen.on_platform),
        (State.LEVELLING, lambda seen: not seen.falling)],
    State.CARRYING: [
        (State.LEVELLING, lambda seen: not seen.on_platform),
        (State.TILTING, lambda seen: seen.at_centre)],
    State.TILTING: [
        (State.LEVELLING, lambda seen: seen.off_platform or seen.out_of_patience)],
    State.LEVELLING: [
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


# ------------------------------------------------------------------------------------- the Catcher

class Stage:
    """A Catcher, a World, and a robot that does what it is told without delay."""

    def __init__(self, parameters=PARAMETERS, robot=CENTRE, every=1, noise=0.0):
        self.parameters = parameters
        self.catcher = Catcher(parameters)
        self.world = World((5.0, 5.0, 9.0), parameters.gravity_accel,
                           parameters.platform_radius, STEP * 1e-9)
        self.world.size = parameters.brick_size
        self.world.thickness = parameters.platform_thickness
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
        """Return the pose of the platform's frame, as it is seen."""
        x, y = (value + self.random.uniform(-self.noise, self.noise) for value in self.robot)
        hinge = self.parameters.platform_height - self.parameters.platform_thickness
        return Pose((x, y, hinge), from_pitch(self.angle))

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
            if isinstance(action, Drive):
                self.goal = (action.x, action.y)
            elif isinstance(action, Tilt):
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

    def told(self, kind):
        """Return the actions of a kind."""
        return [action for _, action in self.actions if isinstance(action, kind)]


COURSE = [State.APPROACHING, State.CARRYING, State.TILTING, State.LEVELLING, State.WAITING]


@pytest.mark.parametrize('every', (1, 2, 3, 4, 5))
def test_catches_carries_and_tips_off_any_number_of_bricks(every):
    """Also where the brick is seen no more than 50 times per second."""
    stage = Stage(every=every)
    for x, y in ((7.0, 7.0), (4.0, 5.5), (5.5, 5.5), (9.0, 2.0)):
        stage.drop(x, y, 16.0)
        stage.reach_state(State.CARRYING)
        assert stage.world.phase is Phase.RIDING
        stage.reach_state(State.TILTING)
        assert hypot(stage.robot[0] - CENTRE[0], stage.robot[1] - CENTRE[1]) <= ARRIVED
        assert stage.world.phase is Phase.RIDING
        stage.reach_state(State.WAITING)
        assert stage.world.phase is Phase.FLOATING
        assert stage.angle == 0.0
        assert stage.states == COURSE
        assert stage.told(Drive) == [Drive(x, y), Drive(*CENTRE)]
        assert stage.told(Unreachable) == []


def test_rounding_is_no_motion():
    """Two transforms of what stands still need not be equal to the last bit."""
    stage = Stage(noise=1e-12)
    # A robot at rest, with so little to spare that a moving one would be refused.
    stage.drop(7.0, 5.5, REST + 0.5 * GRAVITY * 0.5 ** 2)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING
    assert stage.catcher.decision.margin < 0.1


def test_platform_is_tilted_and_levelled_smoothly():
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
    assert stage.told(Drive)[0] == Drive(6.0, 6.0)
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
        marker, = stage.actions
        assert isinstance(marker[1], Unreachable)
        assert marker[1].position[:2] == brick[:2]
        assert 0.0 <= brick[2] - marker[1].position[2] < 0.01
        assert reason in stage.catcher.decision.reason
        assert stage.states == []


def test_brick_that_is_caught_by_luck_is_tipped_off():
    """It was called unreachable, but there it lies: it is carried like any other."""
    stage = Stage(robot=(11.0, 5.0))
    stage.drop(11.2, 5.0, 9.0)
    stage.reach_state(State.WAITING)
    assert len(stage.told(Unreachable)) == 1
    assert stage.states == COURSE[1:]
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('start', (CENTRE, (3.0, 8.0)))
@pytest.mark.parametrize('above', (0.0, 1e-9, 1e-4, 3e-4, 4e-4, 0.001, 0.01, 0.1))
def test_brick_that_is_dropped_onto_the_robot_from_just_above_is_carried_off(above, start):
    """It is never called unreachable, however late its fall is seen, if it is seen at all."""
    stage = Stage(robot=start)
    stage.drop(start[0] + 0.1, start[1], REST + above)
    stage.reach_state(State.CARRYING, 1.2)
    stage.reach_state(State.WAITING)
    assert stage.told(Unreachable) == []
    assert stage.world.phase is Phase.FLOATING
    assert stage.told(Drive)[-1] == Drive(*CENTRE)


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
    assert stage.states == [State.CARRYING, State.LEVELLING, State.WAITING]
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
    assert stage.told(Unreachable) == []
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
    assert stage.told(Unreachable) == []
    assert stage.world.phase is Phase.FLOATING


@pytest.mark.parametrize('height, place', ((9.0, (-0.1, 5.0)), (REST - 0.1, CENTRE)))
def test_does_not_wait_for_a_robot_that_could_not_help(height, place):
    stage = Stage()
    stage.visible = False
    stage.drop(*place, height)
    stage.run(0.1)
    assert [type(action) for _, action in stage.actions] == [Unreachable]


@pytest.mark.parametrize('lost', (1, 2, 3))
def test_order_that_is_lost_is_given_again(lost):
    """Until the robot is seen to obey."""
    stage = Stage()
    decide = stage.decide

    def decide_deaf():
        nonlocal lost
        drives, goal = len(stage.told(Drive)), stage.goal
        decide()
        if len(stage.told(Drive)) > drives and lost:
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
    assert isinstance(action, Unreachable)
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
    """The platform is levelled at once, and the robot is under the new place."""
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
    assert stage.told(Drive)[-2:] == [Drive(4.0, 4.0), Drive(*CENTRE)]
    stage.reach_state(State.WAITING)
    assert stage.states[-4:] == COURSE[1:]
    assert stage.told(Unreachable) == []


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
    """It arrives there, and is sent to the centre again."""
    stage = Stage()
    stage.drop(7.0, 6.0, 9.0)
    stage.reach_state(State.CARRYING)
    stage.run(0.1)
    stage.goal = (9.0, 9.0)
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.told(Drive) == [Drive(7.0, 6.0), Drive(*CENTRE), Drive(*CENTRE)]
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
    assert dist(stage.robot, CENTRE) <= 0.02
    stage.reach_state(State.WAITING)
    assert stage.states == COURSE
    assert stage.world.phase is Phase.FLOATING


def test_platform_that_somebody_tilted_is_levelled_for_the_catch():
    stage = Stage()
    stage.angle = 0.4
    stage.run(0.1)
    stage.drop(6.0, 6.0, 9.0)
    stage.reach_state(State.CARRYING)
    assert stage.told(Tilt)[0] == Tilt(0.0)
    assert stage.world.phase is Phase.RIDING


@law(30)
@given(angle=st.floats(-pi, pi), time=st.floats(0.0, 1.2), speed=st.floats(1.0, 10.0))
def test_never_orders_the_robot_out_of_the_arena(angle, time, speed):
    """Nor, when the brick is taken away while it drives, far from where it is."""
    stage = Stage(replace(PARAMETERS, max_velocity=speed))
    stage.drop(min(max(CENTRE[0] + 8.0 * cos(angle), 0.0), ARENA_SIZE),
               min(max(CENTRE[1] + 8.0 * sin(angle), 0.0), ARENA_SIZE), 2000.0)
    stage.run(0.1 + time)
    assert stage.catcher.state is State.APPROACHING
    stage.world.brick = (5.0, 5.0, 1.0)
    stage.reach_state(State.WAITING, 3.0)
    stop = stage.told(Drive)[-1]
    assert len(stage.told(Drive)) == 2
    for drive in stage.told(Drive):
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
    assert catcher.state is State.LEVELLING


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
