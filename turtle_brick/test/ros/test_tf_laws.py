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
"""Test that random transforms leave the TF buffer usable."""

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from test_tf import LEVEL, listener, NOW, transform
from tf2_msgs.msg import TFMessage
from turtle_brick.ros.tf import BUFFER_DURATION_NS, latest_world_to, MAX_AHEAD_NS, pose_of

CHAIN = (('world', 'odom', True), ('odom', 'base_link', False), ('base_link', 'post', True),
         ('post', 'platform', False), ('platform', 'brick', False))


frames = st.sampled_from(('world', 'odom', 'base_link', 'post', 'platform', 'brick', 'map', ''))
numbers = st.one_of(st.floats(), st.sampled_from((0.0, 1.0, 1e9, 1e308)))
anything = st.builds(
    transform, frames, frames, st.integers(-2 * MAX_AHEAD_NS, 2 * BUFFER_DURATION_NS),
    st.tuples(*[numbers] * 3), st.one_of(st.just(LEVEL), st.tuples(*[numbers] * 4)))


@law(30)
@given(st.lists(st.tuples(anything, st.booleans()), max_size=15))
def test_any_messages_leave_the_buffer_usable(messages):
    guarded, _ = listener()

    def send_valid_transforms(age):
        for parent, child, static in CHAIN:
            # Static transforms may be old.
            message = TFMessage(transforms=[
                transform(parent, child, 10 * BUFFER_DURATION_NS if static else age)])
            assert guarded.store(message, static, NOW), (parent, child)

    send_valid_transforms(MAX_AHEAD_NS)
    for message, static in messages:
        guarded.store(TFMessage(transforms=[message]), static, NOW)
    # The buffer still stores valid transforms after receiving messages with future timestamps.
    send_valid_transforms(-MAX_AHEAD_NS)
    brick = latest_world_to(guarded.buffer, 'brick')
    assert pose_of(brick.transform).position == pytest.approx((5.0, 10.0, 15.0))
