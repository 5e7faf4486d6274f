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

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Quaternion, Vector3
from hypothesis import given
from hypothesis import strategies as st
import pytest
from turtle_brick.core.geometry import from_pitch, from_yaw, IDENTITY, multiply, Pose
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
    return set(markers.things(now, lambda frame, stamp: ORIGIN))


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


def test_a_lifetime_ends_to_the_nanosecond():
    markers = Markers()
    markers.hear('m', marker(lifetime__sec=3), 5)
    assert shown(markers, 3 * S + 4) == {'m//0'}
    assert shown(markers, 3 * S + 5) == set()


def test_a_locked_marker_goes_with_its_frame_and_another_stays_where_it_was_at_its_stamp():
    markers, stamps = Markers(), {}
    for number, fields in enumerate((
            {'frame_locked': True, 'header__stamp': Time(sec=7)}, {},
            {'header__stamp': Time(sec=7)})):
        markers.hear('m', marker(id=number, **fields), 0)

    def pose_of(frame, stamp):
        stamps[stamp] = stamps.get(stamp, 0) + 1
        return Pose((height, stamp / S, 0.0), IDENTITY) if height else None

    height = 0.0
    assert markers.things(0, pose_of) == {} and stamps == {0: 2, 7 * S: 1}
    for height in (3.0, 2.0):
        things = markers.things(0, pose_of)
        assert [thing.pose.position for thing in things.values()] == [
            (height, 0.0, 0.0), (3.0, 0.0, 0.0), (3.0, 7.0, 0.0)]


def test_shapes_are_those_of_the_markers():
    quaternion = multiply(from_yaw(0.3), from_pitch(0.4))
    message = marker(scale=Vector3(x=1.0, y=2.0, z=3.0), color__r=0.5, color__a=0.25, text='Hi')
    message.pose.position.y = 6.0
    (message.pose.orientation.x, message.pose.orientation.y, message.pose.orientation.z,
     message.pose.orientation.w) = [2.0 * part for part in quaternion]
    for message.type, kind in ((Marker.CUBE, 'box'), (Marker.SPHERE, 'sphere'),
                               (Marker.CYLINDER, 'cylinder')):
        shape = shape_of(message)
        assert (shape.kind, shape.size, shape.color) == (
            kind, (1.0, 2.0, 3.0), (0.5, 0.0, 0.0, 0.25))
        assert shape.pose.position == (0.0, 6.0, 0.0)
        assert shape.pose.orientation == pytest.approx(quaternion)
    message.type = Marker.TEXT_VIEW_FACING
    assert shape_of(message)._replace(pose=ORIGIN) == (
        'text', (3.0, 3.0, 3.0), (0.5, 0.0, 0.0, 0.25), ORIGIN, 'Hi', ())
    message.points = [Point(x=float(number)) for number in range(5)]
    for message.type, ends in ((Marker.LINE_STRIP, [0, 1, 1, 2, 2, 3, 3, 4]),
                               (Marker.LINE_LIST, [0, 1, 2, 3])):
        shape = shape_of(message)
        assert (shape.kind, shape.size) == ('lines', (1.0, 1.0, 1.0))
        assert [point[0] for point in shape.points] == ends
    message.pose.orientation = Quaternion(w=0.0)
    assert shape_of(message).pose.orientation == IDENTITY, 'as in rviz2'


@pytest.mark.parametrize(('said', 'fields'), [
    ('its frame_id is empty', {'header__frame_id': ''}),
    ('its action is 1', {'action': 1}),
    ('its type is 10', {'type': Marker.MESH_RESOURCE}),
    ('its stamp or lifetime is -1 s', {'header__stamp': Time(sec=-1)}),
    ('its stamp or lifetime is 0 s and 1000000000 ns', {'lifetime': Duration(nanosec=S)}),
    *(('one of its numbers is not finite', fields) for fields in (
        {'pose__position': Point(y=inf)}, {'pose__orientation': Quaternion(w=nan)},
        {'scale': Vector3(x=-1e308)}, {'color__a': inf},
        {'type': Marker.LINE_LIST, 'points': [Point(), Point(z=nan)]}))])
def test_a_marker_that_can_not_be_is_refused_in_words(said, fields):
    markers = Markers()
    markers.hear('m', marker(), 0)
    with pytest.raises(ValueError, match=said):
        markers.hear('m', marker(id=1, **fields), 0)
    assert shown(markers) == {'m//0'}
