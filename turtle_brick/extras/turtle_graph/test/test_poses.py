# SPDX-License-Identifier: Apache-2.0
"""Test poses and rotations."""

from math import cos, pi, sin, sqrt

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rigid import axes_of, Frame
from turtle_graph.client.geometry import (from_rpy, IDENTITY, inclination, interpolate, normalize,
                                          Pose, turn, X, Y, Z)

ANGLES = st.floats(-10.0, 10.0)
VECTORS = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
POSES = st.builds(Pose, VECTORS, st.builds(from_rpy, ANGLES, ANGLES, ANGLES))


def test_a_pose_transforms_points_between_two_frames():
    tilted = Pose((1.0, 2.0, 3.0), turn(Y, pi / 6.0))
    assert tilted.transform(X) == pytest.approx((1.0 + sqrt(0.75), 2.0, 2.5))
    assert tilted.locate((1.0 + sqrt(0.75), 2.0, 2.5)) == pytest.approx(X)
    assert tilted.upright == pytest.approx((0.5, 0.0, sqrt(0.75)))
    assert inclination(tilted) == pytest.approx(pi / 6.0)


def test_a_quaternion_is_scaled_to_unit_length():
    assert normalize((0.0, 3.0, 0.0, 4.0)) == pytest.approx((0.0, 0.6, 0.0, 0.8))
    assert normalize((0.0, 0.0, 0.0, 0.0)) == IDENTITY, 'as in rviz2'


def test_an_interpolated_pose_has_the_shorter_way():
    start, end = Pose(X, turn(Z, 0.1)), Pose(Y, turn(Z, 0.3))
    opposite = Pose(Y, turn(Z, 0.3 + 2.0 * pi))  # The same rotation with the opposite sign.
    for other in (end, opposite):
        middle = interpolate(start, other, 0.5)
        assert middle.position == pytest.approx((0.5, 0.5, 0.0))
        assert middle.orientation == pytest.approx(turn(Z, 0.2))


@given(POSES, POSES, VECTORS)
def test_composed_poses_transform_one_after_the_other(outer, inner, point):
    frames = [Frame(pose.position, axes_of(pose.orientation)) for pose in (outer, inner)]
    expected = pytest.approx(frames[0].compose(frames[1]).transform(point), abs=1e-9)
    assert outer.compose(inner).transform(point) == expected
    assert outer.transform(inner.transform(point)) == expected


@given(ANGLES, ANGLES, ANGLES, VECTORS)
def test_from_rpy_rotates_about_the_fixed_axes_x_y_and_z(roll, pitch, yaw, point):
    x, y, z = point
    y, z = cos(roll) * y - sin(roll) * z, sin(roll) * y + cos(roll) * z
    x, z = cos(pitch) * x + sin(pitch) * z, -sin(pitch) * x + cos(pitch) * z
    x, y = cos(yaw) * x - sin(yaw) * y, sin(yaw) * x + cos(yaw) * y
    turned = Frame(axes=axes_of(from_rpy(roll, pitch, yaw))).transform(point)
    assert turned == pytest.approx((x, y, z), abs=1e-12)
