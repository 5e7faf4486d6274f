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

"""Test the reachability of falling bricks with examples."""

from dataclasses import replace
from math import e, inf

from defaults import GRAVITY, NS_PER_SECOND, PARAMETERS, REST_Z, seconds
import pytest
from turtle_brick.core.brick_tracking import Fall
from turtle_brick.core.driving import braking_loss, BRAKING_TIME
from turtle_brick.core.reachability import decide_reachability, time_needed
from turtle_brick.core.robot_tracking import RobotState
from turtle_brick.core.turtlesim_arena import ARENA_SIZE, nearest_in_arena

LATENCY = PARAMETERS.command_latency
RADIUS = PARAMETERS.platform_radius


def decide(x, y, z, robot=RobotState(5.0, 5.0), speed=0.0, delay=0.0):
    """Return the decision made `delay` seconds after the falling brick was observed at x, y, z."""
    fall = Fall(NS_PER_SECOND, (x, y, z), speed)
    return decide_reachability(fall, NS_PER_SECOND + seconds(delay), robot, PARAMETERS)


def test_brick_is_reachable_if_the_robot_has_enough_time():
    assert decide(6.0, 5.0, 9.0).reachable
    assert not decide(10.0, 5.0, 3.0).reachable


def test_time_needed_by_a_robot():
    """A moving robot needs more time because it may first drive away from the goal."""
    point = (8.0, 5.0)
    drive = 2.5 / 3.0  # The robot drives 3 m minus the platform radius of 0.5 m, at 3 m/s.
    assert time_needed(point, RobotState(5.0, 5.0), PARAMETERS) == pytest.approx(LATENCY + drive)
    assert time_needed(point, RobotState(5.0, 5.0, is_at_rest=False), PARAMETERS) == (
        pytest.approx(2 * LATENCY + drive))
    assert time_needed(point, RobotState(7.6, 5.0), PARAMETERS) == 0.0
    assert time_needed(point, RobotState(7.6, 5.0, is_level=False), PARAMETERS) == LATENCY
    assert time_needed(point, RobotState(8.0, 5.0, is_at_rest=False), PARAMETERS) == LATENCY


@pytest.mark.parametrize(('x', 'y', 'z', 'speed', 'reason'), [
    (5.0, 5.0, REST_Z, 0.0, ''), (5.0, 5.0, REST_Z - 0.01, 0.0, 'below its resting height'),
    (5.0, 5.0, REST_Z - 0.01, 3.0, 'below its resting height'),
    (0.0, 5.0, 9.0, 0.0, ''), (-RADIUS + 0.01, 5.0, 9.0, 0.0, ''),
    (-RADIUS - 0.01, 5.0, 9.0, 0.0, 'point (-0.51, 5) is outside the arena'),
    (5.0, ARENA_SIZE + RADIUS - 0.01, 9.0, 0.0, ''),
    (5.0, ARENA_SIZE + RADIUS + 0.01, 9.0, 0.0, 'outside the arena')])
def test_brick_below_the_platform_or_outside_its_reach_is_unreachable(x, y, z, speed, reason):
    decision = decide(x, y, z, RobotState(*nearest_in_arena(x, y)), speed=speed)
    assert decision.reachable == (reason == '') and reason in decision.reason


def test_robot_drives_to_the_point_in_the_arena_that_is_nearest_to_the_brick():
    """The platform, beside the wall, must come closer to a brick outside the arena."""
    drive = (5.0 - (RADIUS - 0.3)) / 3.0
    needed = time_needed((-0.3, 5.0), RobotState(5.0, 5.0), PARAMETERS)
    assert needed == pytest.approx(LATENCY + drive, abs=1e-3)
    assert time_needed((-0.3, 5.0), RobotState(0.0, 5.0), PARAMETERS) == 0.0
    assert time_needed((-0.3, -0.4), RobotState(0.01, 0.01), PARAMETERS) == inf


def test_fall_that_is_detected_after_the_landing_is_unreachable():
    """The robot is already under the brick."""
    height = REST_Z + 0.5 * GRAVITY
    assert decide(5.0, 5.0, height, delay=0.999).reachable
    decision = decide(5.0, 5.0, height, delay=1.268)
    assert not decision.reachable
    assert '0.268 s after the brick reached the top of the platform' in decision.reason


def test_reason_gives_distance_and_times():
    decision = decide(9.0, 5.0, 2.0)
    assert decision.reason == (
        f'the robot, 4.00 m away, needs {decision.needed:.3f} s, but the brick lands in '
        f'{decision.available:.3f} s, {decision.needed - decision.available:.3f} s too early')
    assert decision.summary == f'unreachable: {decision.reason}'
    assert decide(6.0, 5.0, 9.0).summary.startswith('reachable: the robot, 1.00 m away, needs ')
    decision = decide(9.0, 5.0, 2.0, robot=None)
    assert (decision.reachable, decision.needed) == (False, inf)
    assert 'no robot' in decision.reason


def test_braking_loss_is_the_time_that_the_exponential_approach_adds():
    """The distance from a braking robot to its goal decays with the time constant BRAKING_TIME."""
    radius = BRAKING_TIME * 3.0 / e
    assert braking_loss(e * radius, 3.0) == 0.0
    assert braking_loss(radius, 3.0) == pytest.approx(BRAKING_TIME / e)
    parameters = replace(PARAMETERS, platform_radius=radius, max_velocity=3.0)
    needed = time_needed((radius + 3.0, 5.0), RobotState(0.0, 5.0), parameters)
    assert needed == pytest.approx(LATENCY + 1.0 + BRAKING_TIME / e)
