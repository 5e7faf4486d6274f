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

"""What the nodes share about TF: no transform, whoever sent it, does a buffer lasting harm."""

from math import inf, nan

from geometry_msgs.msg import TransformStamped
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.core.geometry import FARTHEST, Pose
from turtle_brick.ros.tf import (AHEAD, ECHO, Guard, GuardedListener, latest, PAST, pose_of,
                                 STEADY, transform_message)
from turtle_brick.tools.graph import Graph
from witness import Witness

NOW = 1_000_000_000_000
LEVEL = (0.0, 0.0, 0.0, 1.0)


def transform(parent, child, age=0, position=(1.0, 2.0, 3.0), orientation=LEVEL):
    """Return a transform that is so old (ns)."""
    return transform_message(
        parent, child, Pose(position, orientation), Time(nanoseconds=NOW - age).to_msg())


def stamped(sec, nanosec):
    """Return a transform with a stamp."""
    message = transform('world', 'brick')
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    return message


@pytest.fixture
def guard():
    """Return a guard that knows the frames of the robot and of the brick."""
    guard = Guard()
    for parent, child, static in (
            ('world', 'odom', True), ('odom', 'base_link', False), ('base_link', 'post', True),
            ('post', 'platform', False), ('world', 'brick', False)):
        for earlier in range(1 if static else STEADY):
            assert guard.admit(transform(parent, child), static, NOW - earlier) == ''
    return guard


@pytest.mark.parametrize('bad, static, words', [
    (transform('world', 'brick', position=(nan, 0.0, 0.0)), False, '(nan, 0, 0)'),
    (transform('world', 'brick', position=(0.0, -inf, 0.0)), False, '(0, -inf, 0)'),
    (transform('world', 'brick', position=(0.0, 0.0, 1e308)), False, '(0, 0, 1e+308)'),
    (transform('world', 'brick', orientation=(0.0, 0.0, 0.0, 0.0)), False, '(0, 0, 0, 0)'),
    (transform('world', 'brick', orientation=(0.0, 0.0, 0.0, 1e200)), False, '1e+200'),
    (transform('world', 'brick', orientation=(nan, 0.0, 0.0, 1.0)), True, '(nan, 0, 0, 1)'),
    (stamped(-1, 0), False, '-1 s 0 ns'),
    (stamped(-2 ** 31, 2 ** 32 - 1), True, '-2147483648 s'),
    (stamped(1, 1_000_000_000), False, '1 s 1000000000 ns'),
    (transform('world', 'brick', age=-AHEAD - 1), False, 's ahead'),
    (transform('world', 'brick', age=-3600 * 10 ** 9), False, '3600 s ahead'),
    (transform('world', 'brick', age=PAST + 1), False, 's old'),
    (transform('', 'brick'), False, 'names no frame'),
    (transform('world', ''), False, 'names no frame'),
    (transform('brick', 'brick'), False, 'close a loop'),
    (transform('platform', 'odom'), True, 'close a loop'),
    (transform('brick', 'world'), False, 'the root of all frames'),
    (transform('elsewhere', 'world'), True, 'the root of all frames'),
    (transform('nowhere', 'odom'), True, 'tear "odom" off'),
    (transform('nowhere', 'brick'), False, 'tear "brick" off'),
    (transform('world', 'odom'), False, '/tf_static'),
    (transform('odom', 'base_link'), True, 'came on /tf_static'),
], ids=lambda value: value if isinstance(value, str) else '')
def test_bad_transform_is_refused_by_name_and_value(guard, bad, static, words):
    """And what is known stays as it was."""
    refusal = guard.admit(bad, static, NOW)
    assert words in refusal
    assert f'"{bad.header.frame_id}" to "{bad.child_frame_id}"' in refusal
    assert len(refusal) < 250
    for parent, child, static in (
            ('world', 'odom', True), ('odom', 'base_link', False), ('world', 'brick', False)):
        assert guard.admit(transform(parent, child), static, NOW) == ''


@pytest.mark.parametrize('good, static', [
    (transform('world', 'brick', age=-AHEAD), False),
    (transform('world', 'brick', age=PAST), False),
    (transform('/world', '/brick'), False),
    (transform('platform', 'brick'), False),
    (transform('nowhere', 'elsewhere'), False),
    (transform('world', 'odom', age=10 * PAST), True),
    (transform('world', 'brick', position=(FARTHEST, 0.0, 0.0)), False),
])
def test_transform_that_does_no_harm_is_taken(guard, good, static):
    assert guard.admit(good, static, NOW) == ''


names = st.sampled_from(('world', 'odom', 'base_link', 'post', 'platform', 'brick', 'map', ''))
numbers = st.one_of(st.floats(), st.sampled_from((0.0, 1.0, 1e9, 1e308)))
anything = st.builds(
    transform, names, names, st.integers(-2 * AHEAD, 2 * PAST), st.tuples(*[numbers] * 3),
    st.one_of(st.just(LEVEL), st.tuples(*[numbers] * 4)))


@settings(max_examples=300, derandomize=True, deadline=None)
@given(messages=st.lists(st.tuples(anything, st.booleans()), max_size=30))
def test_frames_in_sight_come_back_in_sight(messages):
    """Whatever else has been taken: once everybody has spoken again, all is where it was said."""
    bench = Listening()
    for parent, child, static in CHAIN:
        for earlier in range(1 if static else STEADY):
            assert bench.take(transform(parent, child, AHEAD), static, NOW - earlier)
    for message, static in messages:
        bench.take(message, static)
    for parent, child, static in CHAIN:
        assert bench.take(transform(parent, child, -AHEAD), static), (parent, child)
    # Not even what was ahead of its time stays in the way.
    assert bench.brick() == pytest.approx((5.0, 10.0, 15.0))


@settings(max_examples=300, derandomize=True, deadline=None)
@given(messages=st.lists(st.tuples(anything, st.booleans()), max_size=30))
def test_frames_come_in_sight_after_any_first_comers(messages):
    """
    What strangers have said first of a frame that moves does not stay, nor what they said on /tf.

    Of two that say on /tf_static where the same frame stands, nobody knows who is right.
    """
    bench = Listening()
    for message, static in messages:
        if not static or message.child_frame_id not in ('odom', 'base_link', 'post'):
            bench.take(message, static)
    for parent, child, static in CHAIN:
        if static:
            assert bench.take(transform(parent, child), static), (parent, child)
    for later in range(2 * STEADY):
        for parent, child, static in CHAIN:
            if not static:
                bench.take(transform(parent, child, -AHEAD), static, NOW + later)
    assert bench.brick() == pytest.approx((5.0, 10.0, 15.0))


CHAIN = (('world', 'odom', True), ('odom', 'base_link', False), ('base_link', 'post', True),
         ('post', 'platform', False), ('platform', 'brick', False))


class Listening:
    """A guard before a buffer."""

    def __init__(self):
        """Know nothing."""
        self.guard, self.buffer = Guard(), Buffer()

    def take(self, message, static, now=NOW):
        """Have a transform be heard; return whether it was taken."""
        if self.guard.admit(message, static, now):
            return False
        keep = self.buffer.set_transform_static if static else self.buffer.set_transform
        keep(message, 'somebody')
        return True

    def brick(self):
        """Return where the brick is in the world (m)."""
        return pose_of(latest(self.buffer, 'brick').transform).position


def test_one_message_makes_no_frame_move(guard):
    """However often it names the frame: what is broadcast comes in many messages."""
    for _ in range(2 * STEADY):
        assert guard.admit(transform('world', 'odom'), False, NOW)
    assert guard.admit(transform('world', 'odom'), True, NOW) == ''


@pytest.mark.parametrize('back', [0.6, 3.0, 4.999, 5.0, 60.0])
def test_nothing_outlasts_a_clock_that_is_set_back(guard, back):
    """What is on its way then has the time before, and would be the latest for as long."""
    back = round(back * 1e9)
    tick = 4_000_000
    assert guard.admit(transform('world', 'brick'), False, NOW) == ''
    assert 'ahead' in guard.admit(transform('world', 'brick', -tick), False, NOW - back)
    assert guard.admit(transform('world', 'brick', back), False, NOW - back) == ''
    assert guard.admit(transform('world', 'brick', back - tick), False, NOW - back) == ''
    late = NOW - back + ECHO
    assert 'ahead' not in guard.admit(
        transform('world', 'brick', NOW - late - AHEAD), False, late)


class Ears:
    """A node that listens, in a graph."""

    def __init__(self, graph):
        """Listen."""
        self.node = graph.add(Witness, parameters=False)
        self.buffer = Buffer(node=self.node)
        self.listener = GuardedListener(self.buffer, self.node)

    def now(self):
        """Return the node's time (ns)."""
        return self.node.get_clock().now().nanoseconds


def test_thousand_bad_transforms_are_told_in_one_line(domain_id, capfd):
    with Graph(domain_id) as graph:
        ears = Ears(graph)
        ears.listener.callback(TFMessage(transforms=[stamped(-1, 0)] * 1000))
        ears.listener.static_callback(TFMessage(transforms=[TransformStamped()] * 1000))
        lines = capfd.readouterr().err.splitlines()
    assert len(lines) == 1 and 'Left out: the transform from "world" to "brick"' in lines[0]


def test_buffer_forgets_the_future_when_the_clock_is_set_back(domain_id, monkeypatch):
    """Also where the clock is the system's, and by less than tf2 itself would notice."""
    with Graph(domain_id) as graph:
        ears = Ears(graph)
        clock = type('Clock', (), {'now': lambda self: type('Now', (), {'nanoseconds': NOW})})()
        monkeypatch.setattr(ears.node, 'get_clock', lambda: clock)
        for age, x in ((0, 1.0), (500_000_000, 2.0)):
            monkeypatch.setattr(
                clock, 'now', lambda: type('Now', (), {'nanoseconds': NOW - age}), raising=False)
            ears.listener.callback(TFMessage(
                transforms=[transform('world', 'brick', age, (x, 0.0, 0.0))]))
        assert latest(ears.buffer, 'brick').transform.translation.x == 2.0
