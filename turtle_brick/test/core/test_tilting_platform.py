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


"""The platform: what follows from its pose."""

from math import cos, pi, sin

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.geometry import multiply, Pose
from turtle_brick.core.tilting_platform import LEVEL_TOLERANCE, Platform
from worlds import axes_of, gap, HINGE, platform_at

angles = st.floats(-2.0 * pi, 2.0 * pi)
lengths = st.floats(-20.0, 20.0)


@law(20)
@given(x=lengths, y=lengths, yaw=angles, tilt=angles, u=lengths, v=lengths, w=lengths)
def test_axes_hinge_and_points_are_those_of_the_pose(x, y, yaw, tilt, u, v, w):
    platform = platform_at(x, y, yaw, tilt)
    for axis, expected in zip(platform.axes, axes_of(yaw, tilt)):
        assert gap(axis, expected) <= 1e-12
    assert (cos(platform.hinge_yaw), sin(platform.hinge_yaw)) == pytest.approx(
        (cos(yaw), sin(yaw)))
    point = platform.point(u, v, w)
    assert gap(point, platform.pose.transform((u, v, w))) <= 1e-12
    assert gap(platform.place_of(point), (u, v)) <= 1e-12
    assert platform.point(0.0, 0.0, 0.0) == (x, y, HINGE)
    # Also of one that leans in every direction.
    lean = multiply(platform.pose.orientation, (0.6, 0.0, 0.0, 0.8))
    leaning = Platform(Pose((x, y, 0.0), lean))
    assert gap(leaning.place_of(leaning.point(u, v, w)), (u, v)) <= 1e-12


@law(15)
@given(yaw=angles, tilt=st.floats(-0.999, 0.999) | st.sampled_from((-0.999, 0.999)))
def test_it_is_level_within_the_tolerance(yaw, tilt):
    assert platform_at(yaw=yaw, tilt=tilt * LEVEL_TOLERANCE).is_level
    for over in (pi, 0.01, 1.001 * LEVEL_TOLERANCE):
        assert not platform_at(yaw=yaw, tilt=over).is_level
