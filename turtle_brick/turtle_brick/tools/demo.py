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
demo: the whole graph in one process, and bricks that are dropped into it.

Without arguments two bricks are placed and dropped, one that can be caught and one that can't.
What happens is told as it happens, like a match on the radio, and summed up in the end. The
status is 0 only if everything went as it should: what was said to be reachable was caught,
carried to the center and tipped off, and what can be caught in time was not called Unreachable.
"""

import argparse
from collections.abc import Iterable
from collections.abc import Iterator
from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import cos
from math import hypot
from math import inf
from math import isfinite
from math import pi
from math import sin
import os
from random import Random
import sys
from time import monotonic
from typing import Any
from typing import NamedTuple

from ament_index_python.packages import get_package_share_path
from ament_index_python.packages import PackageNotFoundError
from geometry_msgs.msg import PoseStamped
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.catching import CENTER
from turtle_brick.catching import NANO
from turtle_brick.catching import State
from turtle_brick.driving import within_arena
from turtle_brick.frames import BASE_LINK
from turtle_brick.frames import BRICK
from turtle_brick.frames import WORLD
from turtle_brick.geometry import Vector
from turtle_brick.interrupts import INTERRUPTS
from turtle_brick.parameters import load
from turtle_brick.parameters import ParameterError
from turtle_brick.parameters import Parameters
from turtle_brick.physics import Phase
from turtle_brick.reaching import Decision
from turtle_brick.reaching import guaranteed_distance
from turtle_brick.reaching import resting_height
from turtle_brick.spinning import spare_collector
from turtle_brick.tools.domains import DomainError
from turtle_brick.tools.domains import DOMAINS
from turtle_brick.tools.domains import is_empty
from turtle_brick.tools.domains import keep_to_this_machine
from turtle_brick.tools.domains import LAST_DOMAIN
from turtle_brick.tools.domains import reserved_domain
from turtle_brick.tools.graph import Graph
from turtle_brick.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.view.polling import PollingNode
from turtle_brick_interfaces.srv import Place
from turtlesim.msg import Pose as TurtlePose
from visualization_msgs.msg import Marker

START_TIME = 30.0
"""How long (s) the graph may take to come up."""

DISCOVERY_TIME = 5.0
"""How long (s) somebody else in the domain has to be found: it takes some tenths of a second, or,
where the first announcement is lost, until the next one, which comes every 3 s."""

SQUARE = 2.0
"""Side (m) of the square that is driven to warm up."""

HOVERING_TIME = 1.0
"""How long (s) a brick hovers before it is dropped, for people to see it."""

NEAR_CENTER = 0.02
"""How far (m) from the center the robot may tilt."""


class CompanyError(DomainError):
    """Another robot is in the domain."""

    def __init__(self, doing: str) -> None:
        """
        Say so.

        :param doing: what it does
        """
        super().__init__(
            f'another robot is in ROS domain {os.environ.get("ROS_DOMAIN_ID") or 0} (somebody '
            f'{doing}): end it, or choose another ROS_DOMAIN_ID')


class Lookout(PollingNode):
    """Find another robot in the domain."""

    TOPICS = ('turtle1/pose', 'turtle1/cmd_vel', 'cmd_vel', 'odom')

    def __init__(self, **node_options: Any) -> None:
        """Begin to listen."""
        super().__init__('lookout', **node_options)
        self.frames: set[str] = set()
        self.poll(TFMessage, '/tf', self._hear, QoSProfile(depth=100))

    def _hear(self, message: TFMessage, info: dict[str, int]) -> None:
        """Take note of the frames that somebody broadcasts."""
        self.frames.update(transform.child_frame_id for transform in message.transforms)

    def found(self) -> str:
        """Return what somebody else does that a robot of ours does, or nothing."""
        self.fetch()
        return ', '.join([
            *(f'publishes {topic}' for topic in self.TOPICS if self.count_publishers(topic)),
            *(f'broadcasts {frame}' for frame in (BASE_LINK, BRICK) if frame in self.frames),
            *['serves drop'] * bool(self.count_services('drop'))])


class Referee(Node):
    """Place and drop the brick, and see where the turtle is."""

    def __init__(self, **node_options: Any) -> None:
        """Look at nothing yet."""
        super().__init__('demo', **node_options)
        self.place_client = self.create_client(Place, 'place')
        self.drop_client = self.create_client(Trigger, 'drop')
        self.pose = TurtlePose()
        self.pose_times: list[float] = []
        self.verdicts = 0
        self.goal_publisher = self.create_publisher(PoseStamped, 'goal_pose', 10)
        self.create_subscription(TurtlePose, 'turtle1/pose', self.on_pose, 100)
        self.create_subscription(Marker, 'catcher_marker', self.on_marker, 10)

    def on_pose(self, message: TurtlePose) -> None:
        """Take note of where the turtle is, and when."""
        self.pose = message
        self.pose_times.append(monotonic())

    def pose_rate(self) -> float:
        """Return the rate (Hz) of the poses heard so far."""
        times = self.pose_times
        return (len(times) - 1) / (times[-1] - times[0])

    def send(self, x: float, y: float) -> None:
        """Send the robot to a point of the world (m)."""
        goal = PoseStamped()
        goal.header.frame_id = WORLD
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 1.0
        self.goal_publisher.publish(goal)

    def on_marker(self, message: Marker) -> None:
        """Count how often the brick has been called unreachable."""
        self.verdicts += message.text == 'Unreachable'


class Outcome(NamedTuple):
    """What became of a brick; lengths in m, times in s."""

    brick: Vector
    distance: float
    """From the robot at rest to the brick, before the drop."""
    limit: float
    """The distance within which a catch is promised."""
    decision: Decision | None
    predicted: float
    """From release to contact, as the catcher reckons."""
    unreachable: bool
    """Whether the marker said so, once."""
    caught: bool
    fall_time: float
    carried_to: tuple[float, float] | None
    slide_time: float
    finished: bool

    @property
    def faults(self) -> list[str]:
        """Return what went wrong, in words."""
        found = []
        reachable = self.decision is not None and self.decision.reachable
        if self.decision is None:
            found.append('the catcher has not seen it fall')
        if reachable == self.unreachable:
            found.append('the marker does not say what was decided')
        if reachable and not self.caught:
            found.append('said to be reachable, but not caught')
        if not reachable and self.distance <= self.limit:
            found.append(f'called Unreachable within the promised {self.limit:.2f} m')
        if self.caught and not self.finished:
            found.append('caught, but not tipped off')
        if self.carried_to is not None and hypot(
                self.carried_to[0] - CENTER[0], self.carried_to[1] - CENTER[1]) > NEAR_CENTER:
            found.append('tilted away from the center')
        return found


class Match:
    """The graph, and the bricks that are dropped into it."""

    def __init__(self, graph: Graph, parameters: Parameters,
                 hovering_time: float = HOVERING_TIME) -> None:
        """
        Bring every node up.

        :param graph: an empty graph
        :param parameters: those that its nodes have
        :param hovering_time: how long (s) a brick hovers before it is dropped
        """
        self.hovering_time = hovering_time
        self.graph = graph
        self.parameters = parameters
        self.start = monotonic()
        graph.add_turtlesim()
        graph.add_robot_state_publisher()
        self.robot = graph.add_robot()
        self.arena = graph.add_arena()
        self.catcher = graph.add_catcher()
        self.referee = graph.add(Referee, parameters=False)

    def say(self, text: str) -> None:
        """Tell what happens, with the time since the start."""
        print(f'{monotonic() - self.start:7.2f} s  {text}', flush=True)

    def kick_off(self) -> None:
        """Wait until every part sees every other."""
        referee, spin = self.referee, self.graph.spin_until
        spin(lambda: referee.pose_times, START_TIME, 'turtlesim publishes turtle1/pose')
        self.say(f'turtlesim is up, the turtle at ({referee.pose.x:.2f}, {referee.pose.y:.2f})')
        spin(lambda: self.robot.cmd_vel_publisher.get_subscription_count() > 0, START_TIME,
             'turtlesim listens to cmd_vel')
        spin(lambda: self.catcher.complete and self.arena.world.platform is not None, START_TIME,
             'the transforms of robot and brick are there')
        spin(lambda: referee.place_client.service_is_ready()
             and referee.drop_client.service_is_ready(), START_TIME, 'the arena serves')
        self.refuse_company()
        self.say('robot, arena and catcher see each other')

    def refuse_company(self) -> None:
        """Raise CompanyError if another robot has come, as when two demos start at once."""
        if self.referee.count_publishers('turtle1/pose') > 1:
            raise CompanyError('also publishes turtle1/pose')

    def warm_up(self) -> None:
        """Drive a square by goal_pose, and tell how often turtlesim says where the turtle is."""
        referee, driver, spin = self.referee, self.robot.driver, self.graph.spin_until
        spin(lambda: referee.goal_publisher.get_subscription_count() > 0, START_TIME,
             'the robot listens to goal_pose')
        referee.pose_times.clear()
        x, y = CENTER
        side = SQUARE / 2.0
        for corner in ((x - side, y - side), (x + side, y - side), (x + side, y + side),
                       (x - side, y + side), (x - side, y - side), CENTER):
            referee.send(*corner)
            spin(lambda: driver.goal == within_arena(*corner) and self.is_at_rest(), START_TIME,
                 'the robot drives to ({:.2f}, {:.2f})'.format(*corner))
            self.say('driven to ({:.3f}, {:.3f}), there at ({:.3f}, {:.3f})'.format(
                *corner, referee.pose.x, referee.pose.y))
        self.say(f'turtle1/pose arrives at {referee.pose_rate():.1f} Hz')

    def is_at_rest(self) -> bool:
        """Tell whether the robot stands at its goal."""
        return self.robot.driver.arrived and self.referee.pose.linear_velocity == 0.0

    def robot_place(self) -> tuple[float, float]:
        """Return where the robot is (m in the world), as it itself knows since the kick-off."""
        pose = self.robot.driver.pose
        assert pose is not None
        return pose.x, pose.y

    def call(self, client: Client, request: Any) -> None:
        """Call a service of the arena; a refusal ends the demo with its reason."""
        future = client.call_async(request)
        self.graph.spin_until(future.done, 5.0, f'{client.srv_name} answers')
        response = future.result()
        if not response.success:
            raise ValueError(f'{client.srv_name}: {response.message}')

    def drop(self, brick: Vector) -> Outcome:
        """Place a brick, drop it, and tell and return what becomes of it."""
        world, catcher, spin = self.arena.world, self.catcher.catcher, self.graph.spin_until
        self.refuse_company()
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = brick
        self.call(self.referee.place_client, request)
        x, y = self.robot_place()
        distance = hypot(brick[0] - x, brick[1] - y)
        self.say('the brick hovers at ({:.2f}, {:.2f}, {:.2f})'.format(*brick)
                 + f', {distance:.2f} m from the robot')
        self.graph.spin_for(self.hovering_time)
        before, verdicts = catcher.decision, self.referee.verdicts
        self.call(self.referee.drop_client, Trigger.Request())
        self.say('it is let go')
        longest = 60.0 + ARENA_SIZE * 1.5 / self.parameters.max_velocity
        spin(lambda: world.phase is not Phase.FALLING or catcher.decision is not before,
             longest, 'the catcher decides')
        decision = catcher.decision if catcher.decision is not before else None
        if decision is not None and decision.reachable:
            self.say(f'reachable: down in {decision.available:.2f} s, '
                     f'{decision.needed:.2f} s needed, {decision.margin:.2f} s to spare')
        elif decision is not None:
            self.say(f'Unreachable: {decision.reason}')
        spin(lambda: world.phase is not Phase.FALLING, longest, 'the brick is down')
        fall_time = world.fall_time
        caught = world.phase is Phase.RIDING
        self.say(f'{"caught" if caught else "on the ground"} at '
                 '({:.2f}, {:.2f}, {:.2f})'.format(*world.brick) + f' after {fall_time:.3f} s, '
                 'the robot at ({:.2f}, {:.2f})'.format(*self.robot_place()))
        carried_to, slide_time = None, 0.0
        if caught:
            spin(lambda: catcher.state in (State.TILTING, State.WAITING), longest,
                 'the brick is carried to the center')
            carried_to = self.robot_place()
            self.say(f'at the center, ({carried_to[0]:.3f}, {carried_to[1]:.3f}): tilting')
            tilted = monotonic()
            spin(lambda: world.phase is not Phase.RIDING or catcher.state is State.WAITING,
                 longest, 'the brick slides off')
            slide_time = monotonic() - tilted
            self.say(f'the brick is {world.phase.value} at '
                     '({:.2f}, {:.2f}, {:.2f})'.format(*world.brick))
        spin(lambda: catcher.state is State.WAITING, longest, 'the catcher waits again')
        if decision is not None and not decision.reachable:
            spin(lambda: self.referee.verdicts > verdicts, 5.0, 'the marker says Unreachable')
        self.say('the platform is level, the robot waits')
        predicted = inf
        if decision is not None:
            predicted = ((decision.contact - decision.fall.stamp) * NANO
                         + decision.fall.speed / self.parameters.gravity_accel)
        return Outcome(
            brick, distance, self.promised(brick), decision, predicted,
            self.referee.verdicts == verdicts + 1, caught, fall_time, carried_to,
            slide_time, world.phase is Phase.FLOATING)

    def promised(self, brick: Vector) -> float:
        """Return how far from the robot (m) a brick may be and is sure to be caught."""
        if within_arena(brick[0], brick[1]) != (brick[0], brick[1]):
            return -inf
        return guaranteed_distance(brick[2], self.parameters)


def random_bricks(match: Match, seed: int, count: int) -> Iterator[Vector]:
    """
    Yield random bricks, each from 0.2 to 1.2 of the farthest that is promised to be caught.

    :param match: tells where the robot is when a brick is asked for
    :param seed: of the random numbers
    :param count: how many
    """
    random = Random(seed)
    for _ in range(count):
        robot_x, robot_y = match.robot_place()
        while True:
            z = resting_height(match.parameters) + random.uniform(3.0, 6.0)
            limit = guaranteed_distance(z, match.parameters)
            distance, angle = random.uniform(0.2, 1.2) * limit, random.uniform(-pi, pi)
            x, y = robot_x + distance * cos(angle), robot_y + distance * sin(angle)
            if 0.0 <= x <= ARENA_SIZE and 0.0 <= y <= ARENA_SIZE:
                yield (x, y, z)
                break


def two_bricks(parameters: Parameters) -> list[Vector]:
    """Return where a brick can be caught, and where one can't."""
    corner = (0.5, 0.5, resting_height(parameters) + 1.0)
    return [parameters.brick_start, corner]


def report(outcomes: Sequence[Outcome]) -> None:
    """Print the summary."""
    print('\n   brick at            distance  promised  verdict      predicted  actual   margin'
          '   carried to      slide')
    for outcome in outcomes:
        decision = outcome.decision
        row = '  ({:5.2f}, {:5.2f}, {:5.2f})'.format(*outcome.brick)
        row += f'  {outcome.distance:6.2f} m  {max(outcome.limit, 0.0):6.2f} m'
        if decision is None:
            print(row + '  not seen')
            continue
        row += '  reachable  ' if decision.reachable else '  Unreachable'
        if isfinite(decision.margin):
            row += f'  {outcome.predicted:7.3f} s'
            row += f'  {outcome.fall_time:.3f} s  {decision.margin:+.3f} s'
        if outcome.carried_to is not None:
            row += '  ({:.3f}, {:.3f})'.format(*outcome.carried_to)
            row += f'  {outcome.slide_time:.2f} s'
        print(row)
        for fault in outcome.faults:
            print(f'      FAULT: {fault}')
    caught = sum(outcome.caught for outcome in outcomes)
    refused = sum(outcome.unreachable for outcome in outcomes)
    faults = sum(bool(outcome.faults) for outcome in outcomes)
    print(f'\n{len(outcomes)} dropped: {caught} caught, {refused} Unreachable, {faults} at fault')


@contextmanager
def chosen_domain() -> Iterator[bool]:
    """
    Take the ROS domain that the environment names, else one that nobody on this machine is in.

    :return: Whether somebody else may be in it.
    :raises DomainError: there is none, or the environment names none that can be
    """
    keep_to_this_machine()
    local = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') == 'LOCALHOST'
    named = os.environ.get('ROS_DOMAIN_ID')
    if named:
        if not named.isdecimal() or int(named) > LAST_DOMAIN:
            raise DomainError(f'ROS_DOMAIN_ID is {named!r:.40}, but must be a whole number '
                              f'from 0 to {LAST_DOMAIN}')
        yield not local or not is_empty(int(named))
        return
    # From 0, where whoever has chosen no domain is: most often there is nothing to be exported.
    with reserved_domain(DOMAINS) as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        print(f'In ROS domain {domain}; in another terminal: export ROS_DOMAIN_ID={domain}',
              flush=True)
        yield not local


def look_out(graph: Graph) -> None:
    """Raise CompanyError if another robot is found in the domain."""
    lookout = graph.add(Lookout, parameters=False)
    try:
        graph.spin_until(lookout.found, DISCOVERY_TIME, 'another robot is found')
    except TimeoutError:
        graph.remove(lookout)
    else:
        raise CompanyError(lookout.found())


def admitted(place: Sequence[float], parameters: Parameters) -> Vector:
    """Return a place as it was given if a brick could start there, or raise ParameterError."""
    x, y, z = place
    try:
        return replace(parameters, brick_start=(x, y, z)).brick_start
    except ParameterError as error:
        raise ParameterError(str(error).replace('brick_start', '--place')) from None


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo; return its exit status."""
    parser = argparse.ArgumentParser(prog='demo', description=__doc__.split('\n\n')[0].strip())
    parser.add_argument(
        '--place', nargs=3, type=float, action='append', metavar=('X', 'Y', 'Z'), default=[],
        help='drop a brick from here (m, in the world) instead of the usual two; repeatable')
    parser.add_argument(
        '--drops', type=int, metavar='N', help='drop N random bricks instead')
    parser.add_argument(
        '--seed', type=int, default=1, metavar='N', help='of the random bricks (default: 1)')
    parser.add_argument(
        '--no-view', action='store_true', help='do not show the graph in a browser')
    parser.add_argument(
        '--rviz', action='store_true', help='show it in rviz2, where that is installed')
    parser.add_argument(
        '--verbose', action='store_true', help='show what the nodes log, not just warnings')
    options = parser.parse_args(args)
    if options.drops is not None and options.drops < 1:
        parser.error(f'--drops {options.drops}: at least 1')
    INTERRUPTS.take_over()
    try:
        parameters = load()
        options.place = [admitted(place, parameters) for place in options.place]
        with chosen_domain() as shared, Graph(quiet=not options.verbose) as graph:
            if shared:
                look_out(graph)
            if options.rviz:
                graph.add_process('rviz2', 'rviz2', '-d', str(
                    get_package_share_path('turtle_brick') / 'config' / 'turtle_arena.rviz'))
            elif not options.no_view:
                graph.add_process('turtle_brick', 'viewer', silent=False)
            return play(Match(graph, parameters), options)
    except KeyboardInterrupt:
        return 0
    except PackageNotFoundError as error:
        print(f'demo: the package {error} is not installed here', file=sys.stderr)
        return 1
    except (DomainError, ParameterError, TimeoutError, ValueError) as error:
        print(f'demo: {error}', file=sys.stderr)
        return 1


def play(match: Match, options: argparse.Namespace) -> int:
    """Drop the bricks that are asked for; return the exit status."""
    match.kick_off()
    spare_collector()
    match.warm_up()
    bricks: Iterable[Vector]
    if options.drops:
        bricks = random_bricks(match, options.seed, options.drops)
    else:
        bricks = options.place or two_bricks(match.parameters)
    outcomes = []
    for brick in bricks:
        print()
        outcomes.append(match.drop(brick))
    report(outcomes)
    good = not any(outcome.faults for outcome in outcomes)
    if not options.drops and not options.place:
        good = good and outcomes[0].caught and outcomes[1].unreachable
    if sys.stdin.isatty() and sys.stdout.isatty():
        domain = os.environ.get('ROS_DOMAIN_ID') or '0'
        prefix = '' if domain == '0' else f'ROS_DOMAIN_ID={domain} '
        print('\nThe graph stays up until Ctrl-C. In another terminal, after "source '
              'turtle_brick/scripts/env.bash":\n',
              *(f'  {prefix}{command}' for command in match.arena.commands), '', sep='\n')
        match.graph.spin_until(lambda: False, inf, 'Ctrl-C')
    return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
