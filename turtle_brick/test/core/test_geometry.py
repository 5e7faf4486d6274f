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

"""Test rotations and poses with examples."""

from math import cos, pi

import pytest
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose, Pose2D, rotate


def near(values):
    return pytest.approx(tuple(values), abs=1e-9)


def test_yaw_turns_left_and_pitch_lowers_the_front():
    left = Pose((1.0, 2.0, 3.0), from_yaw(pi / 2.0))
    assert left.transform((1.0, 0.0, 0.0)) == near((1.0, 3.0, 3.0))
    assert rotate(from_pitch(pi / 6.0), (1.0, 0.0, 0.0)) == near((cos(pi / 6.0), 0.0, -0.5))


def test_products_apply_the_right_factor_first():
    p, q, v = from_yaw(2.0), from_pitch(-0.7), (3.0, -4.0, 5.0)
    assert rotate(multiply(p, q), v) == near(rotate(p, rotate(q, v)))
    assert rotate(multiply(q, p), v) == near(rotate(q, rotate(p, v)))


def test_pose_2d_composes_like_pose_and_has_an_inverse():
    a, b = Pose2D(1.0, -2.0, 4.0), Pose2D(-3.0, 0.5, -1.0)
    x, y, _ = rotate(from_yaw(a.yaw), (b.x, b.y, 0.0))
    assert a.compose(b) == near((a.x + x, a.y + y, a.yaw + b.yaw))
    assert a.compose(a.inverse()) == near((0.0, 0.0, 0.0))
