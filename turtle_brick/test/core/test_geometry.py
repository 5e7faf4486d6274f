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

"""Examples of poses and distances. The laws in test_physics_laws.py cover all rotations."""

from math import pi

import pytest
from turtle_brick.core.geometry import distance_to_rectangle, from_yaw, Pose


def test_pose_transforms_points():
    left = Pose((1.0, 2.0, 3.0), from_yaw(pi / 2.0))
    assert left.transform((1.0, 0.0, 0.0)) == pytest.approx((1.0, 3.0, 3.0))
    assert left.compose(left).position == pytest.approx((-1.0, 3.0, 6.0))


def test_distance_to_rectangle():
    assert distance_to_rectangle(3.0, 0.0, 0.0, 2.0, 1.0) == pytest.approx(2.0)
    assert distance_to_rectangle(3.0, 0.0, pi / 2.0, 2.0, 1.0) == pytest.approx(2.5)
    assert distance_to_rectangle(0.5, 0.2, 0.0, 2.0, 1.0) == 0.0
