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

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import numpy
import pytest
from turtle_brick.view.camera import (ABOVE, FIELD_OF_VIEW, FREE, ground_under, NEAR, ROOM,
                                      UPRIGHT)

COORDINATES = st.floats(-50.0, 50.0)
POINTS = st.lists(st.tuples(*[st.floats(-20.0, 20.0)] * 3), min_size=1, max_size=5)
VIEWS = st.sampled_from([NEAR, ABOVE])
ASPECTS = st.one_of(st.floats(0.3, UPRIGHT), st.floats(UPRIGHT, 3.0))


def sees(position, target, points, aspect):
    """Tell whether points (m), with ROOM around them, are in the free part of the picture."""
    forward = numpy.subtract(target, position)
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right /= numpy.linalg.norm(right)
    up = numpy.cross(right, forward)
    least = 0.5 - FREE if aspect < UPRIGHT else -0.5
    for ray in numpy.subtract(points, position):
        height = 2.0 * numpy.tan(FIELD_OF_VIEW / 2.0) * (ray @ forward)
        across, above, room = ray @ right / height, ray @ up / height, ROOM / height - 1e-6
        if not (height > 0.0 and abs(across) + room <= aspect / 2.0
                and least + room <= above <= 0.5 - room):
            return False
    return True


@law(40)
@given(VIEWS, POINTS, ASPECTS)
def test_it_is_as_near_as_it_can_be_and_sees_all(view, points, aspect):
    position, target = view.camera(points, aspect)
    assert sees(position, target, points, aspect)
    step = 0.01 * numpy.subtract(target, position)
    assert not sees(position + step, target + step, points, aspect)


@law(6)
@given(VIEWS, POINTS, POINTS, ASPECTS)
def test_it_sees_all_at_any_time_and_comes_to_rest_near(view, before, points, aspect):
    position, _ = view.camera(before, aspect)
    for step in range(600):
        last = position
        position, target = view.camera(points, aspect, last)
        assert step % 50 or sees(position, target, points, aspect)
    assert position == pytest.approx(last, abs=1e-3)
    forward = numpy.subtract(target, position)
    nearest, _ = view.camera(points, aspect)
    assert forward @ numpy.subtract(nearest, position) < 0.05 * forward @ forward


def test_it_stays_where_it_is_while_all_that_moves_is_in_the_picture():
    robot, brick = (5.0, 5.0, 0.0), (7.0, 7.0, 8.0)
    position, _ = NEAR.camera([robot, brick], 1.5)
    for place in ((5.5, 5.0, 0.0), (6.5, 6.0, 0.0)):
        assert NEAR.camera([robot, brick, place], 1.5, position)[0] == pytest.approx(position)


@law(30)
@given(st.tuples(COORDINATES, COORDINATES, st.floats(0.1, 50.0)), COORDINATES, COORDINATES)
def test_a_click_is_on_the_ground_that_it_points_at(eye, x, y):
    ray = (x - eye[0], y - eye[1], -eye[2])
    assert ground_under(eye, ray) == pytest.approx((x, y), abs=1e-9)
    assert ground_under(eye, (ray[0], ray[1], eye[2])) is None
    assert ground_under((eye[0], eye[1], -eye[2]), ray) is None
    assert ground_under(eye, (1.0, 0.0, 0.0)) is None, 'along the horizon'
