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
inside. Those that do not get in each other's way share a graph.
"""

from collections import deque
from collections.abc import Callable
from math import dist, sqrt
from typing import Any, NamedTuple

from geometry_msgs.msg import Quaternion, TransformStamped
import pytest
from rclpy.publisher import Publisher
from turtle_brick.core.parameters import load
from turtle_referee.constants import CENTER
from turtle_referee.trial import ABOVE, FAR_OUT, IN_REACH, Program

Change = Callable[[Any], bool | None]
"""Changes a message; False if it is not to be published."""


GRAVITY = load().gravity_accel


class Mutant(NamedTuple):
    """A fault."""

    rows: set[str]
    """The requirements that it breaks."""
    words: str
    topic: str
    change: Change


def every(count: int) -> Change:
    """Return what leaves out every so manyth message."""
    heard = 0

    def leave_out(message: Any) -> bool:
        nonlocal heard
        heard += 1
        return heard % count != 0
    return leave_out


def add_lost_frame(message: Any) -> None:
    """Broadcast one more frame."""
    lost = TransformStamped(child_frame_id='lost')
    lost.header.frame_id = 'nowhere'
    message.transforms = [*message.transforms, lost]


def swing(amount: float) -> Change:
    """Return what turns a robot at rest to and fro (rad/s)."""
    signs = [1.0]

    def turn(message: Any) -> None:
        signs[0] = -signs[0]
        at_rest = message.linear.x == message.linear.y == 0.0
        message.angular.z = amount * signs[0] if at_rest else 0.0
    return turn


def turn_stem(message: Any) -> None:
    """Turn the stem by 20 degrees."""
    message.position[0] += 0.35


def late_stem() -> Change:
    """Return what turns the stem 0.1 s late: with the motion that is seen."""
    angles: deque[float] = deque(maxlen=10)

    def turn(message: Any) -> None:
        angles.append(message.position[0])
        message.position[0] = angles[0]
    return turn


def slow_wheel(message: Any) -> None:
    """Say half of the wheel's velocity."""
    message.velocity[1] /= 2.0


def level_on_the_ground(message: Any) -> None:
    """Let the brick lie flat on the ground."""
    for transform in message.transforms:
        if transform.child_frame_id == 'brick' and transform.transform.translation.z < 0.2:
            transform.transform.rotation = Quaternion()


def early_fall() -> Change:
    """Return what has a brick begin to fall 12 ms earlier: before it is dropped."""
    begin = last = 0.0

    def fall(message: Any) -> None:
        nonlocal begin, last
        for transform in message.transforms:
            place, turn = transform.transform.translation, transform.transform.rotation
            if transform.child_frame_id == 'brick':
                before, last = last, place.z
                if last >= before:
                    begin = last
                elif turn.x == turn.y == 0.0:
                    time = sqrt(2.0 * (begin - last) / GRAVITY) + 0.012
                    place.z = begin - GRAVITY * time * time / 2.0
    return fall


def shrink(message: Any) -> None:
    """Draw the walls around 10 m x 10 m."""
    for marker in message.markers:
        marker.pose.position.x *= 0.9
        marker.pose.position.y *= 0.9


def shift(message: Any) -> None:
    """Move what a message says by 2 cm."""
    message.pose.pose.position.x += 0.02


def shift_marker(message: Any) -> None:
    """Draw something 10 cm beside its place."""
    message.pose.position.x += 0.1


def halve(message: Any) -> None:
    """Tilt by half of what is asked for."""
    message.angle /= 2.0


def show_longer(message: Any) -> None:
    """Show a text for 5 s."""
    message.lifetime.sec = 5


def stay_at_center(message: Any) -> None:
    """Send the robot to the center, wherever the brick falls."""
    place = message.pose.position
    if dist((place.x, place.y), CENTER) > 1.0:
        place.x, place.y = CENTER


ON_THE_MOVE = (
    Mutant({'frames: world'}, 'one more frame, below none that leads to the world',
           'tf_static', add_lost_frame),
    Mutant({'rate: joint_states'}, '97 joint states per second', 'joint_states', every(33)),
    Mutant({'cmd_vel: at rest'}, 'commands at rest turn the robot to and fro',
           'cmd_vel', swing(1e-6)),
    Mutant({'odom: pose'}, 'the odometry is 2 cm from the transform', 'odom', shift),
    Mutant({'drive: stem', 'drive: stem first'}, 'the stem points 20 degrees beside the motion',
           'joint_states', turn_stem),
    Mutant({'joint_states: velocity'}, 'the wheel turns with half of its velocity',
           'joint_states', slow_wheel),
    Mutant({'brick: angle'}, 'the brick is level on the ground', 'tf', level_on_the_ground),
    Mutant({'walls: size'}, 'the walls are around 10 m x 10 m', 'walls', shrink),
    Mutant({'tilt'}, 'the platform tilts by half of what is asked for', 'tilt', halve))

WITH_BRICKS = (
    Mutant({'brick marker: place'}, "the brick's marker is 10 cm from the brick",
           'brick_marker', shift_marker),
    Mutant({'drop: answer first'}, 'the brick falls before the answer', 'tf', early_fall()),
    Mutant({'text: time'}, 'the text lasts for 5 s', 'catcher_marker', show_longer),
    Mutant({'verdict: in reach', 'verdict: kept'}, 'the robot stays at the center',
           'goal_pose', stay_at_center),
    Mutant({'again'}, 'the platform stays tilted', 'tilt',
           lambda message: abs(message.angle) > 0.1))

TOO_LATE = (
    Mutant({'drive: stem first'}, 'the stem turns with the motion', 'joint_states', late_stem()),)

OTHER_NUMBERS = {'gravity_accel': 6.0, 'wheel_radius': 0.25, 'max_velocity': 3.3,
                 'platform_height': 1.8}
"""Parameters of a graph that is said to have others."""


class Mutation(NamedTuple):
    """A graph with faults, and what shows them."""

    mutants: tuple[Mutant, ...]
    program: Program
    parameters: dict[str, float] = {}
    rows: frozenset[str] = frozenset()
    """The requirements that the parameters break."""

    @property
    def broken(self) -> set[str]:
        """Return the requirements that must be broken."""
        return set(self.rows).union(*(mutant.rows for mutant in self.mutants))


MUTATIONS = {
    'on the move': Mutation(ON_THE_MOVE, Program(2.0, 3, (0.5,), (FAR_OUT,))),
    'with bricks': Mutation(WITH_BRICKS, Program(0.5, 0, (), (FAR_OUT, IN_REACH, ABOVE))),
    'with other numbers': Mutation(
        TOO_LATE, Program(0.5, 3, (), (ABOVE,)), OTHER_NUMBERS, frozenset((
            'URDF: numbers', 'drive: rolling', 'drive: speed', 'fall: acceleration',
            'fall: platform', 'slide: law'))),
}


def mutate(patch: pytest.MonkeyPatch, mutants: tuple[Mutant, ...]) -> None:
    """Have the faults in all that is published from now on."""
    publish = Publisher.publish

    def spoil(publisher: Publisher, message: Any) -> None:
        topic = publisher.topic_name.rpartition('/')[2]
        if all(mutant.change(message) is not False
               for mutant in mutants if mutant.topic == topic):
            publish(publisher, message)

    patch.setattr(Publisher, 'publish', spoil)
