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

from hypothesis import given
from hypothesis import strategies as st
from laws import law
from live_graph import graph, PATIENCE
import pytest
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.core.geometry import FARTHEST, Pose
from turtle_brick.ros.tf import (AHEAD, GuardedListener, harm_of, Intake, latest, OLDEST, PAST,
                                 pose_of, recent, transform_message)

NOW = 1_000_000_000_000
LEVEL = (0.0, 0.0, 0.0, 1.0)
CHAIN = (('world', 'odom', True), ('odom', 'base_link', False), ('base_link', 'post', True),
         ('post', 'platform', False), ('platform', 'brick', False))


def transform(parent, child, age=0, position=(1.0, 2.0, 3.0), orientation=LEVEL):
    """Return a transform that is so old (ns)."""
    return transform_message(
        parent, child, Pose(position, orientation), Time(nanoseconds=NOW - age).to_msg())


def stamped(sec, nanosec):
    """Return a transform with a stamp."""
    message = transform('world', 'brick')
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    return message


@pytest.mark.parametrize('bad, static, words', [
    (transform('world', 'brick', position=(nan, 0.0, 0.0)), False, '(nan, 0, 0)'),
    (transform('world', 'brick', position=(0.0, -inf, 0.0)), True, '(0, -inf, 0)'),
    (transform('world', 'brick', position=(0.0, 0.0, 1.01 * FARTHEST)), False, '(0, 0, 1.01e+'),
    (transform('world', 'brick', orientation=(0.0, 0.0, 0.0, 0.0)), False, '(0, 0, 0, 0)'),
    (transform('world', 'brick', orientation=(0.0, 0.0, 0.0, 1e200)), False, '1e+200'),
    (transform('world', 'brick', orientation=(nan, 0.0, 0.0, 1.0)), True, '(nan, 0, 0, 1)'),
    (stamped(-1, 0), True, '-1 s 0 ns'),
    (stamped(1, 1_000_000_000), False, '1 s 1000000000 ns'),
    (transform('world', 'brick', age=-AHEAD - 1), False, 's ahead'),
    (transform('world', 'brick', age=PAST + 1), False, 's old'),
    (transform('brick', 'world'), False, 'the root of all frames'),
    (transform('elsewhere', '/world'), True, 'the root of all frames'),
], ids=lambda value: value if isinstance(value, str) else '')
def test_harm_is_named_and_said_of_which_frames(bad, static, words):
    assert words in harm_of(bad, static, NOW)
    said = []
    Intake(Buffer(), lambda *words: said.append(words)).take_in(
        TFMessage(transforms=[bad]), static, NOW)
    ((topic, sentence),) = said
    assert topic == ('/tf_static' if static else '/tf')
    assert f'"{bad.header.frame_id}" to "{bad.child_frame_id}" ' in sentence
    assert words in sentence and len(sentence) < 250


frames = st.sampled_from(('world', 'base_link', 'platform', 'brick', 'map', ''))
numbers = st.one_of(st.floats(), st.sampled_from((0.0, 1.0, 1e9, 1e308)))
anything = st.builds(
    transform, frames, frames, st.integers(-2 * AHEAD, 2 * PAST), st.tuples(*[numbers] * 3),
    st.one_of(st.just(LEVEL), st.tuples(*[numbers] * 4)))


@law(30)
@given(st.lists(st.tuples(anything, st.booleans()), max_size=15), st.booleans())
def test_all_is_in_sight_again_once_everybody_has_spoken_again(messages, known):
    """
    Whatever strangers have said first or since of the frames that move, on either topic.

    Of the frames that are said on /tf_static once, tf2 believes the last one for good.
    """
    buffer = Buffer()
    intake = Intake(buffer, lambda *_: None)

    def speak(age):
        for parent, child, static in CHAIN:
            # What is said once is as old as who said it.
            message = TFMessage(transforms=[
                transform(parent, child, 10 * PAST if static else age)])
            assert intake.take_in(message, static, NOW), (parent, child)

    if known:
        speak(AHEAD)
    for message, static in messages:
        intake.take_in(TFMessage(transforms=[message]), static, NOW)
    # Not even what was ahead of its time stays in the way.
    speak(-AHEAD)
    assert pose_of(latest(buffer, 'brick').transform).position == pytest.approx((5.0, 10.0, 15.0))


def test_a_clock_set_back_empties_the_buffer():
    """Else what was stamped before would stay the latest, and hide what comes."""
    buffer = Buffer()
    intake = Intake(buffer, lambda *_: None)
    intake.take_in(TFMessage(transforms=[transform('world', 'brick')]), False, NOW)
    intake.take_in(TFMessage(), False, NOW)
    assert latest(buffer, 'brick') is not None
    intake.take_in(TFMessage(), False, NOW - 1)
    assert latest(buffer, 'brick') is None


@pytest.mark.parametrize('age, known', [(OLDEST, True), (OLDEST + 1, False),
                                        (-AHEAD, True), (-AHEAD - 1, False)])
def test_where_a_moving_frame_is_counts_for_a_while(age, known):
    buffer = Buffer()
    assert recent(buffer, 'brick', NOW) is None
    buffer.set_transform(transform('world', 'brick'), 'somebody')
    assert recent(buffer, 'brick', NOW + age) == (Pose((1.0, 2.0, 3.0), LEVEL) if known else None)


def test_a_listener_hears_all_in_order_and_complains_a_few_times(domain_id, capfd):
    """Each transform of a burst is heard when its message is in the buffer."""
    buffer, heard = Buffer(), []
    with graph(domain_id) as live:
        node = live.add(Node, node_name='hearer', parameters=False)
        GuardedListener(buffer, node, lambda message, _: heard.append(
            (message.transform.translation.x, latest(buffer, 'brick').transform.translation.x)))
        now = node.get_clock().now().nanoseconds
        publisher = live.publisher('/tf', TFMessage, QoSProfile(depth=100))
        for burst in range(10):
            publisher.publish(TFMessage(transforms=[
                *[transform('world', 'brick', NOW - now - 10 * burst - step,
                            (10.0 * burst + step, 0.0, 0.0)) for step in range(10)],
                transform('world', 'brick', position=(nan, 0.0, 0.0))]))
        live.wait_for(lambda: len(heard) == 100, PATIENCE, '100 transforms')
    assert heard == [(number, 10 * (number // 10) + 9) for number in range(100)]
    assert capfd.readouterr().err.count('Left out: the transform from "world" to "brick"') == 5
