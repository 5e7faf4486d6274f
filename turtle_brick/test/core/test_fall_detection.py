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

"""Falls: told from everything else that a brick may do, with their course."""

from collections import deque
from math import cos, isnan, pi, sin, sqrt

from hypothesis import assume, given
from hypothesis import strategies as st
from laws import GRAVITY, law, NS_PER_SECOND, seconds
import pytest
from turtle_brick.core.fall_detection import Fall, FallDetector
from turtle_brick.physics import STEP_NS

gravities = st.floats(0.5, 30.0)
heights = st.floats(0.5, 30.0)
coordinates = st.floats(-10.0, 20.0)
signs = st.sampled_from((1.0, -1.0))

# The times between samples (ns): at 50 Hz or faster, however irregularly.
intervals = st.one_of(
    st.just([STEP_NS]), st.just([20_000_000]),
    st.lists(st.integers(1_000_000, 20_000_000), min_size=1, max_size=10))


class Watch:
    """A detector that is shown a brick at intervals that repeat."""

    def __init__(self, spacing=(STEP_NS,), gravity=GRAVITY):
        self.detector = FallDetector(gravity)
        self.spacing = deque(spacing)
        self.now = 10 * NS_PER_SECOND
        self.recognized = 0

    def see(self, x, y, z):
        """Show a position at the present instant, then go on to the next; tell if it's a fall."""
        seen = self.detector.observe(self.now, x, y, z)
        assert not self.detector.observe(self.now, x, y, z), 'what comes twice counts once'
        self.recognized += seen
        self.now += self.spacing[0]
        self.spacing.rotate(-1)
        return seen

    def hover(self, x, y, z, samples):
        """Show a brick that stays."""
        for _ in range(samples):
            self.see(x, y, z)

    def fall(self, x, y, z, release, samples):
        """Show a brick that was released at an instant (ns); return the recognized fall."""
        for _ in range(samples):
            time = max(self.now - release, 0) * 1e-9
            if self.see(x, y, z - 0.5 * self.detector.gravity * time * time):
                return self.detector.fall
        return None


@law(40)
@given(x=coordinates, y=coordinates, height=heights, gravity=gravities, spacing=intervals,
       hovering=st.integers(0, 5), part=st.floats(0.0, 1.0))
def test_fall_is_known_by_its_third_sample_with_its_course(
        x, y, height, gravity, spacing, hovering, part):
    """Whenever it is released, also up to 2 s before it is seen, and however it is sampled."""
    watch = Watch(spacing, gravity)
    watch.hover(x, y, height, hovering)
    release = watch.now - round(part * (watch.spacing[-1] if hovering else 2 * NS_PER_SECOND))
    # The first of these may be the release itself; three more are in the fall.
    fall = watch.fall(x, y, height, release, 4)
    assert fall.stamp <= watch.now
    assert fall.speed == pytest.approx(gravity * (fall.stamp - release) * 1e-9, abs=1e-3)
    for drop in (0.3, 0.5, 5.0, 25.0):
        contact = release + sqrt(2.0 * drop / gravity) * 1e9
        if contact > fall.stamp:
            estimate = fall.stamp + fall.time_to(height - drop, gravity) * 1e9
            assert abs(estimate - contact) <= 1e6
    assert fall.position[:2] == (x, y)
    # It is one fall, down to the end.
    watch.fall(x, y, height, release, 100)
    assert watch.recognized == 1


@law(30)
@given(spacing=intervals, gravity=gravities, places=st.lists(
    st.tuples(st.integers(2, 4), st.booleans(), st.one_of(
        st.floats(-1e-2, 1e-2), st.floats(-10.0, 10.0), st.floats(-1e-6, 1e-6))),
    max_size=20))
def test_being_placed_is_no_fall(spacing, gravity, places):
    """Lower, higher or sideways, by any amount, in any succession."""
    watch = Watch(spacing, gravity)
    x, z = 5.0, 20.0
    for samples, sideways, amount in places:
        x, z = (x + amount, z) if sideways else (x, z + amount)
        watch.hover(x, 5.0, z, samples)
    assert watch.recognized == 0


slides = st.builds(lambda tilt: (tilt, 0.0, sin(tilt)), st.floats(0.1, 1.5) | st.floats(1.2, 1.5))
other_falls = st.tuples(st.just(pi / 2.0), st.floats(0.1, 10.0),
                        st.floats(0.0, 0.88) | st.floats(1.12, 3.0))


@law(40)
@given(motion=slides | other_falls, spacing=intervals)
def test_slides_and_other_accelerations_are_no_fall(motion, spacing):
    """The steeper the slope, the more it is like one: 1.5 rad is the steepest tilt_angle."""
    slope, speed, factor = motion
    watch = Watch(spacing)
    start = watch.now
    for _ in range(60):
        time = (watch.now - start) * 1e-9
        path = speed * time + 0.5 * factor * GRAVITY * time * time
        watch.see(5.0 + path * cos(slope), 5.0, 50.0 - path * sin(slope))
    assert watch.recognized == 0


@law(40)
@given(spacing=intervals, samples=st.integers(0, 20), sign=signs, amount=st.floats(0.02, 10.0),
       what=st.sampled_from(('placed above or below', 'placed aside', 'lies', 'time set back')))
def test_fall_that_is_interrupted_has_ended(spacing, samples, sign, amount, what):
    """Where the brick is dropped again, that is a fall of its own."""
    watch = Watch(spacing)
    release = watch.now
    assert watch.fall(5.0, 5.0, 20.0, release, 4)
    watch.fall(5.0, 5.0, 20.0, release, samples)
    time = (watch.now - release) * 1e-9
    x, z = 5.0, 20.0 - 0.5 * GRAVITY * time * time
    if what == 'placed above or below':
        z += sign * amount
    elif what == 'placed aside':
        x += sign * amount
    elif what == 'time set back':
        watch.now -= seconds(amount)
    watch.hover(x, 5.0, z, 1)
    assert what == 'lies' or watch.detector.fall is None
    landed = watch.now
    while watch.now - landed < 100_000_000:
        watch.hover(x, 5.0, z, 1)
    assert (watch.detector.fall, watch.recognized) == (None, 1)
    again = watch.fall(x, 5.0, z, watch.now, 4)
    assert (again.x, watch.recognized) == (x, 2)


@law(20)
@given(z=heights, speed=st.floats(0.0, 20.0), gravity=gravities, time=st.floats(0.01, 3.0))
def test_course_of_a_fall_is_the_closed_form(z, speed, gravity, time):
    fall = Fall(NS_PER_SECOND, 1.0, 2.0, z, speed)
    height = fall.height(NS_PER_SECOND + seconds(time), gravity)
    assert height == pytest.approx(z - speed * time - 0.5 * gravity * time ** 2, abs=1e-6)
    assert fall.time_to(height, gravity) == pytest.approx(time, abs=1e-6)
    # It was released where its speed was zero, and has been at every height below since.
    released = z + speed ** 2 / (2.0 * gravity)
    assert isnan(fall.time_to(released + 1e-6, gravity))
    assume(released > z + 1e-6)
    assert fall.time_to(released - 1e-6, gravity) == pytest.approx(
        (sqrt(2.0 * gravity * 1e-6) - speed) / gravity, abs=1e-4)
