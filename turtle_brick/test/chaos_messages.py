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
Random messages for every topic and service that a node of this package hears.

A message is filled field by field, by its type: most often with what makes sense, sometimes with
what can't be. How often, is drawn for each message, so that some are sound, some have one bad
field, and in some nothing is right.
"""

from collections import Counter
from collections.abc import Callable
from math import inf, nan
from random import Random
import re
from time import monotonic, time_ns
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, Quaternion, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from rosidl_parser.definition import AbstractGenericString, AbstractNestedType, Array, BasicType
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtlesim.msg import Pose as TurtlePose
from visualization_msgs.msg import Marker, MarkerArray

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)

WILDNESS = (0.0, 0.03, 0.3, 1.0)
"""Probabilities of a value that makes no sense, one of which a message has."""

FIXED = ('odom', 'post')
"""Frames that are said on /tf_static, by turtle_robot and robot_state_publisher."""

LENGTH = 100_000
"""Of a string that is far too long."""

FRAMES = ('world', 'odom', 'base_link', 'platform', 'brick', 'stem', 'wheel', 'post')
STRINGS = ('', '/platform', 'foreign', 'map', 'näme with blanks', 'Unreachable', '\n', '<robot/>',
           '%s%n{}', 'x' * LENGTH)
DOUBLES = (nan, inf, -inf, 1e308, -1e308, 1.7e308, 5e-324, -0.0, 1e9)
FLOATS = (nan, inf, -inf, 3e38, -3e38, 1e-45, -0.0, 1e9)

ANSWER_TIME = 2.0
"""How long (s) a service may take to answer, before it is called again."""

FORESIGHT = 5.0
"""How far ahead (s) of its clock a node may take a transform for true. Until so long after the
last message, a sound foreign one may be what it goes by."""

LONG = 1_000
"""Elements of an array that is far too long."""

BITS = {'uint8': (0, 2**8 - 1), 'int8': (-2**7, 2**7 - 1), 'uint32': (0, 2**32 - 1),
        'int32': (-2**31, 2**31 - 1)}


class Filler:
    """Fill messages at random."""

    def __init__(self, random: Random) -> None:
        """
        Draw how wild this one is to be.

        :param random: where chance comes from
        """
        self.random = random
        self.wildness = random.choice(WILDNESS)
        self.long = False
        """Whether the message has a long array or string already."""

    def wild(self) -> bool:
        """Tell whether the next value is to make no sense."""
        return self.random.random() < self.wildness

    def message(self, kind: type) -> Any:
        """Return a message of a type."""
        if kind is Time:
            return self.stamp()
        message = kind()
        if kind is Quaternion and not self.wild():
            return message if self.random.random() < 0.8 else Quaternion(x=0.6, y=0.0, z=0.8, w=0.)
        for (name, slot) in zip(message.get_fields_and_field_types(), kind.SLOT_TYPES):
            setattr(message, name, self.value(slot, getattr(message, name)))
        return message

    def stamp(self) -> Time:
        """Return an instant, now or another."""
        if self.wild():
            return Time(sec=self.random.choice((-2**31, -1, 0, 2**31 - 1)),
                        nanosec=self.random.choice((0, 10**9, 2**32 - 1)))
        offset = self.random.choice((0.0, 0.0, 0.0, -1.0, 1.0, FORESIGHT, -3600.0, 3600.0))
        sec, nanosec = divmod(time_ns() + int(offset * 1e9), 10**9)
        return Time(sec=sec, nanosec=nanosec)

    def value(self, slot: Any, present: Any) -> Any:
        """Return a value for a field of some type, which has some default."""
        random = self.random
        if isinstance(slot, Array):
            return [self.value(slot.value_type, None) for _ in range(slot.size)]
        if isinstance(slot, AbstractNestedType):
            count = random.choice((1, 1, 1, 2, 4))
            if self.wild():
                # One long thing per message: a long one of long ones would be gigabytes.
                count = 0 if self.long else random.choice((0, 0, 0, 0, 0, 0, 0, 20, 20, LONG))
                self.long |= count > 0
            values = [self.value(slot.value_type, None) for _ in range(min(count, 10))]
            return values * (count // len(values)) if values else values
        if isinstance(slot, AbstractGenericString):
            text = random.choice(STRINGS if self.wild() else FRAMES)
            if len(text) == LENGTH and self.long:
                return ''
            self.long |= len(text) == LENGTH
            return text
        if not isinstance(slot, BasicType):
            if present is None:
                module = __import__('.'.join(slot.namespaces), fromlist=[slot.name])
                return self.message(getattr(module, slot.name))
            return self.message(type(present))
        if slot.typename == 'boolean':
            return random.random() < 0.5
        if slot.typename in ('double', 'float'):
            if self.wild():
                return random.choice(DOUBLES if slot.typename == 'double' else FLOATS)
            return random.uniform(-1.0, 11.5)
        if slot.typename == 'octet':
            return bytes([random.randrange(256)])
        low, high = BITS[slot.typename]
        if self.wild():
            return random.choice((low, high))
        return random.randrange(max(low, 0), min(high, 12))


def transforms(filler: Filler) -> TFMessage:
    """Return a message for /tf: most often of what our nodes look up."""
    message = filler.message(TFMessage)
    for transform in message.transforms[:10]:
        if not filler.wild():
            transform.header.frame_id, transform.child_frame_id = filler.random.choice((
                ('world', 'brick'), ('world', 'platform'), ('world', 'base_link'),
                ('odom', 'base_link'), ('odom', 'brick'), ('platform', 'brick'),
                ('post', 'platform'), ('world', 'odom'), ('brick', 'world'),
                ('brick', 'platform'), ('platform', 'base_link'), ('foreign', 'brick'),
                ('foreign', 'foreigner'), ('brick', 'brick')))
    return message


def static_transforms(filler: Filler) -> TFMessage:
    """
    Return a message for /tf_static, with nothing sound about the frames that are said there once.

    Of two that are, the last one is believed for good, by every listener of tf2.
    """
    message = transforms(filler)
    for transform in message.transforms[:10]:
        if transform.child_frame_id in FIXED:
            transform.transform.translation.x = nan
    return message


def command(filler: Filler) -> Twist:
    """
    Return a command for turtlesim, finite.

    Of one that is not, turtlesim's pose is NaN for good, the real one's too: that is not ours.
    """
    twist = Twist()
    for vector in (twist.linear, twist.angular):
        vector.x, vector.y = (filler.random.choice((0.0, 1.0, -3.0, 1e308, -1e308, 5e-324))
                              for _ in range(2))
        vector.z = filler.random.choice((0.0, 0.5, -7.0, 1e308))
    return twist


def joint_states(filler: Filler) -> JointState:
    """Return joint states, not from before 1970: the real robot_state_publisher dies of these."""
    message = filler.message(JointState)
    message.header.stamp.sec = max(message.header.stamp.sec, 0)
    return message


class Kind(NamedTuple):
    """Something that our nodes hear."""

    topic: str
    message: type
    make: Callable[[Filler], Any]
    qos: QoSProfile = QoSProfile(depth=10)
    weight: int = 1


def plain(topic: str, kind: type, *more: Any) -> Kind:
    """Return a kind of message that is filled as its type says."""
    return Kind(topic, kind, lambda filler: filler.message(kind), *more)


MESSAGES = (
    Kind('/tf', TFMessage, transforms, QoSProfile(depth=100), 5),
    Kind('/tf_static', TFMessage, static_transforms, LATCHED, 2),
    plain('goal_pose', PoseStamped),
    plain('tilt', Tilt),
    plain('turtle1/pose', TurtlePose),
    Kind('turtle1/cmd_vel', Twist, command),
    plain('cmd_vel', Twist),
    plain('odom', Odometry),
    Kind('joint_states', JointState, joint_states),
    plain('brick_marker', Marker, LATCHED),
    plain('catcher_marker', Marker),
    plain('walls', MarkerArray, LATCHED),
    plain('robot_description', String, LATCHED),
)
SERVICES = (Kind('place', Place, lambda filler: filler.message(Place.Request), weight=2),
            Kind('drop', Trigger, lambda filler: Trigger.Request()))


class Injector(Node):
    """Publish random messages and call services at random."""

    def __init__(self, random: Random, pattern: str = '', **node_options: Any) -> None:
        """
        Make ready.

        :param random: where chance comes from
        :param pattern: a regular expression that the names of topics and services are to match
        :param node_options: passed on to rclpy.node.Node
        """
        super().__init__('injector', **node_options)
        self._random = random
        self._outlets: list[tuple[Kind, Callable[[Any], Any]]] = []
        for kind in MESSAGES:
            if re.search(pattern, kind.topic):
                publisher = self.create_publisher(kind.message, kind.topic, kind.qos)
                self._outlets += [(kind, publisher.publish)] * kind.weight
        for kind in SERVICES:
            if re.search(pattern, kind.topic):
                client = self.create_client(kind.message, kind.topic)
                self._outlets += [(kind, client.call_async)] * kind.weight
        if not self._outlets:
            raise ValueError(f'no topic and no service matches {pattern!r}')
        self.sent: Counter[str] = Counter()
        self._calls: dict[str, tuple[Future, float]] = {}

    def inject(self) -> None:
        """Send one message, or call one service unless it has not answered yet."""
        kind, send = self._random.choice(self._outlets)
        if self.waits(kind.topic):
            return
        future = send(kind.make(Filler(self._random)))
        if future is not None:
            self._calls[kind.topic] = (future, monotonic() + ANSWER_TIME)
        self.sent.update((kind.topic,))

    def waits(self, service: str = '') -> bool:
        """Tell whether a service, or any, has not answered yet."""
        return any(not call.done() and monotonic() < deadline
                   for name, (call, deadline) in self._calls.items() if service in ('', name))
