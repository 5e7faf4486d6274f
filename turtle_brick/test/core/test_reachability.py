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

"""Test reachability and robot tracking with examples and random input."""

from dataclasses import replace
from math import hypot, inf, sqrt

from hypothesis import given
from hypothesis import strategies as st
from laws import GRAVITY, law, NS_PER_SECOND, PARAMETERS, REST_Z, seconds
import pytest
from turtle_brick.core.driving import travel_time
from turtle_brick.core.fall_detection import Fall
from turtle_brick.core.geometry import from_pitch, Pose
from turtle_brick.core.latency import LatencyMonitor
from turtle_brick.core.reachability import (COMMAND_LATENCY, decide_reachability, fall_time,
                                            guaranteed_distance, LEVEL_LATENCY, resting_height,
                                            RobotMotion)
from turtle_brick.core.robot_tracking import COMMITTED_TIME, RobotTracker
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE


def decide(x, y, z, robot=RobotMotion(5.0, 5.0), excess=0.0, speed=0.0, delay=0.0):
    """Return the decision `delay` (s) after a brick had a given position (m) and speed (m/s)."""
    return decide_reachability(Fall(NS_PER_SECOND, x, y, z, speed), NS_PER_SECOND + seconds(delay),
                               robot, PARAMETERS, excess)


def test_brick_is_reachable_if_the_robot_has_enough_time():
    assert decide(6.0, 5.0, 9.0).reachable
    assert not decide(6.0, 5.0, 9.0, excess=2.0).reachable
    assert not decide(10.0, 5.0, 3.0).reachable


def test_resting_height_fall_time_and_guaranteed_distance():
    """If the fall takes as long as the latency, the guaranteed distance is the platform radius."""
    assert REST_Z == PARAMETERS.platform_height + PARAMETERS.brick_size[2] / 2.0
    assert fall_time(REST_Z + 0.5 * GRAVITY, PARAMETERS) == pytest.approx(1.0)
    assert fall_time(REST_Z - 1.0, PARAMETERS) == 0.0
    height = REST_Z + 0.5 * GRAVITY * 0.13 ** 2
    assert guaranteed_distance(height, PARAMETERS) == pytest.approx(PARAMETERS.platform_radius)
    assert guaranteed_distance(REST_Z - 0.01, PARAMETERS) == -inf


@pytest.mark.parametrize(('x', 'y', 'z', 'speed', 'reason'), [
    (5.0, 5.0, REST_Z, 0.0, ''), (5.0, 5.0, REST_Z - 0.01, 0.0, 'below its resting height'),
    (5.0, 5.0, REST_Z - 0.01, 3.0, 'already passed'),
    (0.0, 5.0, 9.0, 0.0, ''), (-0.01, 5.0, 9.0, 0.0, 'outside the arena'),
    (5.0, ARENA_SIZE, 9.0, 0.0, ''), (5.0, ARENA_SIZE + 0.01, 9.0, 0.0, 'outside the arena')])
def test_brick_below_the_platform_or_outside_the_arena_is_unreachable(x, y, z, speed, reason):
    decision = decide(x, y, z, RobotMotion(x, y), speed=speed, delay=0.02)
    assert decision.reachable == (reason == '') and reason in decision.reason


def test_reason_gives_distance_times_and_latency():
    decision = decide(9.0, 5.0, 2.0)
    assert decision.reason == (
        f'the robot, 4.00 m away, needs {decision.needed:.3f} s, but the brick lands in '
        f'{decision.available:.3f} s, {-decision.margin:.3f} s too early (command latency 0.11 s)')
    assert decision.summary == f'unreachable: {decision.reason}'
    assert decide(6.0, 5.0, 9.0).summary.startswith('reachable: the robot, 1.00 m away, needs ')
    decision = decide(9.0, 5.0, 2.0, robot=None)
    assert (decision.reachable, decision.needed) == (False, inf)
    assert 'no robot' in decision.reason


@pytest.mark.parametrize('excess', (0.0, 0.2))
def test_tilted_platform_must_be_leveled_in_time(excess):
    def is_reachable(time, level):
        height = REST_Z + 0.5 * GRAVITY * (time + excess) ** 2
        return decide(5.0, 5.0, height, RobotMotion(5.0, 5.0, (), level), excess).reachable

    assert is_reachable(LEVEL_LATENCY - 0.001, True)
    assert not is_reachable(LEVEL_LATENCY - 0.001, False)
    assert is_reachable(LEVEL_LATENCY + 0.001, False)


inside = st.floats(0.0, ARENA_SIZE)
other_robots = st.builds(
    lambda speed, gravity, height: replace(PARAMETERS, max_velocity=speed, gravity_accel=gravity,
                                           platform_height=height),
    st.floats(0.1, 10.0), st.floats(0.5, 30.0), st.floats(1.5, 5.0))


@law(40)
@given(parameters=other_robots, x=inside, y=inside, robot_x=inside, robot_y=inside,
       above=st.floats(0.0, 20.0), late=st.floats(0.0, 0.05),
       excess=st.just(0.0) | st.floats(0.0, 1.0), uncertainty=st.just(0.0) | st.floats(0.0, 2.0))
def test_decision_follows_the_formula_and_keeps_the_guarantee(
        parameters, x, y, robot_x, robot_y, above, late, excess, uncertainty):
    fall = Fall(NS_PER_SECOND, x, y, resting_height(parameters) + above, 0.0)
    decision = decide_reachability(fall, NS_PER_SECOND + seconds(late), RobotMotion(
        robot_x, robot_y, uncertainty=uncertainty), parameters, excess)
    available = sqrt(2.0 * above / parameters.gravity_accel) - late
    distance = hypot(x - robot_x, y - robot_y)
    assert decision.available == pytest.approx(available, abs=1e-6)
    assert decision.distance == pytest.approx(distance)
    assert decision.contact == pytest.approx(NS_PER_SECOND + seconds(available + late), abs=1e3)
    assert decision.margin == decision.available - decision.needed
    farthest = distance + uncertainty
    way = farthest - parameters.platform_radius
    assert decision.needed == (0.0 if way <= 0.0 else COMMAND_LATENCY + excess + travel_time(
        farthest, parameters.platform_radius, parameters.max_velocity))
    assert decision.reachable == (decision.needed <= max(decision.available, 0.0))
    assert decision.reachable == (decision.reason == '')
    guaranteed = (parameters.max_velocity * (available + late - 0.13 - excess)
                  + parameters.platform_radius)
    assert guaranteed_distance(fall.z, parameters, excess) == pytest.approx(guaranteed, abs=1e-6)
    # A fall is detected at the third brick position, 8 ms after the release.
    if way > 0.0 and farthest <= guaranteed and late <= 0.01:
        assert decision.reachable


HINGE = PARAMETERS.platform_height - PARAMETERS.platform_thickness

any_excess = pytest.mark.parametrize('excess', (0.0, 0.2))


def make_tracker(excess=0.0):
    """Return a tracker with `excess` latency (s), the committed distance (m) and latency (s)."""
    latency = LatencyMonitor()
    for _ in range(2):
        latency.record_response_delay(NS_PER_SECOND, excess)
    return (RobotTracker(PARAMETERS.max_velocity, latency),
            PARAMETERS.max_velocity * (COMMITTED_TIME + excess), COMMAND_LATENCY + excess)


def observe(tracker, time, x, y=5.0, tilt=0.0, level_for=inf):
    return tracker.observe(seconds(time), Platform(Pose((x, y, HINGE), from_pitch(tilt))),
                           level_for)


@any_excess
def test_moving_robot_may_continue_at_full_speed_until_it_is_at_rest(excess):
    tracker, way, _ = make_tracker(excess)
    observe(tracker, 1.0, 5.0)
    robot = observe(tracker, 1.01, 5.003, 5.004)
    assert robot.destinations == (pytest.approx((5.003 + 0.6 * way, 5.004 + 0.8 * way)),)
    assert not robot.at_rest and robot.uncertainty == 0.0
    assert observe(tracker, 1.075 + excess, 5.003, 5.004).destinations == robot.destinations
    assert observe(tracker, 1.09 + excess, 5.003, 5.004).at_rest
    assert observe(tracker, 1.1 + excess, 5.003 + 1e-10, 5.004).at_rest


@any_excess
def test_robot_may_drive_straight_ahead_or_to_its_last_goals(excess):
    """A new goal takes effect after the latency. Until then, the previous goal is possible too."""
    tracker, way, latency = make_tracker(excess)
    observe(tracker, 1.0, 5.0)
    tracker.record_goal(seconds(1.3 - latency), (9.0, 5.0))
    assert observe(tracker, 1.299, 5.0).destinations == ((5.0 + way, 5.0),)
    observe(tracker, 1.34, 8.87)
    robot = observe(tracker, 1.35, 8.9)
    assert robot.destinations == (pytest.approx((8.9 + way, 5.0)), pytest.approx((9.0, 5.0)))
    tracker.record_goal(seconds(1.4), (8.9, 1.0))
    before, after = observe(tracker, 1.4 + latency - 0.001, 8.9).destinations[-2:]
    assert before == pytest.approx((9.0, 5.0))
    assert after == pytest.approx((8.9, 5.0 - way))
    assert observe(tracker, 1.4 + latency + 0.001, 8.9).at_rest


@any_excess
def test_motion_of_a_newly_observed_robot_is_uncertain(excess):
    tracker, way, _ = make_tracker(excess)
    for begin in (1.0, 2.0):
        assert observe(tracker, begin, 5.0).uncertainty == way
        assert observe(tracker, begin + 0.069 + excess, 5.0).uncertainty == way
        assert observe(tracker, begin + 0.071 + excess, 5.0).at_rest
        assert tracker.observe(seconds(begin + 0.3), None, inf) is None
        assert (tracker.last_seen, tracker.last_unseen) == (
            seconds(begin + 0.071 + excess), seconds(begin + 0.3))


@pytest.mark.parametrize(('still', 'moved', 'goal', 'longer'), [
    (COMMAND_LATENCY + 0.05, 0.2, 9.0, 0.2 - COMMAND_LATENCY),
    (COMMAND_LATENCY - 0.01, 0.2, 9.0, 0.0),
    (0.9, 1.5, 9.0, 1.5 - COMMAND_LATENCY),
    (1.1, 1.2, 9.0, 0.0),
    (0.2, 0.3, 5.01, 0.0)],
    ids=('late', 'observed late', 'very late', 'ignored', 'near goal'))
def test_response_delay_of_a_robot_at_rest_is_measured(still, moved, goal, longer):
    latency = LatencyMonitor()
    latency.record_response_delay(NS_PER_SECOND, inf)  # Only the second delay counts.
    tracker = RobotTracker(PARAMETERS.max_velocity, latency)
    for time in (1.9, 2.0):
        observe(tracker, time, 5.0)
    tracker.record_goal(seconds(2.0), (goal, 5.0))
    observe(tracker, 2.0 + still, 5.0)
    observe(tracker, 2.0 + moved, 5.02)
    observe(tracker, 2.1 + moved, 5.3)
    assert tracker.excess == pytest.approx(longer)


@any_excess
def test_platform_is_level_after_every_node_has_received_the_level_transform(excess):
    tracker, *_ = make_tracker(excess)
    assert observe(tracker, 1.0, 5.0).level
    assert not observe(tracker, 1.1, 5.0, level_for=LEVEL_LATENCY + excess - 1e-6).level
    assert observe(tracker, 1.2, 5.0, level_for=LEVEL_LATENCY + excess + 1e-6).level
    assert not observe(tracker, 1.3, 5.0, tilt=0.01).level
    assert tracker.last_level == seconds(1.2)
