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

"""Test BrickTracker and FallDetector with examples."""

from math import isnan

from defaults import GRAVITY, NS_PER_SECOND, REST_Z, seconds
import pytest
from turtle_brick.core.brick_tracking import BrickTracker, Fall, FallDetector

PERIOD = 0.004


def test_fall_is_detected_at_its_third_position():
    detector = FallDetector(gravity=10.0)
    detector.observe(0, (5.0, 5.0, 9.0))
    detector.observe(100_000_000, (5.0, 5.0, 8.95))
    assert detector.fall is None
    detector.observe(200_000_000, (5.0, 5.0, 8.8))
    assert detector.fall.position == (5.0, 5.0, 8.8)
    assert detector.fall.speed == pytest.approx(2.0)


def test_height_of_a_falling_brick_and_time_to_a_height():
    fall = Fall(0, (5.0, 5.0, 9.0), speed=1.0)
    assert fall.height(2 * NS_PER_SECOND, gravity=2.0) == pytest.approx(3.0)
    assert fall.time_to(3.0, gravity=2.0) == pytest.approx(2.0)
    assert isnan(fall.time_to(10.0, gravity=2.0))
    assert fall.release_time(gravity=2.0) == -NS_PER_SECOND // 2


@pytest.fixture
def tracker():
    return BrickTracker(GRAVITY, REST_Z)


def drop(tracker, start, height, end):
    """Simulate a fall from `height` to `end` (m), starting at `start` (s). Return the end time."""
    step = 0
    while (z := height - 0.5 * GRAVITY * (step * PERIOD) ** 2) > end:
        tracker.observe(seconds(start + step * PERIOD), (5.0, 5.0, z))
        step += 1
    return start + step * PERIOD


def rest(tracker, start, position, time=0.1, is_attached=False):
    """Keep the brick at a position (m) for `time` (s) after `start` (s). Return the end time."""
    for step in range(round(time / PERIOD) + 1):
        tracker.observe(seconds(start + step * PERIOD), position, is_attached)
    return start + time


def test_brick_falls_lands_rests_and_is_carried(tracker):
    assert not (tracker.fall or tracker.is_falling_to_platform or tracker.has_landed)
    now = drop(tracker, rest(tracker, 1.0, (5.0, 5.0, 4.0)), 4.0, REST_Z)
    assert tracker.fall is not None and tracker.is_falling_to_platform
    assert not tracker.has_landed and tracker.still_for == 0.0
    now = rest(tracker, now, (5.0, 5.0, REST_Z), 0.5)
    assert tracker.fall is None and tracker.has_landed
    assert tracker.still_for == pytest.approx(0.5, abs=2 * PERIOD)
    rest(tracker, now, (5.5, 5.0, REST_Z), 0.1)
    assert tracker.has_landed and tracker.still_for == pytest.approx(0.1, abs=2 * PERIOD)


def test_brick_that_passes_the_platform_has_not_landed(tracker):
    now = drop(tracker, 1.0, 4.0, 0.06)
    assert tracker.fall is not None and not tracker.is_falling_to_platform
    rest(tracker, now, (5.0, 5.0, 0.06))
    assert tracker.fall is None and not tracker.has_landed


@pytest.mark.parametrize('x', (5.0, 7.0))
def test_brick_placed_at_its_resting_height_has_not_landed(tracker, x):
    rest(tracker, drop(tracker, 1.0, 6.0, 5.0), (x, 5.0, REST_Z))
    assert tracker.fall is None and not tracker.has_landed


def test_attached_brick_has_landed_until_it_is_detached(tracker):
    """While the platform is tilted, the brick is not at its resting height."""
    now = 1.0
    for height in (REST_Z, REST_Z - 0.02, REST_Z):
        now = rest(tracker, now, (5.0, 5.0, height), is_attached=True)
        assert tracker.has_landed
    rest(tracker, now, (5.0, 5.0, REST_Z))
    assert not tracker.has_landed


def test_rounding_errors_are_not_motion_and_old_positions_are_ignored(tracker):
    for step in range(10):
        tracker.observe(seconds(1.0 + 0.1 * step), (5.0, 5.0, 4.0 + step % 2 * 1e-10))
        tracker.observe(seconds(1.0 + 0.1 * step), (5.0, 5.0, 2.0))
        tracker.observe(seconds(0.5 + 0.1 * step), (5.0, 5.0, 2.0))
    assert tracker.still_for == pytest.approx(0.9)
    assert tracker.position == pytest.approx((5.0, 5.0, 4.0))
