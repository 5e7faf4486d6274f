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
Judge graphs that are broken in one way, and check which requirements the referee fails.

    python3 broken_graphs.py [--only NAME] [--busy 4] [--results FILE]

Each graph consists of the nodes of turtle_brick. One node has other parameters, or the messages
that it sends and receives are changed. The program prints one line per graph and stores correct
results in a file, so a second run continues where the first run ended.
"""

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from inspect import isawaitable
from itertools import count
import json
from math import dist, inf, pi, radians, sin
from operator import attrgetter
import os
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
from threading import Timer
from time import monotonic
from types import coroutine
from typing import Any
from xml.etree import ElementTree

from rclpy.parameter import Parameter
from turtle_brick.core.parameters import load
from turtle_brick_tools.graph import Graph
from turtle_graph.client.geometry import CENTER
from turtle_graph.client.processes import Process
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import nanoseconds_of, SECONDS_PER_NS
from turtle_graph.client.spinning import handle_interrupts
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET
import yaml

ROBOT, ARENA, CATCHER, PUBLISHER = 'TurtleRobot', 'Arena', 'CatcherNode', 'RobotStatePublisher'
"""Class names of the nodes."""
REFEREE = 'import sys; from turtle_graph.referee.referee import main; sys.exit(main())'
"""Python code that runs the referee."""
TIME_LIMIT = 600.0
"""Timeout (s) for judging one graph."""
WHEEL, STEM, TILT = 1, 0, 2
"""Indices of the joints in joint_states."""

Forward = Callable[[Any], Any]
Change = Callable[[Any, Forward], Any]
"""A function that receives a message and passes the message on, changed or not, now or later."""


@dataclass(frozen=True)
class Fault:
    """A graph that is broken in one way."""

    name: str
    fails: Sequence[str]  # Requirements that must fail. All others may only follow from them.
    node: str = ''  # Class name of the broken node.
    changes: Callable[[], Mapping[str, Change]] = dict  # By action and name, as 'publish odom'.
    parameters: Mapping[str, float] = field(default_factory=dict)
    urdf: tuple[str, str, str] | None = None  # Path of an element, attribute and wrong value.
    firm: bool = False  # Whether the fault has nothing to do with speed.


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
    """Return a subclass of a node type that changes messages and service requests."""
    class Broken(node_type):  # type: ignore[misc]

        def create_publisher(self, kind: Any, topic: str, *args: Any, **options: Any) -> Any:
            publisher = super().create_publisher(kind, topic, *args, **options)
            change = changes.get(f'publish {topic}')
            return ChangingPublisher(publisher, change) if change else publisher

        def create_subscription(self, kind: Any, topic: str, callback: Forward, *args: Any,
                                **options: Any) -> Any:
            if change := changes.get(f'receive {topic}'):
                callback = partial(change, forward=callback)
            return super().create_subscription(kind, topic, callback, *args, **options)

        def create_service(self, kind: Any, name: str, callback: Callable[[Any, Any], Any],
                           *args: Any, **options: Any) -> Any:
            async def serve(request: Any, response: Any) -> Any:
                result = change(request, lambda changed: callback(changed, response))
                return await result if isawaitable(result) else result

            change = changes.get(f'serve {name}')
            return super().create_service(
                kind, name, serve if change else callback, *args, **options)

    return Broken


class BrokenGraph(Graph):
    """A graph with one fault."""

    def __init__(self, fault: Fault, domain_id: int | None = None) -> None:
        super().__init__(domain_id, quiet=True)
        self.fault = fault

    def add(self, node_type: type[Any], *ros_arguments: str, **options: Any) -> Any:
        if node_type.__name__ == self.fault.node:
            node_type = broken(node_type, self.fault.changes())
            options['parameter_overrides'] = [
                Parameter(name, value=value) for name, value in self.fault.parameters.items()]
        return super().add(node_type, *ros_arguments, **options)

    def add_nodes(self) -> None:
        self.add_turtlesim()
        self.add_robot_state_publisher()
        self.add_robot()
        self.add_arena()
        self.add_catcher()

    def robot_parameters(self) -> dict[str, Any]:
        parameters = super().robot_parameters()
        if self.fault.urdf is not None:
            path, attribute, value = self.fault.urdf
            robot = ElementTree.fromstring(parameters['robot_description'])
            for element in robot.iterfind(path):
                element.set(attribute, value)
            parameters['robot_description'] = ElementTree.tostring(robot, 'unicode')
        return parameters


def edit(change: Callable[[Any], Any]) -> Change:
    """Return a change that modifies a message and forwards it."""
    def edit_and_forward(message: Any, forward: Forward) -> Any:
        change(message)
        return forward(message)
    return edit_and_forward


def put(path: str, function: Callable[[Any], Any]) -> Callable[[Any], None]:
    """Return a function that replaces a field, such as 'pose.position.x', by a function of it."""
    parent, _, name = path.rpartition('.')

    def change(message: Any) -> None:
        owner = attrgetter(parent)(message) if parent else message
        setattr(owner, name, function(getattr(owner, name)))
    return change


def joint(number: int, factor: float, offset: float = 0.0) -> dict[str, Change]:
    """Change the position and the velocity of a joint."""
    def change(message: Any) -> None:
        message.position[number] = message.position[number] * factor + offset
        message.velocity[number] *= factor
    return {'publish joint_states': edit(change)}


def keep(part: int, of: int) -> Change:
    """Forward only some messages."""
    numbers = count()
    return lambda message, forward: forward(message) if next(numbers) % of < part else None


def markers(change: Callable[[Any], None], topic: str = 'catcher_marker') -> dict[str, Change]:
    return {f'publish {topic}': edit(change)}


def brick(change: Callable[[Any, bool], None]) -> dict[str, Change]:
    """Change each transform of the brick, depending on whether the brick is on the platform."""
    def change_all(message: Any) -> None:
        for transform in message.transforms:
            change(transform, transform.header.frame_id == 'platform')
    return {'publish /tf': edit(change_all)}


def tilt_about_x(message: Any) -> None:
    for transform in message.transforms:
        if transform.child_frame_id == 'platform':
            rotation = transform.transform.rotation
            rotation.x, rotation.y = rotation.y, rotation.x


def simulate_at(part: int, of: int) -> dict[str, Change]:
    """Publish only some transforms of the brick."""
    numbers = count()

    def change(message: Any, forward: Forward) -> None:
        message.transforms = [one for one in message.transforms if next(numbers) % of < part]
        forward(message)
    return {'publish /tf': change}


def silent_at_rest() -> Change:
    """Forward no command if the robot has been at rest for 0.5 s."""
    moved = [0.0]

    def change(message: Any, forward: Forward) -> None:
        if message.linear.x or message.linear.y:
            moved[0] = monotonic()
        if monotonic() - moved[0] < 0.5:
            forward(message)
    return change


def moving_odom() -> dict[str, Change]:
    """Move odom by 2 cm."""
    origin: list[Any] = []

    def append(message: Any) -> None:
        for start in origin:
            transform = deepcopy(start)
            transform.header.stamp = message.transforms[0].header.stamp
            transform.transform.translation.x += 0.02 * sin(0.3 * monotonic())
            message.transforms.append(transform)
    return {'publish /tf': edit(append),
            'publish /tf_static': lambda message, _: origin.extend(message.transforms)}


def stay_behind() -> dict[str, Change]:
    """Leave the brick where it has landed."""
    last: list[Any] = []

    def change(transform: Any, is_riding: bool) -> None:
        if is_riding:
            transform.header.frame_id = 'world'
            transform.transform = last[0]
        last[:] = [transform.transform]
    return brick(change)


def stick() -> dict[str, Change]:
    """Leave the brick at its place on the platform."""
    places: list[Any] = []

    def change(transform: Any, is_riding: bool) -> None:
        if is_riding:
            places[:] = places or [transform.transform.translation]
            transform.transform.translation = places[0]
        else:
            places.clear()
    return brick(change)


def drift() -> dict[str, Change]:
    """Move the brick by 5 mm/s after it has left the platform."""
    start: list[Any] = []

    def change(transform: Any, is_riding: bool) -> None:
        place = transform.transform.translation
        now, here = nanoseconds_of(transform.header.stamp) * SECONDS_PER_NS, deepcopy(place)
        if is_riding:
            start[:] = [now, None]
        elif start:
            start[1] = start[1] or here
            if here == start[1]:
                place.x += 0.005 * (now - start[0])
            else:
                start.clear()
    return brick(change)


def level(transform: Any, is_riding: bool) -> None:
    rotation = transform.transform.rotation
    if not is_riding:
        rotation.x, rotation.y, rotation.z, rotation.w = 0.0, 0.0, 0.0, 1.0


def shift_walls(message: Any) -> None:
    for marker in message.markers:
        marker.pose.position.x += 0.5


def level_late(message: Any, forward: Forward) -> None:
    """Level the platform 3.6 s late."""
    if message.angle == 0.0:
        Timer(3.6, forward, [message]).start()
    else:
        forward(message)


@coroutine
def pause() -> Any:
    """Let the executor do other work."""
    yield


async def respond_late(request: Any, forward: Forward) -> Any:
    """Respond 0.1 s after the request has been processed."""
    response, end = forward(request), monotonic() + 0.1
    while monotonic() < end:
        await pause()
    return response


def avoid_center(message: Any) -> None:
    place = message.pose.position
    if dist((place.x, place.y), CENTER) < 0.01:
        place.x += 1.0


def never_west(message: Any, forward: Forward) -> None:
    """Ignore goals in the western half of the arena."""
    if message.pose.position.x > CENTER[0] - 0.1:
        forward(message)


FAULTS = (
    Fault('none', ()),
    Fault('wheel backward', ['drive: rolling'], ROBOT, lambda: joint(WHEEL, -1.0), firm=True),
    Fault('wheel ignores its radius', ['drive: rolling'], ROBOT, lambda: joint(WHEEL, 0.2)),
    Fault('stem backward', ['drive: rolling'], ROBOT, lambda: joint(STEM, 1.0, pi), firm=True),
    Fault('stem 30 degrees off', ['drive: stem'], ROBOT,
          lambda: joint(STEM, 1.0, radians(30.0)), firm=True),
    Fault('tilt too small', ['tilt'], ROBOT, lambda: joint(TILT, 0.9), firm=True),
    Fault('tilt about x', ['tilt'], PUBLISHER, lambda: {'publish /tf': edit(tilt_about_x)},
          firm=True),
    Fault('joint with another name', ['joint_states: names'], ROBOT, lambda: {
        'publish joint_states': edit(put('name', lambda names: ['stem', *names[1:]]))
    }, firm=True),
    Fault('90 Hz', [f'rate: {name}' for name in ('base_link', 'cmd_vel', 'joint_states', 'odom')],
          ROBOT, lambda: {f'publish {topic}': keep(9, 10)
                          for topic in ('/tf', 'cmd_vel', 'joint_states', 'odom')}),
    Fault('cmd_vel at 60 Hz', ['rate: cmd_vel'], ROBOT, lambda: {'publish cmd_vel': keep(3, 5)}),
    Fault('no cmd_vel at rest', ['cmd_vel: at rest', 'rate: cmd_vel'], ROBOT,
          lambda: {'publish cmd_vel': silent_at_rest()}),
    Fault('cmd_vel is not 0 at rest', ['cmd_vel: at rest'], ROBOT, lambda: {
        'publish cmd_vel': edit(put('angular.z', lambda _: 1e-7))}, firm=True),
    Fault('odom mirrored', ['odom: pose'], ROBOT, lambda: {
        'publish odom': edit(put('pose.pose.position.y', lambda y: -y))}, firm=True),
    Fault('odom without twist', ['odom: twist'], ROBOT, lambda: {
        'publish odom': edit(put('twist.twist.linear', lambda linear: type(linear)()))},
          firm=True),
    Fault('odom without timestamps', ['frames: broadcasters'], ROBOT, lambda: {
        'publish odom': edit(put('header.stamp', lambda stamp: type(stamp)()))}, firm=True),
    Fault('odom moves', ['frames: odom'], ROBOT, moving_odom, firm=True),
    Fault('no goals in the west', ['drive: goal'], ROBOT,
          lambda: {'receive goal_pose': never_west}, firm=True),
    Fault('no cube', ['URDF: base_link'], urdf=(
        "link[@name='base_link']/visual/geometry/box", 'size', '0.3 0.3 0.2'), firm=True),
    Fault('two links in one color', ['URDF: colors'], urdf=(
        "link[@name='platform']/visual/material", 'name', 'green'), firm=True),
    Fault('wheel larger than configured', ['URDF: numbers'], urdf=(
        "link[@name='wheel']/visual/geometry/cylinder", 'radius', '0.22'), firm=True),
    Fault('gravity 5 % too large', ['fall: acceleration'], ARENA,
          parameters={'gravity_accel': 1.05 * 9.81}),
    Fault('physics at 100 Hz', ['rate: brick'], ARENA, lambda: simulate_at(2, 5)),
    Fault('drop before the response', ['drop: answer first'], ARENA,
          lambda: {'serve drop': respond_late}),
    Fault('brick placed too far east', ['place'], ARENA, lambda: {
        'serve place': edit(put('location.x', lambda x: x + 0.05))}, firm=True),
    Fault('brick not carried', ['brick: rides'], ARENA, stay_behind),
    Fault('brick does not slide', ['slide: law'], ARENA, stick),
    Fault('brick level', ['brick: angle'], ARENA, lambda: brick(level), firm=True),
    Fault('brick drifts', ['brick: floats'], ARENA, drift, firm=True),
    Fault('walls 0.5 m off', ['walls: size'], ARENA, lambda: markers(shift_walls, 'walls'),
          firm=True),
    Fault('marker not at the brick', ['brick marker: place'], ARENA, lambda: markers(
        put('pose.position.x', lambda x: x + 0.05), 'brick_marker'), firm=True),
    Fault('marker transparent', ['markers: frames'], ARENA, lambda: markers(
        put('color.a', lambda _: 0.0), 'brick_marker'), firm=True),
    Fault('text for 5 s', ['text: time'], CATCHER, lambda: markers(
        put('lifetime.sec', lambda _: 5)), firm=True),
    Fault('other text', ['text: kind'], CATCHER, lambda: markers(
        put('text', str.lower)), firm=True),
    Fault('no text', ['verdict: in time'], CATCHER, lambda: {
        'publish catcher_marker': keep(0, 1)}),
    Fault('text for bricks in reach', ['verdict: in reach'], CATCHER,
          parameters={'command_latency': 0.6}),
    Fault('not back to the center', ['carry'], CATCHER, lambda: {
        'publish goal_pose': edit(avoid_center)}),
    Fault('leveled late', ['again'], CATCHER, lambda: {'publish tilt': level_late}))

LOADED = ('none', 'wheel backward', 'stem 30 degrees off', 'odom without twist', 'walls 0.5 m off',
          'text for 5 s', 'gravity 5 % too large', '90 Hz', 'brick not carried')
"""Names of the graphs to judge beside busy loops: our own, five firm faults and three others."""


def wrong_marks(fault: Fault, judgments: Iterable[Judgment], is_loaded: bool) -> list[str]:
    """Return the requirements with a wrong mark. Load may leave what is not firm open."""
    judged = {one.name: one for one in judgments}
    missing = [name for name in fault.fails if judged[name].mark == MET
               or judged[name].mark != FAILED and (fault.firm or not is_loaded)]
    return [*(f'missing: {name} ({judged[name].measured})' for name in missing), *(
        f'false: {one.name} ({one.measured})' for one in judged.values()
        if one.mark == FAILED and not one.follows and one.name not in fault.fails)]


def run(fault: Fault) -> int:
    """Run a graph until Ctrl-C or SIGTERM, and return the exit status."""
    handle_interrupts()
    with BrokenGraph(fault) as graph, suppress(KeyboardInterrupt):
        graph.add_nodes()
        graph.spin_for(inf)
    return 0


def judge(fault: Fault, busy: int) -> list[str]:
    """Judge a graph beside busy loops, and return the requirements with a wrong mark."""
    with TemporaryDirectory() as directory, ExitStack() as stack:
        for _ in range(busy):
            stack.enter_context(Process([sys.executable, '-c', 'while True: pass']))
        results, profile = (Path(directory, name) for name in ('results.json', 'profile.yaml'))
        profile.write_text(yaml.safe_dump({'numbers': Profile.from_parameters(load()).numbers}))
        referee = stack.enter_context(Process([
            sys.executable, '-c', REFEREE, f'--json={results}', f'--profile={profile}', '--',
            sys.executable, __file__, '--run', fault.name]))
        with suppress(TimeoutError):
            referee.wait(TIME_LIMIT)
        found = json.loads(results.read_text())['requirements'] if results.exists() else []
        if not found:
            return [referee.exit_message()]
    return wrong_marks(fault, [Judgment(**one) for one in found], busy > 0)


def main() -> int:
    """Judge all graphs that are not in the results, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument('--only', metavar='NAME', choices=[fault.name for fault in FAULTS],
                        help='judge only one graph, even if the results contain the graph')
    parser.add_argument('--busy', type=int, default=0, metavar='COUNT',
                        help='number of busy loops beside the graph')
    parser.add_argument('--results', type=Path, default=Path('broken_graphs.json'),
                        metavar='FILE', help='file with correct results, which are not repeated')
    parser.add_argument('--run', choices=[fault.name for fault in FAULTS], help=argparse.SUPPRESS)
    options, status = parser.parse_args(), 0
    faults = {fault.name: fault for fault in FAULTS}
    if options.run:
        return run(faults[options.run])
    done = json.loads(options.results.read_text()) if options.results.exists() else {}
    for name in [options.only] if options.only else LOADED if options.busy else faults:
        key = f'{name}, {options.busy} busy loops'
        if key in done and not options.only:
            continue
        if faults[name].node == PUBLISHER and find_spec('robot_state_publisher') is None:
            print(f'– {key}: not judged, because the real robot_state_publisher cannot be changed')
            continue
        begin, wrong = monotonic(), judge(faults[name], options.busy)
        line = (f'{monotonic() - begin:3.0f} s, load {os.getloadavg()[0]:4.1f}: '
                f'{", ".join(faults[name].fails) or "no failure"}')
        print(f'{"✗" if wrong else "✔"} {key}: {line}', *wrong, sep='\n    ', flush=True)
        status = status or bool(wrong)
        if not wrong:
            done[key] = line
            options.results.write_text(json.dumps(done, indent=1), encoding='utf-8')
    return int(status)


if __name__ == '__main__':
    sys.exit(main())
