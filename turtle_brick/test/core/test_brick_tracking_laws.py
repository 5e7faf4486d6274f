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
"""Test FallDetector with random motions."""

from collections import deque
from math import cos, pi, sin, sqrt

from defaults import GRAVITY, NS_PER_SECOND
from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.brick_tracking import FallDetector
from turtle_brick.physics import STEP_NS


class DetectorBench:

    def __init__(self, intervals=(STEP_NS,), gravity=GRAVITY):
        self.detector = FallDetector(gravity)
        self.intervals = deque(intervals)
        self.now = 10 * NS_PER_SECOND
        self.fall_count = 0

    def observe(self, x, y, z):
        before = self.detector.fall
        self.detector.observe(self.now, (x, y, z))
        fall = self.detector.fall
        is_fall = fall is not None and fall is not before
        self.fall_count += is_fall
        self.now += self.intervals[0]
        self.intervals.rotate(-1)
        return is_fall

    def hover(self, x, y, z, samples):
        for _ in range(samples):
            self.observe(x, y, z)

    def fall(self, x, y, z, release, samples):
        """Drop a brick at the time `release` (ns), and return the detected fall or None."""
        for _ in range(samples):
            time = max(self.now - release, 0) * 1e-9
            if self.observe(x, y, z - 0.5 * self.detector.gravity * time * time):
                return self.detector.fall
        return None


gravities = st.floats(0.5, 30.0)
heights = st.floats(0.5, 30.0)
coordinates = st.floats(-10.0, 20.0)
signs = st.sampled_from((0.0, 1.0, -1.0))

# Regular or irregular intervals (ns) between position samples, each at most 20 ms.
intervals = st.one_of(
    st.just([STEP_NS]), st.just([20_000_000]),
    st.lists(st.integers(1_000_000, 20_000_000), min_size=1, max_size=10))


@law(40)
@given(x=coordinates, y=coordinates, height=heights, gravity=gravities, spacing=intervals,
       hovering=st.integers(0, 5), part=st.floats(0.0, 1.0))
def test_fall_is_detected_by_its_third_sample_with_its_course(
        x, y, height, gravity, spacing, hovering, part):
    """The brick may be released up to 2 s before its first position sample."""
    bench = DetectorBench(spacing, gravity)
    bench.hover(x, y, height, hovering)
    release = bench.now - round(
        part * (bench.intervals[-1] if hovering else 2 * NS_PER_SECOND))
    # At least three of the four samples follow the release of the brick.
    fall = bench.fall(x, y, height, release, 4)
    assert fall.speed == pytest.approx(gravity * (fall.stamp - release) * 1e-9, abs=1e-3)
    for drop in (0.3, 0.5, 5.0, 25.0):
        contact = release + sqrt(2.0 * drop / gravity) * 1e9
        if contact > fall.stamp:
            estimate = fall.stamp + fall.time_to(height - drop, gravity) * 1e9
            assert abs(estimate - contact) <= 1e6
    assert fall.position[:2] == (x, y)
    bench.fall(x, y, height, release, 100)
    assert bench.fall_count == 1


@law(30)
@given(spacing=intervals, gravity=gravities, places=st.lists(
    st.tuples(st.integers(2, 4), st.booleans(), st.one_of(
        st.floats(-1e-2, 1e-2), st.floats(-10.0, 10.0), st.floats(-1e-6, 1e-6))),
    max_size=20))
def test_placing_a_brick_is_not_a_fall(spacing, gravity, places):
    bench = DetectorBench(spacing, gravity)
    x, z = 5.0, 20.0
    for samples, sideways, amount in places:
        x, z = (x + amount, z) if sideways else (x, z + amount)
        bench.hover(x, 5.0, z, samples)
    assert bench.fall_count == 0


slides = st.builds(lambda tilt: (tilt, 0.0, sin(tilt)), st.floats(0.1, 1.5) | st.floats(1.2, 1.5))
other_falls = st.tuples(st.just(pi / 2.0), st.floats(0.1, 10.0),
                        st.floats(0.0, 0.88) | st.floats(1.12, 3.0))


@law(40)
@given(motion=slides | other_falls, spacing=intervals)
def test_slides_and_other_accelerations_are_not_falls(motion, spacing):
    """At the maximum tilt_angle (1.5 rad), a brick slides almost as fast as it would fall."""
    slope, speed, factor = motion
    bench = DetectorBench(spacing)
    start = bench.now
    for _ in range(60):
        time = (bench.now - start) * 1e-9
        path = speed * time + 0.5 * factor * GRAVITY * time * time
        bench.observe(5.0 + path * cos(slope), 5.0, 50.0 - path * sin(slope))
    assert bench.fall_count == 0


@law(40)
@given(spacing=intervals, samples=st.integers(0, 20), sideways=signs, upward=signs,
       amount=st.floats(0.02, 10.0))
def test_interrupted_fall_ends_and_the_next_fall_is_detected(
        spacing, samples, sideways, upward, amount):
    """A fall ends if the brick stops or is placed elsewhere."""
    bench = DetectorBench(spacing)
    release = bench.now
    assert bench.fall(5.0, 5.0, 20.0, release, 4)
    bench.fall(5.0, 5.0, 20.0, release, samples)
    time = (bench.now - release) * 1e-9
    x, z = 5.0 + sideways * amount, 20.0 - 0.5 * GRAVITY * time * time + upward * amount
    bench.hover(x, 5.0, z, 1)
    has_stopped = sideways == upward == 0.0
    assert has_stopped or bench.detector.fall is None
    landed = bench.now
    while bench.now - landed < 100_000_000:
        bench.hover(x, 5.0, z, 1)
    assert (bench.detector.fall, bench.fall_count) == (None, 1)
    again = bench.fall(x, 5.0, z, bench.now, 4)
    assert (again.position[0], bench.fall_count) == (x, 2)
