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
"""
A stand-in for the Python module tf2_ros of ROS 2 Jazzy, in pure Python.

It has the part that nodes use: buffer, listener, broadcasters and exceptions, with the names,
signatures, QoS and behavior of tf2_ros_py 0.36.4; its buffer is held to recordings of the real
one. Left out are the buffer's action client and server, transform() of message types (with it
the registration of types and BufferInterface) and velocities.
"""

from tf2_ros.buffer import Buffer
from tf2_ros.buffer_core import (BufferCore, ConnectivityException, ExtrapolationException,
                                 InvalidArgumentException, LookupException, TimeoutException,
                                 TransformException)
from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster
from tf2_ros.transform_broadcaster import TransformBroadcaster
from tf2_ros.transform_listener import TransformListener

__all__ = [
    'Buffer', 'BufferCore', 'ConnectivityException', 'ExtrapolationException',
    'InvalidArgumentException', 'LookupException', 'StaticTransformBroadcaster',
    'TimeoutException', 'TransformBroadcaster', 'TransformException', 'TransformListener',
]
