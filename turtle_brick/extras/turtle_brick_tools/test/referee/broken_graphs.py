# SPDX-License-Identifier: Apache-2.0
"""Right graphs and graphs with one fault each: the nodes of turtle_brick, changed in one way."""

from collections import ChainMap
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from math import pi, radians, sqrt
from operator import attrgetter
from typing import Any
from xml.etree import ElementTree

from rclpy.parameter import Parameter
from turtle_brick_tools.graph import Graph
from turtle_graph.referee.referee import RULES
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET, OPEN

ROBOT, ARENA, CATCHER, PUBLISHER = 'TurtleRobot', 'Arena', 'CatcherNode', 'RobotStatePublisher'
"""Class names of the nodes."""
RATES = ('cmd_vel', 'joint_states', 'odom')
STEM, WHEEL, TILT = range(3)
"""Indices of the joints in joint_states."""

Change = Callable[..., Any]
"""A function that receives a message, and a function that passes the message on."""


@dataclass(frozen=True)
class Fault:
    """A graph that is broken in one way."""

    name: str
    fails: Sequence[str]  # Requirements that must fail. All others may only follow from them.
    node: str = ''  # Class name of the broken node.
    changes: Mapping[str, Change] = field(default_factory=dict)  # By action: 'publish odom'.
    parameters: Mapping[str, float] = field(default_factory=dict)
    urdf: tuple[str, str, str] | None = None  # Path of an element, attribute and wrong value.
    firm: bool = False  # Whether the fault has nothing to do with speed.
    opens: Sequence[str] = ()  # Requirements that cannot be judged, except 'names: relative'.


class ChangingPublisher:
    """A publisher that passes a copy of each message to a change."""

    def __init__(self, publisher: Any, change: Change) -> None:
        self.publisher = publisher
        self.change = change

    def publish(self, message: Any) -> None:
        self.change(deepcopy(message), self.publisher.publish)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.publisher, name)


def broken(node_type: type[Any], changes: Mapping[str, Change]) -> type[Any]:
    """Return a subclass of a node type that changes published messages and services."""
    class Broken(node_type):  # type: ignore[misc]

        def create_publisher(self, kind: Any, topic: str, *args: Any, **options: Any) -> Any:
            publisher = super().create_publisher(kind, topic, *args, **options)
            change = changes.get(f'publish {topic}')
            return ChangingPublisher(publisher, change) if change else publisher

        def create_service(self, kind: Any, name: str, callback: Change, *args: Any,
                           **options: Any) -> Any:
            if change := changes.get(f'serve {name}'):
                callback = partial(change, callback)
            return super().create_service(kind, name, callback, *args, **options)

    return Broken


class BrokenGraph(Graph):
    """A graph with faults."""

    def __init__(self, faults: Sequence[Fault], domain_id: int | None = None) -> None:
        super().__init__(domain_id, quiet=True)
        self.faults = faults

    def add(self, node_type: type[Any], *ros_arguments: str, **options: Any) -> Any:
        faults = [fault for fault in self.faults if fault.node == node_type.__name__]
        if faults:
            node_type = broken(node_type, ChainMap(*(dict(fault.changes) for fault in faults)))
            options['parameter_overrides'] = [
                Parameter(name, value=value) for fault in faults
                for name, value in fault.parameters.items()]
        return super().add(node_type, *ros_arguments, **options)

    def add_nodes(self) -> None:
        self.add_turtlesim()
        self.add_robot_state_publisher()
        self.add_robot()
        self.add_arena()
        self.add_catcher()

    def robot_parameters(self) -> dict[str, Any]:
        parameters = super().robot_parameters()
        for path, attribute, value in (fault.urdf for fault in self.faults if fault.urdf):
            robot = ElementTree.fromstring(parameters['robot_description'])
            for element in robot.iterfind(path):
                element.set(attribute, value)
            parameters['robot_description'] = ElementTree.tostring(robot, 'unicode')
        return parameters


def edit(change: Callable[[Any], Any]) -> Change:
    """Return a change that modifies a message and forwards it."""
    def edit_and_forward(message: Any, forward: Change) -> None:
        change(message)
        forward(message)
    return edit_and_forward


def put(path: str, function: Callable[[Any], Any]) -> Change:
    """Return a change of a field, such as 'pose.position.x', by a function."""
    parent, _, name = path.rpartition('.')

    def change(message: Any) -> None:
        owner = attrgetter(parent)(message) if parent else message
        setattr(owner, name, function(getattr(owner, name)))
    return edit(change)


def joint(number: int, factor: float, offset: float = 0.0) -> dict[str, Change]:
    """Change the position of a joint."""
    def change(message: Any) -> None:
        message.position[number] = message.position[number] * factor + offset
    return {'publish joint_states': edit(change)}


def keep(part: int, of: int) -> Change:
    """Forward only some messages."""
    numbers = count()
    return lambda message, forward: forward(message) if next(numbers) % of < part else None


def tilt_about_x(message: Any) -> None:
    for transform in message.transforms:
        if transform.child_frame_id == 'platform':
            rotation = transform.transform.rotation
            rotation.x, rotation.y = rotation.y, rotation.x


def stay_behind() -> Change:
    """Leave the brick where it has landed."""
    last: list[Any] = []

    def change(message: Any) -> None:
        for transform in message.transforms:
            if transform.header.frame_id == 'platform':
                transform.header.frame_id = 'world'
                transform.transform = last[0]
            last[:] = [transform.transform]
    return edit(change)


def level(message: Any) -> None:
    for transform in message.transforms:
        if transform.header.frame_id == 'world':
            rotation = transform.transform.rotation
            rotation.x, rotation.y, rotation.z, rotation.w = 0.0, 0.0, 0.0, 1.0


def shift_walls(message: Any) -> None:
    for marker in message.markers:
        marker.pose.position.x += 0.5


def split_walls(message: Any) -> None:
    """Build each wall of fifty boxes."""
    pieces = []
    for wall in message.markers:
        axis = 'x' if wall.scale.x > wall.scale.y else 'y'
        length, start = getattr(wall.scale, axis) / 50, getattr(wall.pose.position, axis)
        for number in range(50):
            piece = deepcopy(wall)
            piece.id = 50 * wall.id + number
            setattr(piece.scale, axis, length)
            setattr(piece.pose.position, axis, start + (number - 24.5) * length)
            pieces.append(piece)
    message.markers = pieces


def appear_when_placed() -> dict[str, Change]:
    """Broadcast no brick until one is placed."""
    placed: list[bool] = []

    def serve(callback: Change, request: Any, response: Any) -> Any:
        placed.append(True)
        return callback(request, response)
    return {'publish /tf': lambda message, forward: forward(message) if placed else None,
            'serve place': serve}


def other_markers() -> dict[str, Change]:
    """Show the brick in its parent frame, without a namespace, and turn the boxes of the walls."""
    shown: list[tuple[Any, Change]] = []

    def show(message: Any, forward: Change) -> None:
        message.ns, message.frame_locked = '', False
        shown[:] = [(message, forward)]

    def move(message: Any, forward: Change) -> None:
        forward(message)
        for transform in message.transforms if shown else ():
            marker, publish = shown[0]
            marker.header = transform.header
            place, there = marker.pose.position, transform.transform.translation
            place.x, place.y, place.z = there.x, there.y, there.z
            marker.pose.orientation = transform.transform.rotation
            publish(marker)

    def turn_walls(message: Any) -> None:
        for marker in message.markers:
            size, rotation = marker.scale, marker.pose.orientation
            size.x, size.y = size.y, size.x
            rotation.z = rotation.w = sqrt(0.5)
    return {'publish brick_marker': show, 'publish /tf': move, 'publish walls': edit(turn_walls)}


def respond_late(callback: Change, request: Any, response: Any) -> Any:
    """Respond 20 ms after the brick has begun to fall."""
    arena: Any = callback.__self__  # type: ignore[attr-defined]
    place, result = arena.world.brick, callback(request, response)
    while result.success and arena.world.brick[2] > place[2] - 0.002:
        arena.on_timer()
    return result


FAULTS = (
    Fault('none', ()),
    Fault('no brick before the first place', (), ARENA, appear_when_placed()),
    Fault('other markers', (), ARENA, other_markers()),
    Fault('walls of many boxes', (), ARENA, {'publish walls': edit(split_walls)}),
    Fault('brick broadcast at 100 Hz', (), ARENA, {'publish /tf': keep(2, 5)},
          opens=['rate: brick']),
    Fault('wheel backward', ['drive: rolling'], ROBOT, joint(WHEEL, -1.0), firm=True),
    Fault('wheel ignores its radius', ['drive: rolling'], ROBOT, joint(WHEEL, 0.2)),
    Fault('stem backward', ['drive: rolling'], ROBOT, joint(STEM, 1.0, pi), firm=True),
    Fault('stem 30 degrees off', ['drive: stem'], ROBOT, joint(STEM, 1.0, radians(30.0)),
          firm=True),
    Fault('tilt too small', ['tilt'], ROBOT, joint(TILT, 0.9)),
    Fault('tilt about x', ['tilt'], PUBLISHER, {'publish /tf': edit(tilt_about_x)}),
    Fault('joint with another name', ['joint_states: names'], ROBOT, {
        'publish joint_states': put('name', lambda names: ['stem', *names[1:]])}, firm=True),
    # The odometry also contains the twists of commands that are not published.
    Fault('90 Hz', ['odom: twist', *(f'rate: {name}' for name in ('base_link', *RATES))], ROBOT, {
        f'publish {topic}': keep(9, 10) for topic in ('/tf', *RATES)}),
    Fault('cmd_vel at 60 Hz', ['odom: twist', 'rate: cmd_vel'], ROBOT,
          {'publish cmd_vel': keep(3, 5)}),
    Fault('cmd_vel is not 0 at rest', ['cmd_vel: at rest'], ROBOT, {
        'publish cmd_vel': put('angular.z', lambda _: 1e-7)}, firm=True),
    Fault('odom mirrored', ['odom: pose'], ROBOT, {
        'publish odom': put('pose.pose.position.y', lambda y: -y)}, firm=True),
    Fault('odom without twist', ['odom: twist'], ROBOT, {
        'publish odom': put('twist.twist.linear', lambda linear: type(linear)())}, firm=True),
    Fault('odom without timestamps', ['frames: timestamps'], ROBOT, {
        'publish odom': put('header.stamp', lambda stamp: type(stamp)())}, firm=True),
    Fault('no cube', ['URDF: base_link'], urdf=(
        "link[@name='base_link']/visual/geometry/box", 'size', '0.3 0.3 0.2'), firm=True),
    Fault('two links in one color', ['URDF: colors'], urdf=(
        "link[@name='platform']/visual/material", 'name', 'green'), firm=True),
    Fault('wheel larger than configured', ['URDF: numbers'], urdf=(
        "link[@name='wheel']/visual/geometry/cylinder", 'radius', '0.22'), firm=True),
    Fault('gravity 5 % too large', ['fall: acceleration'], ARENA,
          parameters={'gravity_accel': 1.05 * 9.81}),
    Fault('drop before the response', ['drop: answer first'], ARENA, {'serve drop': respond_late}),
    Fault('brick not carried', ['brick: rides'], ARENA, {'publish /tf': stay_behind()}),
    Fault('brick level', ['brick: angle'], ARENA, {'publish /tf': edit(level)}, firm=True),
    Fault('walls 0.5 m off', ['walls: size'], ARENA, {'publish walls': edit(shift_walls)},
          firm=True),
    Fault('marker not at the brick', ['brick marker: place'], ARENA, {
        'publish brick_marker': put('pose.position.x', lambda x: x + 0.05)}),
    Fault('marker transparent', ['markers: frames'], ARENA, {
        'publish brick_marker': put('color.a', lambda _: 0.0)}, firm=True),
    Fault('text for 5 s', ['text: time'], CATCHER, {
        'publish catcher_marker': put('lifetime.sec', lambda _: 5)}, firm=True),
    Fault('other text', ['text: kind'], CATCHER, {
        'publish catcher_marker': put('text', str.lower)}, firm=True),
    Fault('no text', ['verdict: in time', 'verdict: out of reach'], CATCHER, {
        'publish catcher_marker': keep(0, 1)}),
    Fault('text for bricks in reach', ['verdict: in reach'], CATCHER,
          parameters={'command_latency': 0.6}))


def all_dependencies(name: str) -> set[str]:
    """Return the direct and indirect dependencies of a rule."""
    names = {rule.name: set(rule.depends_on) for rule in RULES}[name]
    return names.union(*map(all_dependencies, names))


def wrong_marks(fault: Fault, judgments: Iterable[Judgment], is_loaded: bool) -> list[str]:
    """
    Return the requirements with a wrong mark.

    Load may leave what is not firm open. What depends on an open requirement may then fail.
    Without load and faults, only what cannot be judged is open.
    """
    judged = {one.name: one for one in judgments}
    missing = [name for name in fault.fails if judged[name].mark == MET
               or judged[name].mark != FAILED and (fault.firm or not is_loaded)]
    missing += [name for name in fault.opens if judged[name].mark == MET]
    opened = [name for name in fault.fails if judged[name].mark == OPEN]
    return [*(f'missing: {name} ({judged[name].measured})' for name in missing), *(
        f'false: {one.name} ({one.measured})' for one in judged.values()
        if one.mark == FAILED and not one.follows and one.name not in fault.fails
        and not all_dependencies(one.name).intersection(opened)), *(
        f'open: {one.name} ({one.measured})' for one in judged.values() if one.mark == OPEN
        and not (fault.fails or is_loaded or one.name in ('names: relative', *fault.opens)))]
