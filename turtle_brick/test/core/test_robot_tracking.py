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

"""Test the robot state derived from TF and from the catcher's own commands."""

from math import cos, radians, sin

from defaults import PARAMETERS, seconds
import pytest
from turtle_brick.core.geometry import from_pitch, Pose
from turtle_brick.core.robot_tracking import REST_TIME, RobotTracker
from turtle_brick.core.tilting_platform import Platform

LATENCY = PARAMETERS.command_latency
HINGE = PARAMETERS.platform_height - PARAMETERS.platform_thickness


def observe(tracker, time, x=5.0, tilt=0.0):
    tracker.observe(seconds(time), Platform(Pose((x, 5.0, HINGE), from_pitch(tilt))))
    return tracker.state


def resting_tracker():
    tracker = RobotTracker(LATENCY)
    for time in (1.0, 2.0):
        observe(tracker, time)
    assert (tracker.state.is_at_rest, tracker.state.is_level) == (True, True)
    return tracker


@pytest.mark.parametrize(('after', 'x', 'goal', 'is_at_rest'), [
    (0.01, 5.0, None, True),
    (0.01, 5.0 + 1e-10, None, True),
    (0.01, 5.001, None, False),
    (0.01, 5.0, (9.0, 5.0), False),
    (LATENCY - 0.01, 5.0, (9.0, 5.0), False),
    (LATENCY + 0.01, 5.0, (9.0, 5.0), True),
    (LATENCY + 0.01, 5.3, (9.0, 5.0), False)],
    ids=('unchanged', 'rounding error', 'moved', 'new goal', 'goal before the latency',
         'goal without effect', 'goal with effect'))
def test_robot_is_at_rest_without_motion_and_recent_goals(after, x, goal, is_at_rest):
    tracker = resting_tracker()
    if goal:
        tracker.record_goal(seconds(2.0), goal)
    assert observe(tracker, 2.0 + after, x).is_at_rest is is_at_rest


def test_robot_comes_to_rest_after_its_last_motion():
    tracker = resting_tracker()
    observe(tracker, 2.01, 5.01)
    assert not observe(tracker, 2.009 + REST_TIME, 5.01).is_at_rest
    assert observe(tracker, 2.011 + REST_TIME, 5.01).is_at_rest


@pytest.mark.parametrize(('positions', 'is_off_course'), [
    ((4.9, 4.9), True), ((5.01, 4.99), True), ((5.01, 5.03), False), ((5.0, 5.0), True),
    ((8.97, 8.99), False), ((9.03, 8.99), False), ((8.99, 9.0, 9.03), True),
    ((8.99, 8.99 - 1e-10), False)],
    ids=('away', 'back', 'toward', 'at rest', 'arriving', 'overshooting', 'leaving', 'arrived'))
def test_robot_is_off_course_unless_it_drives_to_its_goal_or_is_there(positions, is_off_course):
    tracker = resting_tracker()
    tracker.record_goal(seconds(2.0), (9.0, 5.0))
    assert not observe(tracker, 1.99 + LATENCY, 4.0).is_off_course
    for number, x in enumerate(positions):
        observe(tracker, 2.01 + LATENCY + 0.08 * number, x)
    assert tracker.state.is_off_course is is_off_course


@pytest.mark.parametrize(('degrees', 'is_off_course'), [(17, False), (20, True), (90, True)])
def test_robot_that_drives_in_another_direction_is_off_course(degrees, is_off_course):
    tracker = resting_tracker()
    tracker.record_goal(seconds(2.0), (5.0, 9.0))
    x = 5.0 + 0.001 * sin(radians(degrees))
    platform = Platform(Pose((x, 5.0 + 0.001 * cos(radians(degrees)), HINGE), from_pitch(0.0)))
    tracker.observe(seconds(2.01 + LATENCY), platform)
    assert tracker.state.is_off_course is is_off_course


def test_new_robot_is_not_at_rest_before_its_second_position():
    tracker = resting_tracker()
    tracker.observe(seconds(2.1), None)
    assert tracker.state is None
    assert not observe(tracker, 3.0).is_at_rest
    assert not observe(tracker, 2.999 + REST_TIME).is_at_rest
    assert observe(tracker, 3.001 + REST_TIME).is_at_rest


def test_platform_is_level_without_an_inclination_and_recent_tilt_commands():
    tracker = resting_tracker()
    assert not observe(tracker, 2.01, tilt=0.01).is_level
    tracker.record_tilt(seconds(2.02), 0.0)
    assert observe(tracker, 2.03).is_level
    tracker.record_tilt(seconds(2.04), 0.5)
    tracker.record_tilt(seconds(2.05), 0.0)
    assert not observe(tracker, 2.04 + LATENCY - 0.001).is_level
    assert observe(tracker, 2.04 + LATENCY + 0.001).is_level


@pytest.mark.parametrize(('still', 'moved', 'goal', 'measured'), [
    (0.19, 0.2, 9.0, 0.2), (LATENCY - 0.001, 0.2, 9.0, 0.0), (LATENCY + 0.001, 0.12, 9.0, 0.12),
    (0.19, 0.2, 5.01, 0.0)],
    ids=('late', 'observed late', 'barely late', 'near goal'))
def test_response_time_of_a_late_robot_is_measured(still, moved, goal, measured):
    """A robot is late if it is still at rest LATENCY seconds after a goal is published."""
    tracker = resting_tracker()
    tracker.record_goal(seconds(2.0), (goal, 5.0))
    observe(tracker, 2.0 + still)
    tracker.record_goal(seconds(2.0 + still), (goal, 5.0))  # The catcher repeats the goal.
    observe(tracker, 2.0 + moved, 5.02)
    observe(tracker, 2.5, 5.5)
    assert tracker.response.late_time == pytest.approx(measured)


def test_goals_of_a_moving_unavailable_or_stopped_robot_are_not_measured():
    for end in ('lost', 'stopped', 'moving'):
        tracker = resting_tracker()
        if end == 'lost':
            tracker.record_goal(seconds(2.0), (9.0, 5.0))
            tracker.observe(seconds(2.3), None)
        elif end == 'stopped':
            tracker.record_goal(seconds(2.0), (9.0, 5.0))
            tracker.record_goal(seconds(2.02), (5.0, 5.0))
        else:
            observe(tracker, 2.01, 5.01)
            tracker.record_goal(seconds(2.02), (9.0, 5.0))
        observe(tracker, 2.4, 5.02)
        observe(tracker, 2.6, 5.04)
        assert tracker.response.late_time == 0.0
