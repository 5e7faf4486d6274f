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

from math import inf, nan

from geometry_msgs.msg import Point, Quaternion, Vector3
from hypothesis import given
from hypothesis import strategies as st
import pytest
from turtle_brick.core.geometry import from_pitch, from_yaw, IDENTITY, multiply
from turtle_brick.view.markers import Markers, shape_of
from turtle_brick.view.shapes import ORIGIN
from visualization_msgs.msg import Marker

S = 10**9


def marker(**fields):
    """Return the marker of a box, some of whose fields are others: a__b stands for a.b."""
    message = Marker(type=Marker.CUBE)
    message.header.frame_id = 'world'
    for path, value in fields.items():
        *owners, name = path.split('__')
        owner = message
        for part in owners:
            owner = getattr(owner, part)
        setattr(owner, name, value)
    return message


def shown(markers, now=0):
    """Return the names of the markers that are shown."""
    return set(markers.things(now, lambda frame: ORIGIN))


@given(st.lists(st.tuples(st.sampled_from('ab'), st.sampled_from('xy'), st.integers(0, 1),
                          st.sampled_from([0, 0, 0, Marker.DELETE, Marker.DELETEALL]),
                          st.integers(0, 3))), st.integers(0, 9))
def test_a_marker_is_there_until_it_is_deleted_or_its_lifetime_is_over(messages, later):
    markers, ends = Markers(), {}
    for now, (topic, space, number, action, lifetime) in enumerate(messages):
        markers.hear(topic, marker(ns=space, id=number, action=action, lifetime__sec=lifetime),
                     now * S)
        if action == Marker.ADD:
            ends[topic, space, number] = now + lifetime if lifetime else inf
        for key in list(ends):
            if action == Marker.DELETEALL and key[0] == topic or (
                    action == Marker.DELETE and key == (topic, space, number)):
                del ends[key]
    now = len(messages) + later
    for time, last in ((now * S, now), ((now + 1) * S - 1, now)):
        assert shown(markers, time) == {
            '/'.join(map(str, key)) for key, end in ends.items() if last < end}


def test_shapes_are_those_of_the_markers():
    quaternion = multiply(from_yaw(0.3), from_pitch(0.4))
    message = marker(scale=Vector3(x=1.0, y=2.0, z=3.0), color__r=0.5, color__a=0.25, text='Hi')
    message.pose.position.y = 6.0
    (message.pose.orientation.x, message.pose.orientation.y, message.pose.orientation.z,
     message.pose.orientation.w) = [2.0 * part for part in quaternion]
    for message.type, kind, text in (
            (Marker.CUBE, 'box', ''), (Marker.SPHERE, 'sphere', ''),
            (Marker.CYLINDER, 'cylinder', ''), (Marker.TEXT_VIEW_FACING, 'text', 'Hi')):
        shape = shape_of(message)
        assert shape._replace(pose=ORIGIN) == (
            kind, (1.0, 2.0, 3.0), (0.5, 0.0, 0.0, 0.25), ORIGIN, text)
        assert shape.pose.position == (0.0, 6.0, 0.0)
        assert shape.pose.orientation == pytest.approx(quaternion)
    message.pose.orientation = Quaternion(w=0.0)
    assert shape_of(message).pose.orientation == IDENTITY, 'as in rviz2'


def test_a_marker_that_can_not_be_is_refused_in_words():
    markers = Markers()
    for said, fields in (
            ('its frame_id is empty', {'header__frame_id': ''}),
            ('its action is 1', {'action': 1}),
            ('its type is 10', {'type': Marker.MESH_RESOURCE}),
            *(('one of its numbers is not finite', fields) for fields in (
                {'pose__position': Point(y=inf)}, {'pose__orientation': Quaternion(w=nan)},
                {'scale': Vector3(x=-1e308)}, {'color__a': inf}))):
        with pytest.raises(ValueError, match=said):
            markers.hear('m', marker(**fields), 0)
    assert not shown(markers)
