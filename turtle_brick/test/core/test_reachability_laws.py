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
"""Test the reachability of random bricks with random robots."""

from dataclasses import replace
from math import hypot, sqrt

from defaults import NS_PER_SECOND, PARAMETERS, seconds
from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.brick_tracking import Fall
from turtle_brick.core.reachability import decide_reachability, resting_height
from turtle_brick.core.robot_tracking import RobotState
from turtle_brick.core.turtlesim_arena import ARENA_SIZE


inside = st.floats(0.0, ARENA_SIZE)
other_parameters = st.builds(
    lambda speed, gravity, height, radius, latency: replace(
        PARAMETERS, max_velocity=speed, gravity_accel=gravity, platform_height=height,
        platform_radius=radius, command_latency=latency),
    st.floats(0.1, 10.0), st.floats(0.5, 30.0), st.floats(1.5, 5.0), st.floats(0.05, 2.0),
    st.floats(0.0, 0.5))


@law(60)
@given(parameters=other_parameters, x=inside, y=inside, robot_x=inside, robot_y=inside,
       above=st.floats(0.0, 20.0), late=st.floats(0.0, 0.05), is_at_rest=st.booleans())
def test_brick_is_reachable_if_the_needed_time_is_available(
        parameters, x, y, robot_x, robot_y, above, late, is_at_rest):
    fall = Fall(NS_PER_SECOND, (x, y, resting_height(parameters) + above), 0.0)
    robot = RobotState(robot_x, robot_y, is_at_rest)
    decision = decide_reachability(fall, NS_PER_SECOND + seconds(late), robot, parameters)
    available = sqrt(2.0 * above / parameters.gravity_accel) - late
    distance = hypot(x - robot_x, y - robot_y)
    assert decision.available == pytest.approx(available, abs=1e-6)
    assert decision.distance == pytest.approx(distance)
    assert decision.reachable == (decision.needed <= decision.available)
    assert decision.reachable == (decision.reason == '')
