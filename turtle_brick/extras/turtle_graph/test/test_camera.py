# SPDX-License-Identifier: Apache-2.0

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import numpy
import pytest
from turtle_graph.view.camera import (ARENA_VIEW, CORNERS, FIELD_OF_VIEW, FREE_FRACTION,
                                      ground_point, MARGIN, NARROW_ASPECT, NEAR_VIEW, TOP_VIEW)

COORDINATES = st.floats(-50.0, 50.0)
POINTS = st.lists(st.tuples(*[st.floats(-20.0, 20.0)] * 3), min_size=1, max_size=5)
VIEWS = st.sampled_from([ARENA_VIEW, NEAR_VIEW, TOP_VIEW])
ASPECTS = st.one_of(st.floats(0.3, NARROW_ASPECT), st.floats(NARROW_ASPECT, 3.0))


def are_visible(position, target, points, aspect):
    forward = numpy.subtract(target, position)
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right /= numpy.linalg.norm(right)
    up = numpy.cross(right, forward)
    bottom = 0.5 - FREE_FRACTION if aspect < NARROW_ASPECT else -0.5
    for ray in numpy.subtract(points, position):
        height = 2.0 * numpy.tan(FIELD_OF_VIEW / 2.0) * (ray @ forward)
        x, y, margin = ray @ right / height, ray @ up / height, MARGIN / height - 1e-6
        if not (height > 0.0 and abs(x) + margin <= aspect / 2.0
                and bottom + margin <= y <= 0.5 - margin):
            return False
    return True


def test_top_view_looks_down_on_the_center_of_the_arena():
    (x, y, z), target = TOP_VIEW.camera_pose(CORNERS, 1.0)
    assert (x, y) == pytest.approx((5.544, 5.544), abs=0.05) and z > 11.0
    assert target == pytest.approx((5.544, 5.544, 0.0), abs=0.05)


def test_camera_does_not_move_while_all_points_are_visible():
    robot, brick = (5.0, 5.0, 0.0), (7.0, 7.0, 8.0)
    position, _ = NEAR_VIEW.camera_pose([robot, brick], 1.5)
    for point in ((5.5, 5.0, 0.0), (6.5, 6.0, 0.0)):
        pose = NEAR_VIEW.camera_pose([robot, brick, point], 1.5, position)
        assert pose[0] == pytest.approx(position)


def test_ground_point_is_where_the_ray_meets_the_ground():
    assert ground_point((1.0, 2.0, 10.0), (1.0, 0.0, -2.0)) == (6.0, 2.0)


@law(40)
@given(VIEWS, POINTS, ASPECTS)
def test_camera_shows_all_points_from_the_nearest_position(view, points, aspect):
    position, target = view.camera_pose(points, aspect)
    assert are_visible(position, target, points, aspect)
    step = 0.01 * numpy.subtract(target, position)
    assert not are_visible(position + step, target + step, points, aspect)


@law(6)
@given(VIEWS, POINTS, POINTS, ASPECTS)
def test_camera_always_shows_all_points_and_comes_to_rest_near_them(view, before, points, aspect):
    position, _ = view.camera_pose(before, aspect)
    for step in range(600):
        last = position
        position, target = view.camera_pose(points, aspect, last)
        assert step % 50 or are_visible(position, target, points, aspect)
    assert position == pytest.approx(last, abs=1e-3)
    forward = numpy.subtract(target, position)
    nearest, _ = view.camera_pose(points, aspect)
    assert forward @ numpy.subtract(nearest, position) < 0.05 * forward @ forward


@law(30)
@given(st.tuples(COORDINATES, COORDINATES, st.floats(0.1, 50.0)), COORDINATES, COORDINATES)
def test_ground_point_is_exact_for_every_ray_from_above_and_below(origin, x, y):
    ray = (x - origin[0], y - origin[1], -origin[2])
    assert ground_point(origin, ray) == pytest.approx((x, y), abs=1e-9)
    assert ground_point(origin, (ray[0], ray[1], origin[2])) is None, 'upward'
    assert ground_point(origin, (ray[0], ray[1], 0.0)) is None, 'parallel to the ground'
    assert ground_point((origin[0], origin[1], -origin[2]), ray) is None, 'from below'
