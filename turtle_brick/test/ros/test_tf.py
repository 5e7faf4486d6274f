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

"""Test transform lookups, the rejection of harmful transforms, and time functions."""

from math import inf, nan
from types import SimpleNamespace
from unittest.mock import Mock

from builtin_interfaces.msg import Time as TimeMessage
import pytest
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.core.geometry import MAX_COORDINATE, Pose
from turtle_brick.ros.tf import (BUFFER_DURATION_NS, due_time, GuardedListener, latest_world_to,
                                 MAX_AGE_NS, MAX_AHEAD_NS, nanoseconds_of, recent_world_to,
                                 transform_message)

NOW = 1_000_000_000_000
LEVEL = (0.0, 0.0, 0.0, 1.0)


def transform(parent, child, age=0, position=(1.0, 2.0, 3.0), orientation=LEVEL):
    return transform_message(
        parent, child, Pose(position, orientation), Time(nanoseconds=NOW - age).to_msg())


def stamped(sec, nanosec):
    message = transform('world', 'brick')
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    return message


def listener(*on_transform):
    node = Mock()
    node.get_clock().now().nanoseconds = NOW
    return GuardedListener(Buffer(), node, *on_transform), node.get_logger()


@pytest.mark.parametrize('bad, static, words', [
    (transform('world', 'brick', position=(nan, 0.0, 0.0)), False, '(nan, 0, 0)'),
    (transform('world', 'brick', position=(0.0, -inf, 0.0)), True, '(0, -inf, 0)'),
    (transform('world', 'brick', position=(0.0, 0.0, 1.01 * MAX_COORDINATE)), False,
     '(0, 0, 1.01e+'),
    (transform('world', 'brick', orientation=(0.0, 0.0, 0.0, 0.0)), False, '(0, 0, 0, 0)'),
    (transform('world', 'brick', orientation=(nan, 0.0, 0.0, 1.0)), True, '(nan, 0, 0, 1)'),
    (stamped(-1, 0), True, '-1 s 0 ns'),
    (stamped(1, 1_000_000_000), False, '1 s 1000000000 ns'),
    (transform('world', 'brick', age=-MAX_AHEAD_NS - 1), False, 's ahead'),
    (transform('world', 'brick', age=BUFFER_DURATION_NS + 1), False, 's old'),
    (transform('elsewhere', '/world'), True, 'must not have a parent'),
], ids=lambda value: value if isinstance(value, str) else '')
def test_harmful_transform_is_ignored_with_a_warning(bad, static, words):
    guarded, logger = listener()
    for _ in range(10):
        assert guarded.store(TFMessage(transforms=[bad]), static, NOW) == []
    assert logger.warning.call_count == 1
    (sentence,), _ = logger.warning.call_args
    assert f'"{bad.header.frame_id}" to "{bad.child_frame_id}"' in sentence
    assert words in sentence and len(sentence) < 250


@pytest.mark.parametrize('static', [True, False])
def test_frame_stays_static_or_moving(static):
    guarded, logger = listener()
    first, second = transform('world', 'odom'), transform('map', '/odom', position=(9.0, 9.0, 9.0))
    assert guarded.store(TFMessage(transforms=[first]), static, NOW) == [first]
    assert guarded.store(TFMessage(transforms=[second]), not static, NOW) == []
    assert latest_world_to(guarded.buffer, 'odom').transform == first.transform
    (sentence,), _ = logger.warning.call_args
    words = 'a static frame into a moving one' if static else 'a moving frame into a static one'
    assert words in sentence


@pytest.mark.parametrize('age, known', [(MAX_AGE_NS, True), (MAX_AGE_NS + 1, False),
                                        (-MAX_AHEAD_NS, True), (-MAX_AHEAD_NS - 1, False)])
def test_recent_world_to_expires_and_is_deleted_when_the_clock_is_set_back(age, known):
    guarded, _ = listener()
    assert recent_world_to(guarded.buffer, 'brick', NOW) is None
    guarded.store(TFMessage(transforms=[transform('world', 'brick')]), False, NOW)
    assert (recent_world_to(guarded.buffer, 'brick', NOW + age) is not None) is known
    guarded.store(TFMessage(), False, NOW - 1)
    assert latest_world_to(guarded.buffer, 'brick') is None


def test_callback_gets_each_transform_after_its_message_is_stored():
    received = []
    guarded, _ = listener(lambda message, now: received.append((
        message.transform.translation.x,
        latest_world_to(guarded.buffer, 'brick').transform.translation.x)))
    guarded.static_callback(TFMessage(transforms=[transform('brick', 'label')]))
    for burst in (0, 3):
        guarded.callback(TFMessage(transforms=[
            transform('world', 'brick', -number, (float(number), 0.0, 0.0))
            for number in range(burst, burst + 3)]))
    assert received == [(0, 2), (1, 2), (2, 2), (3, 5), (4, 5), (5, 5)]
    assert latest_world_to(guarded.buffer, 'label') is not None


@pytest.mark.parametrize('until, due', [(30, 930), (100, 1000), (130, 1000), (-250, 650)])
def test_due_time_is_one_period_before_the_next_call(until, due):
    """The due time of a timer's current callback is never in the future."""
    timer = SimpleNamespace(timer_period_ns=100, time_until_next_call=lambda: until)
    assert due_time(timer, 1000) == due


def test_nanoseconds_of_a_timestamp():
    assert nanoseconds_of(TimeMessage(sec=2, nanosec=3)) == 2_000_000_003
