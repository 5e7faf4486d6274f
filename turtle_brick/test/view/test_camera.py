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
from perspective import seen_from
import pytest
from turtle_brick.view.camera import ABOVE, FAR, FREE, ground_under, NEAR, ROOM, UPRIGHT

COORDINATES = st.floats(-50.0, 50.0)
POINTS = st.lists(st.tuples(*[st.floats(-20.0, 20.0)] * 3), min_size=1, max_size=5)
VIEWS = st.sampled_from([NEAR, ABOVE])
ASPECTS = st.floats(0.3, 3.0)


def sees(camera, points, aspect, room=ROOM):
    """Tell whether points (m), with some room (m), are in the free part of the picture."""
    forward = numpy.subtract(camera.look_at, camera.position)
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right *= room / numpy.linalg.norm(right)
    up = numpy.cross(right, forward) / numpy.linalg.norm(forward)
    least = 0.5 - FREE if aspect < UPRIGHT else -0.5
    seen = [seen_from(*camera, point + side)
            for point in numpy.array(points) for side in (right, -right, up, -up)]
    return all(abs(across) <= aspect / 2.0 + 1e-6 and least - 1e-6 <= above <= 0.5 + 1e-6
               for across, above in seen)


@law(40)
@given(VIEWS, POINTS, ASPECTS)
def test_it_is_as_near_as_it_can_be_and_sees_all(view, points, aspect):
    camera = view.camera(points, aspect)
    assert camera.field_of_view == view.field_of_view
    assert sees(camera, points, aspect)
    forward = numpy.subtract(camera.look_at, camera.position)
    forward /= numpy.linalg.norm(forward)
    nearer = camera._replace(position=camera.position + 0.01 * forward,
                             look_at=camera.look_at + 0.01 * forward)
    assert not sees(nearer, points, aspect)


@law(6)
@given(VIEWS, POINTS, POINTS, ASPECTS)
def test_it_sees_all_at_any_time_and_comes_to_rest_near(view, before, points, aspect):
    camera = view.camera(before, aspect)
    for _ in range(3):
        last, camera = camera, view.camera(points, aspect, camera.position)
        assert sees(camera, points, aspect)
    for _ in range(600):
        last, camera = camera, view.camera(points, aspect, camera.position)
    assert camera.position == pytest.approx(last.position, abs=1e-3)
    forward, nearest = numpy.subtract(camera.look_at, camera.position), view.camera(points, aspect)
    assert forward @ numpy.subtract(nearest.position, camera.position) < 0.05 * forward @ forward


def test_it_stays_where_it_is_while_all_that_moves_is_in_the_picture():
    robot, brick = (5.0, 5.0, 0.0), (7.0, 7.0, 8.0)
    camera = NEAR.camera([robot, brick], 1.5)
    for place in ((5.5, 5.0, 0.0), (6.5, 6.0, 0.0)):
        assert NEAR.camera([robot, brick, place], 1.5, camera.position).position == (
            pytest.approx(camera.position))


@law(30)
@given(st.tuples(COORDINATES, COORDINATES, st.floats(0.1, 50.0)), COORDINATES, COORDINATES)
def test_a_click_is_on_the_ground_that_it_points_at(eye, x, y):
    ray = (x - eye[0], y - eye[1], -eye[2])
    assert ground_under(eye, ray) == pytest.approx((x, y), abs=1e-9)
    assert ground_under(eye, (ray[0], ray[1], eye[2])) is None
    assert ground_under((eye[0], eye[1], -eye[2]), ray) is None
    horizon = 1.0 / FAR
    assert ground_under((0.0, 0.0, 1.0), (0.999, 0.0, -horizon)) == pytest.approx((199.8, 0.0))
    for ray in ((1.001, 0.0, -horizon), (0.0, -1.001, -horizon)):
        assert ground_under((0.0, 0.0, 1.0), ray) is None
