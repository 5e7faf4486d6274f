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

"""Test when the brick is falling, has landed and is still."""

from laws import GRAVITY, REST_Z, seconds
import pytest
from turtle_brick.core.brick_tracking import BrickTracker

PERIOD = 0.004


def make_tracker():
    return BrickTracker(GRAVITY, REST_Z)


def fall(tracker, start, height, end, x=5.0):
    """Let the brick fall from `height` to `end` (m), beginning at `start` (s). Return the time."""
    step = 0
    while (z := height - 0.5 * GRAVITY * (step * PERIOD) ** 2) > end:
        tracker.observe(seconds(start + step * PERIOD), (x, 5.0, z))
        step += 1
    return start + step * PERIOD


def rest(tracker, start, position, time=0.1, is_attached=False):
    """Keep the brick at a position (m) from `start` for a given time (s). Return the end."""
    for step in range(round(time / PERIOD) + 1):
        tracker.observe(seconds(start + step * PERIOD), position, is_attached)
    return start + time


def test_brick_falls_lands_and_rests():
    tracker = make_tracker()
    assert not (tracker.fall or tracker.is_falling_to_platform or tracker.has_landed)
    now = fall(tracker, rest(tracker, 1.0, (5.0, 5.0, 4.0)), 4.0, REST_Z)
    assert tracker.fall is not None and tracker.is_falling_to_platform
    assert not tracker.has_landed and tracker.still_for == 0.0
    rest(tracker, now, (5.0, 5.0, REST_Z), 0.5)
    assert tracker.fall is None and tracker.has_landed
    assert tracker.still_for == pytest.approx(0.5, abs=2 * PERIOD)


def test_brick_that_passes_the_platform_has_not_landed():
    tracker = make_tracker()
    now = fall(tracker, 1.0, 4.0, 0.06)
    assert tracker.fall is not None and not tracker.is_falling_to_platform
    rest(tracker, now, (5.0, 5.0, 0.06))
    assert tracker.fall is None and not tracker.has_landed


@pytest.mark.parametrize('x', (5.0, 7.0))
def test_brick_placed_at_its_resting_height_has_not_landed(x):
    """The fall ends before the brick can have reached the platform."""
    tracker = make_tracker()
    rest(tracker, fall(tracker, 1.0, 6.0, 5.0), (x, 5.0, REST_Z))
    assert tracker.fall is None and not tracker.has_landed


def test_attached_brick_has_landed_until_it_is_detached_or_tilted():
    tracker = make_tracker()
    now = rest(tracker, 1.0, (5.0, 5.0, REST_Z), is_attached=True)
    assert tracker.has_landed
    now = rest(tracker, now, (5.0, 5.0, REST_Z - 0.02), is_attached=True)
    assert not tracker.has_landed
    now = rest(tracker, now, (5.0, 5.0, REST_Z), is_attached=True)
    rest(tracker, now, (5.0, 5.0, REST_Z))
    assert not tracker.has_landed


def test_carried_brick_has_landed_and_moves():
    tracker = make_tracker()
    now = rest(tracker, fall(tracker, 1.0, 4.0, REST_Z), (5.0, 5.0, REST_Z))
    rest(tracker, now, (5.5, 5.0, REST_Z), 0.1)
    assert tracker.has_landed and tracker.still_for == pytest.approx(0.1)


def test_rounding_errors_are_not_motion_but_a_clock_set_back_is():
    tracker = make_tracker()
    for step in range(10):
        tracker.observe(seconds(1.0 + 0.1 * step), (5.0, 5.0, 4.0 + step % 2 * 1e-10))
    assert tracker.still_for == pytest.approx(0.9)
    tracker.observe(seconds(1.5), (5.0, 5.0, 4.0))
    assert tracker.still_for == 0.0
