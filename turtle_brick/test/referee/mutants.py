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
Mutants of the graph, each with one fault, for the referee to find: this one and no other.

    python3 turtle_brick/test/mutants.py                  all of them, two at a time
    python3 turtle_brick/test/mutants.py slides walls     those with such words in their names
    python3 turtle_brick/test/mutants.py --full NAME      with the referee's whole program

A mutant is the composed graph in a process and a ROS domain of its own, in which something is
changed before the nodes are made. It says which of the referee's requirements must be broken, and
which others follow from the fault, and why. The first one has no fault. The status is 0 only if
each is found as it should be. Those that change a stand-in need the home of wheels.
"""

from __future__ import annotations

import argparse
from array import array
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
import json
from math import cos, hypot, inf, sin
import os
import subprocess
import sys
from time import monotonic
from typing import Any, NamedTuple
from xml.etree import ElementTree

from geometry_msgs.msg import TransformStamped, Twist
from rclpy.node import Node
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from tf2_ros import StaticTransformBroadcaster, TransformBroadcaster
from turtle_brick import arena
from turtle_brick.arena import Arena
from turtle_brick.catcher import CatcherNode
from turtle_brick.core import catch_logic as catching
from turtle_brick.core import driving
from turtle_brick.core import reachability as reaching
from turtle_brick.core.driving import Driver
from turtle_brick.core.geometry import distance_to_rectangle, IDENTITY, Pose2D
from turtle_brick.core.odometry import Odometer
from turtle_brick.physics import Phase, World
from turtle_brick.tools.graph import Graph, note_interrupts
from turtle_brick.turtle_robot import TurtleRobot
from turtle_referee import referee, trial
from turtle_referee.domains import reserved_domain
from turtle_referee.names import Profile
from turtle_referee.rules import BROKEN

NAMESPACE = 'mutant'

PATIENCE = 240.0
"""How long (s) the referee may take for one of them."""

ATTEMPTS = 3
"""How often the referee may say that the machine was too busy to tell."""

STAGES = ('rest', 'drive', 'tilt')
"""Parts of the referee's program that can be left out."""

FAR_OUT, ABOVE, IN_REACH, JUST_OUT, JUST_IN, DOUBTFUL, IN_REACH_TOO = range(len(trial.DROPS))
"""What it drops, in its order."""

REST = ('rest',)
DRIVE = ('rest', 'drive')
TILT = ('tilt',)
CATCH = (ABOVE,)
CARRY = (IN_REACH,)
REFUSE = (FAR_OUT,)

FALLEN = ('place', 'drop', 'rate: brick', 'brick: hovers', 'brick marker: place')
"""Requirements that can't be met without a brick that can be looked up."""

Change = Callable[[Graph], None]


class Mutant(NamedTuple):
    """A fault, and what the referee has to say about it."""

    name: str
    words: str
    change: Change
    row: str
    """The requirement that it breaks; empty for none."""
    needs: tuple[Any, ...]
    """The parts of the referee's program that show it."""
    follows: tuple[str, ...]
    """Requirements that it may break as well."""
    why: str
    reaction: float
    """As for the referee (s)."""


MUTANTS: list[Mutant] = []


def mutant(row: str, words: str, *needs: Any, follows: Sequence[str] = (), why: str = '',
           reaction: float = referee.REACTION) -> Callable[[Change], Change]:
    """Make a mutant of a function that changes the nodes before they are made."""
    def add(change: Change) -> Change:
        MUTANTS.append(Mutant(change.__name__.replace('_', '-'), words, change, row, needs,
                              tuple(follows), why, reaction))
        return change
    return add


# ---------------------------------------------------------------------------- how to change what

def wrap(owner: Any, name: str) -> Callable[[Callable[..., Any]], None]:
    """Replace a function by one that is given the original first."""
    original = getattr(owner, name)

    def decorate(function: Callable[..., Any]) -> None:
        setattr(owner, name, lambda *args, **options: function(original, *args, **options))
    return decorate


def replace(owner: Any, name: str, value: Any) -> None:
    """Replace what there is."""
    getattr(owner, name)
    setattr(owner, name, value)


def after_start(node_type: type[Node]) -> Callable[[Callable[[Any], None]], None]:
    """Do something with each node of a type when it has been made."""
    def decorate(function: Callable[[Any], None]) -> None:
        @wrap(node_type, '__init__')
        def start(original: Any, node: Any, **options: Any) -> None:
            original(node, **options)
            function(node)
    return decorate


def on_publish(node_type: type[Node], publisher: str,
               ) -> Callable[[Callable[[Callable[[Any], None], Any], None]], None]:
    """Have a function publish what a node's publisher is given."""
    def decorate(function: Callable[[Callable[[Any], None], Any], None]) -> None:
        @after_start(node_type)
        def take_over(node: Any) -> None:
            speaker = getattr(node, publisher)
            method = 'publish' if hasattr(speaker, 'publish') else 'sendTransform'
            setattr(speaker, method, partial(function, getattr(speaker, method)))
    return decorate


def leave_out(node_type: type[Node], publisher: str, every: int,
              when: Callable[[Any], bool] = lambda message: True) -> None:
    """Leave out every so manyth message of a node's publisher."""
    count = 0

    @on_publish(node_type, publisher)
    def publish(original: Callable[[Any], None], message: Any) -> None:
        nonlocal count
        if when(message):
            count += 1
            if count % every == 0:
                return
        original(message)


def edit_urdf(edit: Callable[[ElementTree.Element], None]) -> None:
    """Change the robot's description."""
    @wrap(Graph, 'robot_description')
    def describe(original: Callable[[Graph], str], graph: Graph) -> str:
        robot = ElementTree.fromstring(original(graph))
        edit(robot)
        return ElementTree.tostring(robot, encoding='unicode')


def part(robot: ElementTree.Element, path: str) -> ElementTree.Element:
    """Return an element of a URDF."""
    found = robot.find(path)
    assert found is not None, path
    return found


def in_s(node: Node, seconds: float, action: Callable[[], None]) -> None:
    """Do something later."""
    def act() -> None:
        timer.cancel()
        action()
    timer = node.create_timer(seconds, act)


# ------------------------------------------------------------------------------- frames and names

@mutant('', 'No fault', *STAGES, *range(len(trial.DROPS)))
def none(graph: Graph) -> None:
    pass


@mutant('frames: world', 'One more frame, below none that leads to the world', *REST)
def lost_frame(graph: Graph) -> None:
    graph.add(LostFrame, parameters=False)


class LostFrame(Node):
    """Broadcast a frame that hangs below nothing."""

    def __init__(self, **options: Any) -> None:
        """Say it once."""
        super().__init__('lost_frame', **options)
        self.broadcaster = StaticTransformBroadcaster(self)
        transform = TransformStamped(child_frame_id='lost')
        transform.header.frame_id = 'nowhere'
        self.broadcaster.sendTransform(transform)


@mutant('frames: odom', 'The odom frame is half a meter from where the turtle begins', *REST)
def odom_beside_the_start(graph: Graph) -> None:
    @on_publish(TurtleRobot, 'static_broadcaster')
    def send(original: Any, transform: TransformStamped) -> None:
        transform.transform.translation.x += 0.5
        original(transform)

    shift_base_link(-0.5, 0.0)


def shift_base_link(dx: float, dy: float) -> None:
    """Shift base_link in odom (m)."""
    @wrap(Odometer, 'observe')
    def observe(original: Any, odometer: Any, now: float, pose: Any) -> None:
        original(odometer, now, pose)
        x, y, yaw = odometer.pose
        odometer.pose = Pose2D(x + dx, y + dy, yaw)


@mutant('frames: base_link', 'base_link is 1.5 cm from the turtle', *DRIVE)
def base_link_beside_the_turtle(graph: Graph) -> None:
    shift_base_link(0.0, 0.015)


@mutant('frames: robot', 'A link of the URDF is not broadcast', *REST)
def link_without_a_frame(graph: Graph) -> None:
    from robot_state_publisher import node

    @wrap(node, 'parse')
    def parse(original: Any, description: str) -> Any:
        return {name: joint for name, joint in original(description).items()
                if joint.child != 'pupils'}


@mutant('frames: brick', "The brick's frame hangs below another that nobody knows",
        *REST, follows=('frames: world', *FALLEN),
        why='a frame that does not lead to the world can be seen by nobody')
def brick_in_the_sky(graph: Graph) -> None:
    @on_publish(Arena, 'tf_broadcaster')
    def send(original: Any, transforms: list[TransformStamped]) -> None:
        for transform in transforms:
            transform.header.frame_id = 'sky'
        original(transforms)


@mutant('frames: broadcasters', 'A second node broadcasts the wheel, twice a second', *REST)
def two_broadcasters(graph: Graph) -> None:
    graph.add(Echo, parameters=False)


class Echo(Node):
    """Repeat where the wheel is."""

    def __init__(self, **options: Any) -> None:
        """Begin to listen."""
        super().__init__('echo', **options)
        self.broadcaster = TransformBroadcaster(self)
        self.last: TransformStamped | None = None
        self.create_subscription(TFMessage, '/tf', self.hear, 100)
        self.create_timer(0.5, self.repeat)

    def hear(self, message: TFMessage) -> None:
        """Keep the wheel's transform."""
        for transform in message.transforms:
            if transform.child_frame_id == 'wheel':
                self.last = transform

    def repeat(self) -> None:
        """Say it again."""
        if self.last is not None:
            self.broadcaster.sendTransform(self.last)


@mutant('names: relative', 'The walls are published on /walls, whatever the namespace', *REST)
def absolute_name(graph: Graph) -> None:
    @wrap(Graph, 'add_arena')
    def add_arena(original: Any, graph: Graph) -> Arena:
        return graph.add(Arena, '-r', 'walls:=/walls')


# ---------------------------------------------------------------------------------------- rates

@mutant('rate: cmd_vel', '90 commands per second at rest', *DRIVE)
def slow_cmd_vel(graph: Graph) -> None:
    leave_out(TurtleRobot, 'cmd_vel_publisher', 10,
              lambda twist: twist.linear.x == twist.linear.y == 0.0)


@mutant('rate: cmd_vel', 'No commands at rest',
        *DRIVE, follows=('cmd_vel: at rest', 'odom: twist', 'carry', 'tip off'),
        why='who is silent at rest does not say 0, which the odometry has, and turtlesim goes on '
            'with the last command: the robot is not seen to stand still at the center')
def silent_at_rest(graph: Graph) -> None:
    leave_out(TurtleRobot, 'cmd_vel_publisher', 1,
              lambda twist: twist.linear.x == twist.linear.y == 0.0)


@mutant('rate: odom', '50 odometry messages per second', *DRIVE)
def slow_odom(graph: Graph) -> None:
    leave_out(TurtleRobot, 'odom_publisher', 2)


@mutant('rate: joint_states', '97 joint states per second', *DRIVE)
def slow_joint_states(graph: Graph) -> None:
    leave_out(TurtleRobot, 'joint_publisher', 33)


@mutant('rate: base_link', 'base_link 50 times per second', *DRIVE)
def slow_base_link(graph: Graph) -> None:
    leave_out(TurtleRobot, 'tf_broadcaster', 2)


@mutant('rate: brick', 'The brick 200 times per second', *DRIVE)
def slow_brick(graph: Graph) -> None:
    count = 0

    @on_publish(Arena, 'tf_broadcaster')
    def send(original: Any, transforms: list[TransformStamped]) -> None:
        nonlocal count
        count += len(transforms)
        original([transform for number, transform in enumerate(transforms, count)
                  if number % 5])


# ---------------------------------------------------------------------------- the robot's topics

@mutant('cmd_vel: at rest', 'Commands at rest turn the robot by 0.01 rad/s to and fro', *DRIVE)
def restless(graph: Graph) -> None:
    sign = 1.0

    @on_publish(TurtleRobot, 'cmd_vel_publisher')
    def publish(original: Any, twist: Twist) -> None:
        nonlocal sign
        sign = -sign
        twist.angular.z = 0.01 * sign if twist.linear.x == twist.linear.y == 0.0 else 0.0
        original(twist)


@mutant('odom: pose', 'The odometry is 2 cm from the transform', *DRIVE)
def odometry_beside_tf(graph: Graph) -> None:
    @on_publish(TurtleRobot, 'odom_publisher')
    def publish(original: Any, odometry: Any) -> None:
        odometry.pose.pose.position.x += 0.02
        original(odometry)


@mutant('odom: pose', "The odometry's pose is that of 50 ms ago", *DRIVE)
def stale_odometry(graph: Graph) -> None:
    places: list[tuple[float, float]] = []

    @on_publish(TurtleRobot, 'odom_publisher')
    def publish(original: Any, odometry: Any) -> None:
        position = odometry.pose.pose.position
        places.append((position.x, position.y))
        position.x, position.y = places[max(len(places) - 6, 0)]
        original(odometry)


@mutant('odom: twist', "The odometry's twist is 0", *DRIVE)
def no_twist(graph: Graph) -> None:
    @on_publish(TurtleRobot, 'odom_publisher')
    def publish(original: Any, odometry: Any) -> None:
        odometry.twist.twist = Twist()
        original(odometry)


@mutant('joint_states: names', "joint_states names a joint that the URDF doesn't have", *REST)
def unknown_joint(graph: Graph) -> None:
    @on_publish(TurtleRobot, 'joint_publisher')
    def publish(original: Any, joints: Any) -> None:
        joints.name = ['stem_joint', 'wheel_joint', 'platform_joint', 'antenna_joint']
        joints.position = array('d', [*joints.position, 0.0])
        original(joints)


@mutant('joint_states: names', "joint_states lacks the wheel's joint",
        *DRIVE,
        follows=('frames: robot', 'drive: rolling', 'frames: world'),
        why='a link without a joint position has no place')
def missing_joint(graph: Graph) -> None:
    @on_publish(TurtleRobot, 'joint_publisher')
    def publish(original: Any, joints: Any) -> None:
        joints.name = ['stem_joint', 'platform_joint']
        joints.position = array('d', joints.position[::2])
        original(joints)


# ---------------------------------------------------------------------------------------- URDF

@mutant('URDF: base_link', 'The base is a box, but no cube', *REST)
def flat_base(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        box = part(robot, "link[@name='base_link']/visual/geometry/box")
        x, y, z = map(float, box.get('size', '').split())
        box.set('size', f'{x} {y} {0.8 * z}')


@mutant('URDF: platform', 'A flag is fixed to the post, above the platform', *REST)
def higher_link(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        robot.append(ElementTree.fromstring(
            '<link name="flag"><visual><geometry><sphere radius="0.02"/></geometry></visual>'
            '</link>'))
        robot.append(ElementTree.fromstring(
            '<joint name="flag_joint" type="fixed"><parent link="post"/><child link="flag"/>'
            '<origin xyz="0.8 0 1.5"/></joint>'))


@mutant('URDF: platform', 'The platform is fixed to the post',
        *REST, *TILT,
        follows=('tilt', 'joint_states: names', 'URDF: room to turn', 'carry', 'tip off'),
        why='what does not turn needs no room, can not be tilted, and has no position')
def fixed_platform(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        part(robot, "joint[@name='platform_joint']").set('type', 'fixed')


@mutant('URDF: room to turn', 'The cube is where the platform turns', *REST)
def high_base(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        origin = part(robot, "link[@name='base_link']/visual/origin")
        x, y, z = map(float, origin.get('xyz', '').split())
        origin.set('xyz', f'{x} {y} {z + 0.4}')


@mutant('URDF: post', 'The post is no cylinder', *REST)
def square_post(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        for geometry in robot.findall("link[@name='post']/visual/geometry"):
            geometry.clear()
            geometry.append(ElementTree.fromstring('<box size="0.05 0.05 0.3"/>'))


@mutant('URDF: stem', "The stem's cylinder is above the cube", *REST)
def stem_above_the_base(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        part(robot, "link[@name='stem']/visual/origin").set('xyz', '0 0 0.5')


@mutant('URDF: stem', 'The stem does not turn',
        *DRIVE,
        follows=('URDF: wheel', 'joint_states: names', 'drive: stem', 'drive: rolling',
                 'URDF: numbers', 'URDF: colors', 'frames: robot', 'frames: world'),
        why='what holds the wheel is no stem if it does not turn, and the wheel is found by it')
def fixed_stem(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        part(robot, "joint[@name='stem_joint']").set('type', 'fixed')


@mutant('URDF: wheel', "The wheel's cylinder stands upright on its axle", *REST)
def lying_wheel(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        part(robot, "link[@name='wheel']/visual/origin").set('rpy', '0 0 0')


@mutant('URDF: wheel', 'The wheel turns from -pi to pi', *REST)
def wheel_with_a_stop(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        joint = part(robot, "joint[@name='wheel_joint']")
        joint.set('type', 'revolute')
        joint.append(ElementTree.fromstring(
            '<limit lower="-3.14" upper="3.14" effort="1" velocity="100"/>'))


@mutant('URDF: colors', 'Platform and base have one color', *REST)
def same_color(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        part(robot, "link[@name='platform']/visual/material").set('name', 'green')


@mutant('URDF: numbers', 'The URDF has a wheel of another size than the parameters', *DRIVE)
def other_wheel(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        wheel = part(robot, "link[@name='wheel']/visual/geometry/cylinder")
        wheel.set('radius', str(1.1 * float(wheel.get('radius', ''))))


@mutant('URDF: numbers', 'The URDF has a platform 20 cm higher than the parameters',
        *REST, *CATCH,
        follows=('fall: platform', 'carry', 'tip off', 'verdict: in reach', 'verdict: kept',
                 'verdict: in time'),
        why='the brick lands on the platform that there is, and the catcher knows of another')
def other_platform(graph: Graph) -> None:
    @edit_urdf
    def edit(robot: ElementTree.Element) -> None:
        origin = part(robot, "joint[@name='platform_joint']/origin")
        x, y, z = map(float, origin.get('xyz', '').split())
        origin.set('xyz', f'{x} {y} {z + 0.2}')


# ------------------------------------------------------------------------------------- the drive

@mutant('drive: goal', 'The robot stops 8 cm before its goal, but for the center', *DRIVE)
def stops_short(graph: Graph) -> None:
    @wrap(Driver, 'drive_to')
    def drive_to(original: Any, driver: Driver, x: float, y: float) -> None:
        here = driver.pose
        if here is not None and (x, y) != catching.CENTER:
            way = hypot(x - here.x, y - here.y)
            if way > 0.5:
                left = (way - 0.08) / way
                x, y = here.x + left * (x - here.x), here.y + left * (y - here.y)
        original(driver, x, y)


@mutant('drive: straight', 'The robot heads 10 degrees beside its goal', *DRIVE,
        follows=('drive: stem',),
        why='its direction changes while it is measured')
def curved_way(graph: Graph) -> None:
    @wrap(Driver, '_steer')
    def steer(original: Any, driver: Driver, now: float) -> tuple[float, float]:
        x, y = original(driver, now)
        c, s = cos(0.175), sin(0.175)
        return c * x - s * y, s * x + c * y


@mutant('drive: overshoot', 'The robot drives 10 cm beyond its goal, and back', *DRIVE)
def beyond_the_goal(graph: Graph) -> None:
    goals: list[tuple[float, float]] = []

    @wrap(Driver, 'drive_to')
    def drive_to(original: Any, driver: Driver, x: float, y: float) -> None:
        goals[:] = [(x, y)]
        here = driver.pose
        way = hypot(x - here.x, y - here.y) if here is not None else 0.0
        if here is None or way < 0.5:
            original(driver, x, y)
        else:
            on = (way + 0.1) / way
            original(driver, here.x + on * (x - here.x), here.y + on * (y - here.y))

    @wrap(Driver, 'command')
    def command(original: Any, driver: Driver, now: float) -> tuple[float, float]:
        if driver.arrived and goals and driver.goal != goals[0]:
            driver.goal, driver._arrived = goals[0], False
        return original(driver, now)


@mutant('drive: overshoot',
        'The robot steers by the pose that it sees, and not by where its commands will have led',
        *DRIVE, follows=('drive: goal', 'drive: straight', 'drive: rolling', 'drive: stem',
                         'frames: base_link', 'carry', 'tip off'),
        why='a robot that hunts about its goal rolls to and fro, in ever new directions, and is '
            'never at rest')
def hunts(graph: Graph) -> None:
    @wrap(driving.CommandPath, 'predict')
    def predict(original: Any, path: Any, now: float) -> tuple[float, float]:
        return path.pose.x, path.pose.y


@mutant('drive: speed', 'Commands are 5 % faster than max_velocity', *DRIVE)
def too_fast(graph: Graph) -> None:
    @after_start(TurtleRobot)
    def speed_up(node: Any) -> None:
        node.driver.max_velocity *= 1.05


@mutant('drive: rolling', 'The wheel turns 10 % too far', *DRIVE)
def slipping_wheel(graph: Graph) -> None:
    @on_publish(TurtleRobot, 'joint_publisher')
    def publish(original: Any, joints: Any) -> None:
        joints.position[1] *= 1.1
        original(joints)


@mutant('drive: stem', 'The stem points 20 degrees beside the motion', *DRIVE)
def crooked_stem(graph: Graph) -> None:
    @on_publish(TurtleRobot, 'joint_publisher')
    def publish(original: Any, joints: Any) -> None:
        joints.position[0] += 0.35
        original(joints)


@mutant('tilt', 'The platform tilts by half of what is asked for', *TILT)
def half_tilt(graph: Graph) -> None:
    @wrap(TurtleRobot, 'on_tilt')
    def on_tilt(original: Any, node: Any, message: Any) -> None:
        message.angle /= 2.0
        original(node, message)


@mutant('tilt', 'The platform ignores angles below 0', *TILT)
def one_sided_tilt(graph: Graph) -> None:
    @wrap(TurtleRobot, 'on_tilt')
    def on_tilt(original: Any, node: Any, message: Any) -> None:
        if message.angle >= 0.0:
            original(node, message)


# --------------------------------------------------------------------------- markers and services

@mutant('walls: size', 'The walls are around 10 m x 10 m', *REST)
def small_arena(graph: Graph) -> None:
    @wrap(arena, 'walls')
    def walls(original: Any, size: float, height: float) -> Any:
        return original(10.0, height)


@mutant('walls: to be seen', 'The walls are published once, for those who listen then', *REST)
def walls_once(graph: Graph) -> None:
    @wrap(Arena, 'create_publisher')
    def create_publisher(original: Any, node: Any, kind: Any, topic: str, qos: Any,
                         **options: Any) -> Any:
        publisher = original(node, kind, topic, 10 if topic == 'walls' else qos, **options)
        if topic == 'walls':
            def look() -> None:
                if publisher.get_subscription_count():
                    timer.cancel()
                    publish(said[0])

            publish, said = publisher.publish, []
            publisher.publish = said.append
            timer = node.create_timer(0.1, look)
        return publisher


@mutant('brick marker: to be seen',
        "The brick's marker is published when the brick does something else, for those who listen",
        *REST, *CATCH)
def brick_marker_once(graph: Graph) -> None:
    replace(arena, 'MARKER_PERIOD', 1e6)

    @wrap(Arena, 'create_publisher')
    def create_publisher(original: Any, node: Any, kind: Any, topic: str, qos: Any,
                         **options: Any) -> Any:
        return original(node, kind, topic, 10 if topic == 'brick_marker' else qos, **options)


@mutant('brick marker: place', "The brick's marker is 10 cm from the brick", *CATCH)
def marker_beside_the_brick(graph: Graph) -> None:
    @wrap(arena, 'brick_marker')
    def brick_marker(original: Any, *args: Any) -> Any:
        marker = original(*args)
        marker.pose.position.x = 0.1
        return marker


@mutant('markers: frames', "The brick's marker has the orientation (0, 0, 0, 0)", *REST)
def no_orientation(graph: Graph) -> None:
    @wrap(arena, 'brick_marker')
    def brick_marker(original: Any, *args: Any) -> Any:
        marker = original(*args)
        marker.pose.orientation.w = 0.0
        return marker


@mutant('place', 'The brick is placed 5 cm from where it is asked for', *CATCH)
def placed_beside(graph: Graph) -> None:
    @wrap(Arena, 'on_place')
    def on_place(original: Any, node: Any, request: Any, response: Any) -> Any:
        request.location.x += 0.05
        return original(node, request, response)


@mutant('place', 'There is no service place', *CATCH)
def no_place(graph: Graph) -> None:
    @wrap(Arena, 'create_service')
    def create_service(original: Any, node: Any, kind: Any, name: str, serve: Any,
                       **options: Any) -> Any:
        return original(node, kind, 'put' if name == 'place' else name, serve, **options)


@mutant('drop', 'The brick falls a second after the answer', *CATCH)
def late_drop(graph: Graph) -> None:
    @wrap(Arena, 'on_drop')
    def on_drop(original: Any, node: Any, request: Any, response: Any) -> Any:
        in_s(node, 1.0, lambda: original(node, request, Trigger.Response()))
        response.success = True
        return response


@mutant('drop', 'The drop is refused', *CATCH)
def refused_drop(graph: Graph) -> None:
    @wrap(Arena, 'on_drop')
    def on_drop(original: Any, node: Any, request: Any, response: Any) -> Any:
        response.success, response.message = False, 'not today'
        return response


# ------------------------------------------------------------------------------------- the brick

@mutant('brick: hovers', 'The brick drifts at its start, until it is placed', *REST)
def drifting_brick(graph: Graph) -> None:
    @wrap(World, 'step')
    def step(original: Any, world: Any) -> None:
        if world.phase is Phase.HOVERING and world.brick[:2] != placed:
            x, y, z = world.brick
            world._brick = (x + 0.01 * world._dt, y, z)
        original(world)

    placed = (0.0, 0.0)

    @wrap(Arena, 'on_place')
    def on_place(original: Any, node: Any, request: Any, response: Any) -> Any:
        nonlocal placed
        placed = (request.location.x, request.location.y)
        return original(node, request, response)


@mutant('fall: acceleration', 'The brick falls with 9.2 m/s^2', *CATCH, follows=('text: time',),
        why='the catcher takes it for one fall after another, and says so of each')
def weak_gravity(graph: Graph) -> None:
    @wrap(World, '_fall')
    def fall(original: Any, world: Any) -> None:
        gravity, world._gravity = world._gravity, 9.2
        original(world)
        world._gravity = gravity


@mutant('fall: course', 'The brick drifts to the side while it falls', *CATCH)
def crooked_fall(graph: Graph) -> None:
    @wrap(World, '_fall')
    def fall(original: Any, world: Any) -> None:
        original(world)
        if world.phase is Phase.FALLING and world.fall_time > 0.05:
            x, y, z = world.brick
            world._brick = (x + 0.024 * world._dt, y, z)


@mutant('fall: ground', 'The brick falls until its center is on the ground', *REFUSE, JUST_OUT)
def into_the_ground(graph: Graph) -> None:
    @wrap(World, '_fall')
    def fall(original: Any, world: Any) -> None:
        original(world)
        if world.phase is Phase.GROUNDED:
            x, y, _ = world.brick
            world._brick = (x, y, 0.0)


@mutant('fall: platform',
        'The brick stops 5 cm above the platform; the catcher takes that for lying on it', *CATCH)
def above_the_platform(graph: Graph) -> None:
    replace(catching, 'ON_PLATFORM', 0.1)

    @after_start(Arena)
    def lift(node: Any) -> None:
        node.world.thickness += 0.05


@mutant('brick: rides', 'The brick creeps along the level platform with 6 cm/s', *CARRY)
def creeping_brick(graph: Graph) -> None:
    @wrap(World, '_ride')
    def ride(original: Any, world: Any, platform: Any) -> None:
        if platform.is_level:
            u, v = world._place
            world._place = (u + 0.06 * world._dt, v)
        original(world, platform)


@mutant('brick: rides', 'The brick stays where it has landed when the robot drives off',
        *CARRY, follows=('carry', 'tip off', 'again', 'slide: end'),
        why='what is left behind in the air is not carried, and nobody tilts it off')
def brick_left_behind(graph: Graph) -> None:
    @wrap(World, '_ride')
    def ride(original: Any, world: Any, platform: Any) -> None:
        """Do nothing."""

    replace(World, 'on_platform', property(lambda world: None))


@mutant('brick: angle', 'The brick stays level when the platform tilts', *CATCH)
def flat_brick(graph: Graph) -> None:
    replace(World, 'orientation', property(lambda world: IDENTITY))
    replace(World, 'on_platform', property(lambda world: None))


@mutant('slide: law', 'The brick slides with half of the acceleration', *CATCH)
def rough_platform(graph: Graph) -> None:
    @wrap(World, '_ride')
    def ride(original: Any, world: Any, platform: Any) -> None:
        gravity, world._gravity = world._gravity, world._gravity / 2.0
        original(world, platform)
        world._gravity = gravity


@mutant('slide: end', 'The brick floats when its center has left the platform', *CATCH)
def floats_early(graph: Graph) -> None:
    replace(World, '_is_clear', lambda world: hypot(*world._place) > world._radius)


@mutant('slide: end', 'The brick floats when it is 30 cm beside the platform', *CATCH)
def floats_late(graph: Graph) -> None:
    replace(World, '_is_clear', lambda world: distance_to_rectangle(
        *world._place, world._relative_yaw, *world._size[:2]) > world._radius + 0.3)


@mutant('brick: floats', 'The floating brick goes where the platform goes', *CATCH)
def tagging_along(graph: Graph) -> None:
    last: list[Any] = [None]

    @wrap(World, 'step')
    def step(original: Any, world: Any) -> None:
        original(world)
        platform = world.platform
        if world.phase is Phase.FLOATING and platform and last[0]:
            x, y, z = (a + b - c for a, b, c in zip(
                world.brick, platform.pose.position, last[0].pose.position))
            world._brick = (x, y, z)
        last[0] = platform


# ----------------------------------------------------------------------------------- the catcher

@mutant('verdict: in time', 'The text comes when the brick is down', *REFUSE)
def late_verdict(graph: Graph) -> None:
    @wrap(CatcherNode, 'say_unreachable')
    def say_unreachable(original: Any, node: Any, position: Any) -> None:
        in_s(node, 0.8, lambda: original(node, position))


@mutant('verdict: out of reach', 'Nobody ever says Unreachable',
        *REFUSE, *CATCH,
        follows=('verdict: in time', 'verdict: kept', 'text: kind', 'text: time'),
        why='a verdict that is not given comes neither in time nor true, and there is no text')
def never_unreachable(graph: Graph) -> None:
    replace(CatcherNode, 'say_unreachable', lambda node, position: None)


@mutant('verdict: out of reach', 'The catcher thinks that it has 0.15 s more',
        *REFUSE, JUST_OUT, follows=('verdict: kept',),
        why='who drives in vain has promised what he does not keep')
def optimist(graph: Graph) -> None:
    replace(reaching, 'COMMAND_LATENCY', -0.15)


@mutant('verdict: in reach', 'The catcher wants 0.45 s more than it needs', *CATCH, JUST_IN)
def pessimist(graph: Graph) -> None:
    replace(reaching, 'COMMAND_LATENCY', 0.55)


@mutant('verdict: in reach', 'Each brick is called Unreachable',
        *CATCH, *CARRY, follows=('verdict: kept',),
        why='the brick that falls on the robot is caught all the same')
def always_unreachable(graph: Graph) -> None:
    @wrap(catching, 'reach')
    def reach(original: Any, *args: Any) -> Any:
        return original(*args)._replace(reachable=False, reason='never')


@mutant('verdict: kept',
        'The robot does not set off for a brick that it has less than 0.6 s to spare for',
        DOUBTFUL, *CATCH, reaction=0.8)
def broken_promise(graph: Graph) -> None:
    @wrap(CatcherNode, 'explain')
    def explain(original: Any, node: Any, decision: Any) -> None:
        original(node, decision)
        node.astray = decision.reachable and decision.margin < 0.6

    @wrap(CatcherNode, 'drive_to')
    def drive_to(original: Any, node: Any, x: float, y: float) -> None:
        original(node, *(catching.CENTER if getattr(node, 'astray', False) else (x, y)))


@mutant('text: kind', 'The text says "unreachable!"', *REFUSE)
def other_text(graph: Graph) -> None:
    @on_publish(CatcherNode, 'marker_publisher')
    def publish(original: Any, marker: Any) -> None:
        marker.text = 'unreachable!'
        original(marker)


@mutant('text: time', 'The text lasts for 5 s', *REFUSE)
def long_text(graph: Graph) -> None:
    @on_publish(CatcherNode, 'marker_publisher')
    def publish(original: Any, marker: Any) -> None:
        marker.lifetime.sec = 5
        original(marker)


@mutant('carry', 'The brick is tipped off a meter from the center', *CATCH)
def tips_elsewhere(graph: Graph) -> None:
    replace(catching, 'CENTER', (catching.CENTER[0] + 1.0, catching.CENTER[1]))


@mutant('tip off', 'The robot carries the brick to the center and keeps it',
        *CATCH, follows=('carry',),
        why='the platform is never tilted, neither at the center nor elsewhere')
def never_tilted(graph: Graph) -> None:
    @on_publish(CatcherNode, 'tilt_publisher')
    def publish(original: Any, tilt: Any) -> None:
        """Say nothing."""


@mutant('tip off', 'The brick sticks to the tilted platform',
        *CATCH, follows=('slide: law',),
        why='a brick that sticks does not slide as it should')
def sticking_brick(graph: Graph) -> None:
    @wrap(World, '_ride')
    def ride(original: Any, world: Any, platform: Any) -> None:
        gravity, world._gravity = world._gravity, 0.0
        original(world, platform)
        world._gravity = gravity


@mutant('again', 'The platform stays tilted until the next brick falls', *CATCH)
def stays_tilted(graph: Graph) -> None:
    @wrap(catching.Ramp, 'move')
    def move(original: Any, ramp: Any, now: int, goal: float) -> bool:
        return goal != 0.0 and original(ramp, now, goal)


# ------------------------------------------------------------------------------- how it is judged

class ShortTrial(trial.Trial):
    """The parts of the referee's program that show a fault."""

    def __init__(self, needs: Collection[Any], *args: Any, **options: Any) -> None:
        """
        Ask for nothing yet.

        :param needs: what is asked for
        :param args: as for Trial
        :param options: as for Trial
        """
        super().__init__(*args, **options)
        self.patience = trial.MEETING
        for stage in STAGES:
            if stage not in needs:
                setattr(self, stage, lambda: None)
        trial.DROPS = tuple(drop for number, drop in enumerate(trial.DROPS) if number in needs)


def compose(one: Mutant) -> None:
    """Be the graph, until the process is ended."""
    note_interrupts()
    try:
        with Graph(namespace=NAMESPACE, quiet=True) as graph:
            one.change(graph)
            for add in ('turtlesim', 'robot_state_publisher', 'robot', 'arena', 'catcher'):
                getattr(graph, f'add_{add}')()
            graph.spin_until(lambda: False, inf, 'nothing')
    except KeyboardInterrupt:
        pass


def judge(one: Mutant, needs: Sequence[Any]) -> None:
    """Print what the referee finds, as JSON."""
    setattr(referee, 'Trial', partial(ShortTrial, needs))
    options, command = referee.parse([
        '--namespace', NAMESPACE, '--reaction', str(one.reaction),
        '--', sys.executable, __file__, '--graph', one.name])
    record = referee.watch(Profile(), options, command, lambda text: None)
    print(json.dumps({judgement.name: (judgement.mark, judgement.measured)
                      for judgement in referee.judge(record)}))


class Outcome(NamedTuple):
    """What the referee has found of a mutant."""

    mutant: Mutant
    fault: str
    """What is not as it should be; empty if all is."""
    broken: dict[str, str]
    seconds: float


def try_out(one: Mutant, needs: Sequence[Any]) -> Outcome:
    """Have the referee judge a mutant by parts of its program, again if the machine was busy."""
    for _ in range(ATTEMPTS):
        outcome = try_once(one, needs)
        if not outcome.fault or one.row in outcome.broken:
            break
    return outcome


def try_once(one: Mutant, needs: Sequence[Any]) -> Outcome:
    """Have the referee judge a mutant, in processes and a ROS domain of their own."""
    begin = monotonic()
    with reserved_domain() as domain:
        process = subprocess.run(
            [sys.executable, __file__, '--judge', one.name, *map(str, needs)],
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain),
                 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'},
            capture_output=True, text=True, timeout=PATIENCE)
    seconds = monotonic() - begin
    if process.returncode:
        said = (process.stderr.strip() or 'nothing').splitlines()[-1]
        return Outcome(one, f'the referee ended with {process.returncode}: {said}', {}, seconds)
    marks = json.loads(process.stdout.splitlines()[-1])
    broken = {name: measured for name, (mark, measured) in marks.items() if mark == BROKEN}
    too_much = sorted(set(broken) - {one.row, *one.follows})
    fault = ''
    if one.row and one.row not in broken:
        fault = f'not found: {one.row} is {" ".join(marks[one.row])}'
    elif too_much:
        fault = f'{too_much[0]} does not follow: {broken[too_much[0]]}'
    return Outcome(one, fault, broken, seconds)


def tell(outcome: Outcome) -> None:
    """Print a line of the table."""
    one = outcome.mutant
    print(f'{"FAULT" if outcome.fault else "ok":5}  {one.name:28} {outcome.seconds:5.1f} s  '
          f'{one.row or "all kept"}: {outcome.fault or outcome.broken.get(one.row, "")}',
          flush=True)
    for name in sorted(set(outcome.broken) - {one.row}):
        print(f'{"":15} also {name}: {outcome.broken[name]}')


def main(args: Sequence[str] | None = None) -> int:
    """Try out mutants; return the exit status."""
    parser = argparse.ArgumentParser(description='Try out mutants of the graph on the referee.')
    parser.add_argument('words', nargs='*', help='parts of names; all mutants without them')
    parser.add_argument('--full', action='store_true', help="the referee's whole program for each")
    parser.add_argument('--list', action='store_true', help='say what there is')
    parser.add_argument('--at-a-time', type=int, default=2, metavar='N')
    parser.add_argument('--graph', action='store_true', help=argparse.SUPPRESS)
    parser.add_argument('--judge', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args(args)
    if options.graph or options.judge:
        one = next(one for one in MUTANTS if one.name == options.words[0])
        if options.graph:
            compose(one)
        else:
            judge(one, [int(need) if need.isdigit() else need for need in options.words[1:]])
        return 0
    chosen = [one for one in MUTANTS if not options.words
              or any(word in one.name for word in options.words)]
    if options.list or not chosen:
        for one in MUTANTS:
            print(f'{one.name:28} {one.row or "all kept"}: {one.words}')
            if one.follows:
                print(f'{"":28} also {", ".join(one.follows)}: {one.why}')
        return 0 if chosen else 2
    faults = 0
    with ThreadPoolExecutor(options.at_a_time) as pool:
        everything = (*STAGES, *range(len(trial.DROPS)))
        for outcome in pool.map(
                lambda one: try_out(one, everything if options.full else one.needs), chosen):
            tell(outcome)
            faults += bool(outcome.fault)
    print(f'{len(chosen) - faults} of {len(chosen)} as they should be')
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main())
