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

"""Reach: the verdict on a fall, held to closed forms and to the times that it is made of."""

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
from turtle_brick.core.reachability import (COMMAND_LATENCY, decide_reachability,
                                            guaranteed_distance, LEVEL_LATENCY, resting_height,
                                            RobotMotion)
from turtle_brick.core.robot_tracking import COMMITTED_TIME, RobotTracker
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE

inside = st.floats(0.0, ARENA_SIZE)
other_robots = st.builds(
    lambda speed, gravity, height: replace(PARAMETERS, max_velocity=speed, gravity_accel=gravity,
                                           platform_height=height),
    st.floats(0.1, 10.0), st.floats(0.5, 30.0), st.floats(1.5, 5.0))


@law(40)
@given(parameters=other_robots, x=inside, y=inside, robot_x=inside, robot_y=inside,
       above=st.floats(0.0, 20.0), late=st.floats(0.0, 0.05),
       excess=st.just(0.0) | st.floats(0.0, 1.0), reserve=st.just(0.0) | st.floats(0.0, 2.0))
def test_reachable_is_what_the_robot_has_the_time_for(
        parameters, x, y, robot_x, robot_y, above, late, excess, reserve):
    """
    (distance - radius) / max_velocity and the latency are within the time until the contact.

    And the promise: no refusal inside max_velocity * (t_fall - 0.13 s) + platform_radius. What
    commands take longer than on one machine counts in both.
    """
    fall = Fall(NS_PER_SECOND, x, y, resting_height(parameters) + above, 0.0)
    decision = decide_reachability(fall, NS_PER_SECOND + seconds(late), RobotMotion(
        robot_x, robot_y, uncertainty=reserve), parameters, excess)
    available = sqrt(2.0 * above / parameters.gravity_accel) - late
    distance = hypot(x - robot_x, y - robot_y)
    assert decision.available == pytest.approx(available, abs=1e-6)
    assert decision.distance == pytest.approx(distance)
    assert decision.contact == pytest.approx(NS_PER_SECOND + seconds(available + late), abs=1e3)
    assert decision.margin == decision.available - decision.needed
    farthest = distance + reserve
    way = farthest - parameters.platform_radius
    assert decision.needed == (0.0 if way <= 0.0 else COMMAND_LATENCY + excess + travel_time(
        farthest, parameters.platform_radius, parameters.max_velocity))
    assert decision.reachable == (decision.needed <= max(decision.available, 0.0))
    assert decision.reachable == (decision.reason == '')
    promised = (parameters.max_velocity * (available + late - 0.13 - excess)
                + parameters.platform_radius)
    assert guaranteed_distance(fall.z, parameters, excess) == pytest.approx(promised, abs=1e-6)
    # A fall is known by its third sample, 8 ms later.
    if way > 0.0 and farthest <= promised and late <= 0.01:
        assert decision.reachable


def test_brick_below_the_platform_or_outside_the_arena_is_out_of_reach():
    """However near, and however much time there is; at the very edge it is not."""
    for x, y, z, word in ((5.0, 5.0, REST_Z - 0.01, 'below'), (-0.01, 5.0, 9.0, 'outside'),
                          (5.0, ARENA_SIZE + 0.01, 9.0, 'outside')):
        decision = decide_reachability(Fall(NS_PER_SECOND, x, y, z, 0.0), NS_PER_SECOND, RobotMotion(x, y), PARAMETERS)
        assert not decision.reachable
        assert word in decision.reason
    for x, y, z in ((5.0, 5.0, REST_Z), (0.0, 5.0, 9.0), (5.0, ARENA_SIZE, 9.0)):
        late = NS_PER_SECOND + seconds(0.02)  # as where the brick is on the platform by now
        assert decide_reachability(Fall(NS_PER_SECOND, x, y, z, 0.0), late, RobotMotion(x, y), PARAMETERS).reachable
    passed = Fall(NS_PER_SECOND, 5.0, 5.0, REST_Z - 0.01, 3.0)
    assert 'passed' in decide_reachability(passed, NS_PER_SECOND, RobotMotion(5.0, 5.0), PARAMETERS).reason
    assert guaranteed_distance(REST_Z - 0.01, PARAMETERS) == -inf


def test_reason_says_what_is_missing():
    fall = Fall(NS_PER_SECOND, 9.0, 5.0, 2.0, 0.0)
    decision = decide_reachability(fall, NS_PER_SECOND, RobotMotion(5.0, 5.0), PARAMETERS)
    assert decision.reason == (
        f'the robot, 4.00 m away, needs {decision.needed:.3f} s, but the brick lands in '
        f'{decision.available:.3f} s, {-decision.margin:.3f} s too early (command latency 0.11 s)')
    decision = decide_reachability(fall, NS_PER_SECOND, None, PARAMETERS)
    assert (decision.reachable, decision.needed) == (False, inf)
    assert 'no robot' in decision.reason


@pytest.mark.parametrize('excess', (0.0, 0.2))
def test_tilted_platform_must_be_leveled_in_time(excess):
    def decide(time, level):
        fall = Fall(NS_PER_SECOND, 5.0, 5.0, REST_Z + 0.5 * GRAVITY * (time + excess) ** 2, 0.0)
        return decide_reachability(fall, NS_PER_SECOND, RobotMotion(5.0, 5.0, (), level), PARAMETERS, excess)

    assert decide(LEVEL_LATENCY - 0.001, True).reachable
    assert not decide(LEVEL_LATENCY - 0.001, False).reachable
    assert decide(LEVEL_LATENCY + 0.001, False).reachable


# ---------------------------------------------------------------------- where a robot is bound for

HINGE = PARAMETERS.platform_height - PARAMETERS.platform_thickness

on_any_link = pytest.mark.parametrize('excess', (0.0, 0.2))


def track_with(excess=0.0):
    """Return a track where orders take longer (s), how far they lead (m), and how long (s)."""
    latency = LatencyMonitor()
    latency.record_response_delay(NS_PER_SECOND, excess)
    return (RobotTracker(PARAMETERS.max_velocity, latency), PARAMETERS.max_velocity * (COMMITTED_TIME + excess),
            COMMAND_LATENCY + excess)


def seen_at(track, time, x, y=5.0, tilt=0.0, level_for=inf):
    """Return the robot that is seen at a place at a time (s)."""
    return track.observe(seconds(time), Platform(Pose((x, y, HINGE), from_pitch(tilt))),
                         level_for)


@on_any_link
def test_robot_that_is_seen_moving_goes_on_at_full_speed_until_it_has_stood_for_a_while(excess):
    track, way, _ = track_with(excess)
    seen_at(track, 1.0, 5.0)
    robot = seen_at(track, 1.01, 5.003, 5.004)
    assert robot.destinations == (pytest.approx((5.003 + 0.6 * way, 5.004 + 0.8 * way)),)
    assert not robot.at_rest and robot.uncertainty == 0.0
    assert seen_at(track, 1.075 + excess, 5.003, 5.004).destinations == robot.destinations
    assert seen_at(track, 1.09 + excess, 5.003, 5.004).at_rest
    assert seen_at(track, 1.1 + excess, 5.003 + 1e-10, 5.004).at_rest


@on_any_link
def test_robot_that_was_sent_somewhere_is_destinations_it(excess):
    """Also if it isn't seen to move yet, and meanwhile for where it was sent before."""
    track, way, latency = track_with(excess)
    seen_at(track, 1.0, 5.0)
    track.record_goal(seconds(1.5), (9.0, 5.0))
    assert seen_at(track, 1.5 + latency - 0.001, 5.0).destinations == ((5.0 + way, 5.0),)
    assert seen_at(track, 1.5 + latency + 0.001, 5.0).at_rest
    # On its way, it may pass its goal as far as it is seen to go, but is bound for it as well.
    track, way, latency = track_with(excess)
    track.record_goal(seconds(1.2), (9.0, 5.0))
    seen_at(track, 1.34, 8.87)
    robot = seen_at(track, 1.35, 8.9)
    assert robot.destinations == (pytest.approx((8.9 + way, 5.0)), pytest.approx((9.0, 5.0)))
    track.record_goal(seconds(1.4), (8.9, 1.0))
    before, after = seen_at(track, 1.4 + latency - 0.001, 8.9).destinations[-2:]
    assert before == pytest.approx((9.0, 5.0))
    assert after == pytest.approx((8.9, 5.0 - way))
    assert seen_at(track, 1.4 + latency + 0.3, 8.9).at_rest


@on_any_link
def test_robot_that_was_seen_for_too_short_a_time_may_be_going_anywhere(excess):
    track, way, _ = track_with(excess)
    for begin in (1.0, 2.0):
        assert seen_at(track, begin, 5.0).uncertainty == way
        assert seen_at(track, begin + 0.069 + excess, 5.0).uncertainty == way
        assert seen_at(track, begin + 0.071 + excess, 5.0).at_rest
        assert track.observe(seconds(begin + 0.3), None, inf) is None
        assert (track.last_seen, track.last_unseen) == (seconds(begin + 0.071 + excess),
                                              seconds(begin + 0.3))


@pytest.mark.parametrize(('still', 'moved', 'goal', 'longer'), [
    (COMMAND_LATENCY + 0.05, 0.2, 9.0, 0.2 - COMMAND_LATENCY),
    (COMMAND_LATENCY - 0.01, 0.2, 9.0, 0.0),
    (0.9, 1.5, 9.0, 1.5 - COMMAND_LATENCY),
    (1.1, 1.2, 9.0, 0.0),
    (0.2, 0.3, 5.01, 0.0)],
    ids=('late', 'seen late', 'very late', 'ignored', 'no reason to move'))
def test_robot_at_rest_tells_how_long_an_order_takes(still, moved, goal, longer):
    track, *_ = track_with()
    for time in (1.9, 2.0):
        seen_at(track, time, 5.0)
    track.record_goal(seconds(2.0), (goal, 5.0))
    seen_at(track, 2.0 + still, 5.0)
    seen_at(track, 2.0 + moved, 5.02)
    seen_at(track, 2.1 + moved, 5.3)
    assert track.excess == pytest.approx(longer)


@on_any_link
def test_platform_is_level_if_it_is_seen_so_and_all_others_see_it_so(excess):
    track, *_ = track_with(excess)
    assert seen_at(track, 1.0, 5.0).level
    assert not seen_at(track, 1.1, 5.0, level_for=LEVEL_LATENCY + excess - 1e-6).level
    assert seen_at(track, 1.2, 5.0, level_for=LEVEL_LATENCY + excess + 1e-6).level
    assert not seen_at(track, 1.3, 5.0, tilt=0.01).level
    assert track.last_level == seconds(1.2)
