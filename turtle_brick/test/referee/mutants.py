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
Faults of a graph, for the referee to find: each breaks its requirements, and no others.

A fault changes what is published on a topic, whoever publishes it, and so knows no node from
inside. They do not get in each other's way, and share a graph.
"""

from collections import deque
from collections.abc import Callable
from math import dist
from typing import Any, NamedTuple

from geometry_msgs.msg import Quaternion, TransformStamped
from rclpy.publisher import Publisher
from turtle_referee.constants import CENTER
from turtle_referee.trial import FAR_OUT, IN_REACH, Program

Change = Callable[[Any], bool | None]
"""Changes a message; False if it is not to be published."""


class Mutant(NamedTuple):
    """A fault."""

    rows: tuple[str, ...]
    """The requirements that it breaks; all others follow from the first."""
    topic: str
    change: Change


def every(count):
    """Return what leaves out every so manyth message."""
    heard = 0

    def leave_out(message):
        nonlocal heard
        heard += 1
        return heard % count != 0
    return leave_out


def add_lost_frame(message):
    """Broadcast one more frame."""
    lost = TransformStamped(child_frame_id='lost')
    lost.header.frame_id = 'nowhere'
    message.transforms = [*message.transforms, lost]


def creep(message):
    """Turn a robot at rest, slower than turtlesim shows."""
    at_rest = message.linear.x == message.linear.y == 0.0
    message.angular.z = 1e-6 if at_rest else 0.0


def late_stem():
    """Return what turns the stem 0.1 s late: with the motion that is seen."""
    angles: deque[float] = deque(maxlen=10)

    def turn(message):
        angles.append(message.position[0])
        message.position[0] = angles[0]
    return turn


def slow_wheel(message):
    """Say half of the wheel's velocity."""
    message.velocity[1] /= 2.0


def level_on_the_ground(message):
    """Let the brick lie flat on the ground."""
    for transform in message.transforms:
        if transform.child_frame_id == 'brick' and transform.transform.translation.z < 0.2:
            transform.transform.rotation = Quaternion()


def shrink(message):
    """Draw the walls around 10 m x 10 m."""
    for marker in message.markers:
        marker.pose.position.x *= 0.9
        marker.pose.position.y *= 0.9


def shift(message):
    """Move what a message says by 2 cm."""
    message.pose.pose.position.x += 0.02


def shift_marker(message):
    """Draw something 10 cm beside its place."""
    message.pose.position.x += 0.1


def halve(message):
    """Tilt by half of what is asked for."""
    message.angle /= 2.0


def show_longer(message):
    """Show a text for 5 s."""
    message.lifetime.sec = 5


def stay_at_center(message):
    """Send the robot to the center, wherever the brick falls: farther than any other goal."""
    place = message.pose.position
    if dist((place.x, place.y), CENTER) > 1.6:
        place.x, place.y = CENTER


MUTANTS = (
    Mutant(('frames: world',), 'tf_static', add_lost_frame),
    Mutant(('rate: joint_states',), 'joint_states', every(20)),
    Mutant(('cmd_vel: at rest',), 'cmd_vel', creep),
    Mutant(('odom: pose',), 'odom', shift),
    Mutant(('joint_states: velocity',), 'joint_states', slow_wheel),
    Mutant(('drive: stem first',), 'joint_states', late_stem()),
    Mutant(('walls: size',), 'walls', shrink),
    Mutant(('tilt',), 'tilt', halve),
    Mutant(('brick marker: place',), 'brick_marker', shift_marker),
    Mutant(('brick: angle',), 'tf', level_on_the_ground),
    Mutant(('text: time',), 'catcher_marker', show_longer),
    Mutant(('verdict: in reach', 'verdict: kept'), 'goal_pose', stay_at_center))

PROGRAM = Program(1.0, 3, (0.5, 0.0), (FAR_OUT, IN_REACH))
"""What shows them all."""


def mutate(patch):
    """Have the faults in all that is published from now on."""
    publish = Publisher.publish

    def spoil(publisher, message):
        topic = publisher.topic_name.rpartition('/')[2]
        if all(mutant.change(message) is not False
               for mutant in MUTANTS if mutant.topic == topic):
            publish(publisher, message)

    patch.setattr(Publisher, 'publish', spoil)
