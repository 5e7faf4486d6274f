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
"""Vectors, rotations and poses against what defines them."""

from math import cos, hypot, inf, pi, sin, sqrt

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.geometry import (axes, distance_to_rectangle, from_pitch, from_yaw,
                                        multiply, Pose, Pose2D, rotate)

angles = st.floats(-2.0 * pi, 2.0 * pi)
lengths = st.floats(-20.0, 20.0)
vectors = st.tuples(lengths, lengths, lengths)


@st.composite
def quaternions(draw):
    """Any rotation, as a unit quaternion."""
    parts = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(
        lambda q: sum(part * part for part in q) > 1e-3))
    norm = sqrt(sum(part * part for part in parts))
    return tuple(part / norm for part in parts)


@st.composite
def poses(draw):
    """Any pose in the plane."""
    return Pose2D(draw(lengths), draw(lengths), draw(angles))


def near(values, tolerance=1e-9):
    """Compare tuples of numbers."""
    return pytest.approx(tuple(values), abs=tolerance)


@law(30)
@given(q=quaternions(), v=vectors)
def test_rotation_is_conjugation(q, v):
    """The vector part of q v q* is the definition of the rotation by a unit quaternion."""
    x, y, z, w = q
    *vector, scalar = multiply(multiply(q, (*v, 0.0)), (-x, -y, -z, w))
    assert rotate(q, v) == near(vector)
    assert scalar == pytest.approx(0.0, abs=1e-9)


@law(30)
@given(p=quaternions(), q=quaternions(), v=vectors)
def test_product_turns_by_the_right_factor_first(p, q, v):
    assert rotate(multiply(p, q), v) == near(rotate(p, rotate(q, v)))


@law(30)
@given(q=quaternions())
def test_axes_are_an_orthonormal_right_handed_frame(q):
    ex, ey, ez = axes(q)
    for a, b, product in ((ex, ex, 1.0), (ey, ey, 1.0), (ez, ez, 1.0),
                          (ex, ey, 0.0), (ey, ez, 0.0), (ez, ex, 0.0)):
        assert sum(i * j for i, j in zip(a, b)) == pytest.approx(product, abs=1e-12)
    assert ez == near((ex[1] * ey[2] - ex[2] * ey[1],
                       ex[2] * ey[0] - ex[0] * ey[2],
                       ex[0] * ey[1] - ex[1] * ey[0]))
    for axis, unit in zip((ex, ey, ez), ((1, 0, 0), (0, 1, 0), (0, 0, 1))):
        assert axis == near(rotate(q, unit))


@law(30)
@given(angle=angles)
def test_yaw_turns_left_and_pitch_lowers_the_front(angle):
    assert rotate(from_yaw(angle), (1.0, 0.0, 0.0)) == near((cos(angle), sin(angle), 0.0))
    assert rotate(from_yaw(angle), (0.0, 0.0, 1.0)) == near((0.0, 0.0, 1.0))
    assert rotate(from_pitch(angle), (1.0, 0.0, 0.0)) == near((cos(angle), 0.0, -sin(angle)))
    assert rotate(from_pitch(angle), (0.0, 1.0, 0.0)) == near((0.0, 1.0, 0.0))


@law(30)
@given(a=poses(), b=poses(), c=poses())
def test_poses_in_the_plane_form_a_group(a, b, c):
    assert a.compose(Pose2D(0.0, 0.0, 0.0)) == near(a)
    assert a.compose(a.inverse()) == near((0.0, 0.0, 0.0))
    assert a.inverse().compose(a) == near((0.0, 0.0, 0.0))
    assert a.compose(b).compose(c) == near(a.compose(b.compose(c)))


@law(30)
@given(a=poses(), b=poses())
def test_poses_in_the_plane_compose_as_in_space(a, b):
    x, y, z = rotate(from_yaw(a.yaw), (b.x, b.y, 0.0))
    assert a.compose(b) == near((a.x + x, a.y + y, a.yaw + b.yaw))
    assert z == 0.0


@law(30)
@given(p=quaternions(), q=quaternions(), a=vectors, b=vectors, v=vectors)
def test_a_composed_pose_takes_a_point_through_both(p, q, a, b, v):
    outer, inner = Pose(a, p), Pose(b, q)
    assert outer.compose(inner).transform(v) == near(outer.transform(inner.transform(v)))


@law(60)
@given(x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0), yaw=angles,
       length=st.floats(0.01, 2.0), width=st.floats(0.01, 2.0))
def test_distance_to_a_rectangle_is_that_to_its_nearest_side(x, y, yaw, length, width):
    corners = [(x + cos(yaw) * a - sin(yaw) * b, y + sin(yaw) * a + cos(yaw) * b)
               for a, b in ((length / 2, width / 2), (-length / 2, width / 2),
                            (-length / 2, -width / 2), (length / 2, -width / 2))]
    nearest, covered = inf, True
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1]):
        dx, dy = bx - ax, by - ay
        part = min(max(-(ax * dx + ay * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        nearest = min(nearest, hypot(ax + part * dx, ay + part * dy))
        # Counter-clockwise, the inside is to the left of every side.
        covered = covered and ax * by - ay * bx > 0.0
    expected = 0.0 if covered else nearest
    assert distance_to_rectangle(x, y, yaw, length, width) == pytest.approx(expected, abs=1e-9)
