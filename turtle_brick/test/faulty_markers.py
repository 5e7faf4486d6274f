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

"""Markers with something wrong about each, and what is said of it."""

from math import inf, nan

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Quaternion, Vector3
from turtle_brick.view.display import LONGEST_TEXT, MOST_POINTS
from turtle_brick.view.viewing import NANOSECONDS
from visualization_msgs.msg import Marker

FAULTS = [
    ({'header.stamp': Time(sec=-1)}, 'its stamp is -1 s and 0 ns'),
    ({'header.stamp': Time(nanosec=NANOSECONDS)}, 'its stamp is 0 s and 1000000000 ns'),
    ({'lifetime': Duration(sec=-3, nanosec=7)}, 'its lifetime is -3 s and 7 ns'),
    ({'lifetime': Duration(nanosec=2**32 - 1)}, 'its lifetime is 0 s and 4294967295 ns'),
    ({'pose.position': Point(y=inf)}, 'one of its numbers is inf'),
    ({'pose.orientation': Quaternion(w=nan)}, 'one of its numbers is nan'),
    ({'pose.orientation': Quaternion(x=1e308, w=1e308)}, 'one of its numbers is 1e+308'),
    ({'scale': Vector3(x=-1e308)}, 'one of its numbers is -1e+308'),
    ({'color.a': inf}, 'one of its numbers is inf'),
    ({'type': Marker.LINE_LIST, 'points': [Point(), Point(z=nan)]}, 'one of its numbers is nan'),
    ({'type': Marker.LINE_LIST, 'points': [Point()] * (MOST_POINTS + 1)}, 'it has 10001 points'),
    ({'type': Marker.TEXT_VIEW_FACING, 'text': '9' * 10**6}, 'its texts have 1000005 characters'),
    ({'ns': 'x' * (LONGEST_TEXT + 1)}, 'its texts have 1006 characters'),
    ({'header.frame_id': ''}, 'its frame_id is empty'),
    ({'type': -1}, 'its type is -1'),
    ({'type': 2**31 - 1}, 'its type is 2147483647'),
    ({'type': Marker.MESH_RESOURCE}, 'its type is 10'),
    ({'action': 1}, 'its action is 1'),
    ({'action': -2**31}, 'its action is -2147483648')]


def changed(marker, changes):
    """Return a marker some of whose fields, named from it on, are others."""
    for path, value in changes.items():
        *owners, name = path.split('.')
        target = marker
        for owner in owners:
            target = getattr(target, owner)
        setattr(target, name, value)
    return marker


def harmless():
    """Return a marker with nothing wrong about it."""
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = 'world'
    return marker
