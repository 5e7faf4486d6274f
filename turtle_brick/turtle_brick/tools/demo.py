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
What happens is told as it happens. With --arenas N this goes on in N arenas at the same time, each
in a process and a namespace of its own.

The status is 0 only if everything went as it should: what was said to be reachable was caught,
carried to the center and tipped off, and what can be caught in time was not called Unreachable.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, ExitStack, suppress
from math import cos, dist, inf, pi, sin
import multiprocessing
from multiprocessing.connection import wait
import os
from pathlib import Path
from random import Random
import signal
import sys
from tempfile import TemporaryDirectory
from time import monotonic, time_ns
from typing import Any, NoReturn
import webbrowser

from ament_index_python.packages import PackageNotFoundError
from rclpy.node import Node
from turtle_brick.arena import commands
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.driving import within_arena
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import load, ParameterError, Parameters
from turtle_brick.core.reachability import (COMMAND_LATENCY, fall_time, guaranteed_distance,
                                            resting_height, time_needed)
from turtle_brick.core.time_steps import NANO
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.tools.drops import at_least_one
from turtle_brick.tools.graph import Graph
from turtle_referee.domains import (DomainError, DOMAINS, is_empty, keep_to_this_machine,
                                    LAST_DOMAIN, reserved_domain)
from turtle_referee.drops import DropWatch
from turtle_referee.hands import Hands
from turtle_referee.names import Profile
from turtle_referee.observer import Observer
from turtle_referee.spinning import INTERRUPTED, LONGEST_WAIT, note_interrupts

START_TIME = 30.0
"""How long (s) the graph may take to come up."""

DISCOVERY_TIME = 5.0
"""How long (s) somebody else in the domain has to be found: it takes some tenths of a second, or,
where the first announcement is lost, until the next one, which comes every 3 s."""

BROWSER_TIME = 8.0
"""How long (s) a browser may take to show the page before the first brick is placed."""

HOVERING_TIME = 1.0
"""How long (s) a brick hovers before it is dropped, for people to see it."""

NEAR_CENTER = 0.02
"""How far (m) from the center the robot may tilt."""

ROBOT_TOPICS = ('turtle1/pose', 'turtle1/cmd_vel', 'cmd_vel', 'odom')
"""What nobody publishes but a robot and its turtlesim."""


# ---------------------------------------------------------------------------------- its domain

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
    # Not 0, where whoever has chosen no domain is: a launch there would mix with this graph.
    with reserved_domain(DOMAINS[1:]) as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        print(f'In ROS domain {domain}; in another terminal: export ROS_DOMAIN_ID={domain}',
              flush=True)
        yield not local


def look_out(*graphs: Graph) -> None:
    """Raise DomainError if another robot is found where graphs are to be that are empty yet."""
    lookouts = [graph.add(Node, parameters=False, node_name='lookout') for graph in graphs]

    def found() -> str:
        return ', '.join(text for lookout in lookouts for text in [
            *(f'publishes {topic}' for topic in ROBOT_TOPICS if lookout.count_publishers(topic)),
            *['serves drop'] * bool(lookout.count_services('drop'))])

    with suppress(TimeoutError):
        graphs[0].spin_until(found, DISCOVERY_TIME, 'another robot is found')
        raise DomainError(
            f'another robot is in ROS domain {os.environ.get("ROS_DOMAIN_ID") or 0} (somebody '
            f'{found()}): end it, or choose another ROS_DOMAIN_ID')
    for graph, lookout in zip(graphs, lookouts):
        graph.remove(lookout)


# ------------------------------------------------------------------------------- what is dropped

class Outcome:
    """What becomes of a brick, against what physics says; lengths in m, times in s."""

    def __init__(self, watch: DropWatch, parameters: Parameters, excess: float) -> None:
        """
        Compare what is seen with what follows from the physical numbers.

        :param excess: how much longer (s) the commands take here than on an idle machine
        """
        self.watch = watch
        self.due = fall_time(watch.place[2], parameters)
        """Time of the fall to where the brick would lie on the platform, in closed form."""
        self.needed = time_needed(watch.distance, parameters, excess)
        """Time from the decision until the platform can be below the brick."""
        inside = within_arena(*watch.place[:2]) == watch.place[:2]
        self.promised = (guaranteed_distance(watch.place[2], parameters, excess)
                         if inside else -inf)
        """How far from the robot the brick may be and is sure to be caught."""

    def story(self) -> Iterator[tuple[str, str]]:
        """Yield what is known by now: a word for each event, and a sentence."""
        watch = self.watch
        if watch.released is not None:
            yield 'released', 'it is let go'
        if watch.decided is not None and watch.released is not None:
            verdict = 'Unreachable, said' if watch.refusals else 'reachable, decided'
            time = max(watch.decided - watch.released, 0) * NANO
            yield 'decided', (f'{verdict} {time:.3f} s after the release: it falls for '
                              f'{self.due:.3f} s, the robot needs {self.needed:.3f} s')
        if watch.landed is not None:
            yield 'landed', (f'{"caught" if watch.caught else "on the ground"} at '
                             '({:.2f}, {:.2f}, {:.2f})'.format(*watch.landed)
                             + f' after {watch.fall_time:.3f} s')
        if watch.carried_to is not None:
            yield 'carried', 'at the center, ({:.3f}, {:.3f}): tilting'.format(*watch.carried_to)
        if watch.floated is not None:
            yield 'floats', (f'the brick has slid off and floats, {watch.slide_time:.2f} s after '
                             'the tilt began')

    @property
    def faults(self) -> list[str]:
        """Return what went wrong, in words."""
        watch = self.watch
        off_center = watch.carried_to is not None and (
            dist(watch.carried_to, CENTER) > NEAR_CENTER)
        return [fault for fault, is_so in (
            ('it has not come down', watch.down is None),
            ('called Unreachable more than once', len(watch.refusals) > 1),
            ('not called Unreachable, but not caught', not watch.refusals and not watch.caught),
            ('called Unreachable, but caught', watch.refusals and watch.caught),
            (f'called Unreachable within the promised {self.promised:.2f} m',
             watch.refusals and watch.distance <= self.promised),
            ('caught, but not tipped off', watch.caught and watch.floated is None),
            ('tilted away from the center', off_center)) if is_so]


class Match(Hands):
    """The graph, and the bricks that are dropped into it."""

    def __init__(self, graph: Graph, parameters: Parameters, start: float) -> None:
        """Bring every node up in an empty graph; tell times since the start (monotonic, s)."""
        self.parameters = parameters
        self.title = f'{graph.namespace}: ' if graph.namespace else ''
        """What begins each line where there are several arenas."""
        self.start = start
        graph.add_turtlesim()
        graph.add_robot_state_publisher()
        graph.add_robot()
        graph.add_arena()
        self.catcher = graph.add_catcher().catcher
        super().__init__(graph, graph.add(
            Observer, parameters=False, name='demo',
            profile=Profile.from_parameters(parameters)))

    def say(self, text: str) -> None:
        """Tell what happens, with the time since the start."""
        # The line with its end, in one piece: several processes may write here.
        print(f'{monotonic() - self.start:7.2f} s  {self.title}{text}\n', end='', flush=True)

    def await_graph(self) -> None:
        """Wait until every part sees every other."""
        self.graph.spin_until(lambda: self.record.topics['pose'], START_TIME,
                              'turtlesim publishes turtle1/pose')
        self.say('turtlesim is up, the turtle at ({:.2f}, {:.2f})'.format(*self.robot_place()))
        self.graph.spin_until(self.sees_everything, START_TIME,
                              'robot, arena and catcher see each other')
        self.say('robot, arena and catcher see each other')

    def robot_place(self) -> tuple[float, float]:
        """Return where the robot is (m in the world); it is known once the graph is there."""
        place = self.robot()
        assert place is not None
        return place

    def outcome(self, watch: DropWatch) -> Outcome:
        """Return what has become of a brick, by the latency that the catcher reckoned with."""
        decision = self.catcher.decision
        return Outcome(watch, self.parameters,
                       decision.latency - COMMAND_LATENCY if decision else 0.0)

    def show(self, brick: Vector) -> Outcome:
        """Place a brick, drop it, and tell and return what becomes of it."""
        self.place(brick, 0.0).check()
        self.say('the brick hovers at ({:.2f}, {:.2f}, {:.2f})'.format(*brick)
                 + f', {self.distance_to(brick[:2]):.2f} m from the robot')
        self.graph.spin_for(HOVERING_TIME)
        told: set[str] = set()

        def tell(watch: DropWatch) -> None:
            for event, sentence in self.outcome(watch).story():
                if event not in told:
                    told.add(event)
                    self.say(sentence)

        watch = self.drop(brick, tell)
        assert watch.ask is not None
        watch.ask.check()
        outcome = self.outcome(watch)
        for fault in outcome.faults:
            self.say(f'FAULT: {fault}')
        if outcome.faults and not self.record.is_calm(watch.begin, time_ns()):
            self.say('this machine was too busy meanwhile to run the graph as it should')
        self.say('the platform is level, the robot waits')
        return outcome


def random_bricks(match: Match, seed: int, count: int) -> Iterator[Vector]:
    """Yield random bricks, from 0.2 to 1.2 of how far from the robot a catch is promised."""
    random = Random(f'{match.title}{seed}' if match.title else seed)
    for _ in range(count):
        robot_x, robot_y = match.robot_place()
        while True:
            z = resting_height(match.parameters) + random.uniform(3.0, 6.0)
            limit = guaranteed_distance(z, match.parameters)
            distance, angle = random.uniform(0.2, 1.2) * limit, random.uniform(-pi, pi)
            x, y = robot_x + distance * cos(angle), robot_y + distance * sin(angle)
            if within_arena(x, y) == (x, y):
                yield (x, y, z)
                break


def two_bricks(parameters: Parameters) -> list[Vector]:
    """Return where a brick can be caught, and where one can't."""
    # In the far corner, so that whoever looks from the near one sees it.
    far = ARENA_SIZE - 0.5
    return [parameters.brick_start, (far, far, resting_height(parameters) + 1.0)]


# --------------------------------------------------------------------------------- the program

ALL_PAGES = """<!doctype html><title>turtle_brick</title><style>
body { display: grid; grid-template-columns: repeat(auto-fit, minmax(300px, 420px));
       justify-content: center; height: 100vh; margin: 0 }
div { display: grid; grid-template-rows: auto 1fr; font: 16px sans-serif; text-align: center }
iframe { border: 0; height: 100%; min-height: 500px; width: 100% }
</style>
"""
"""The head of a page that shows those of several arenas, in columns so narrow that the buttons are
below the picture."""


class Page:
    """The page in the browser: a viewer in a process of its own, whose address is told first."""

    def __init__(self, graph: Graph) -> None:
        """Start the viewer, and tell its address."""
        self._graph = graph
        self.name = graph.namespace
        """The arena that it shows, nothing if that is the only one."""
        self.url = ''
        self.opened = self._shown = False
        self._viewer = graph.add_process('turtle_brick', 'viewer', listener=self._listen)
        self._wait(lambda: self.url, START_TIME, 'the viewer starts')
        if self.url:
            print(f'The page {self.name and f"of {self.name} "}in the browser: {self.url}',
                  flush=True)

    def await_browser(self) -> None:
        """Wait some seconds for a browser that was opened to show the page."""
        if self.opened:
            with suppress(TimeoutError):
                self._wait(lambda: self._shown, BROWSER_TIME, 'the browser shows the page')

    def _wait(self, condition: Callable[[], Any], timeout: float, what: str) -> None:
        """Wait until a condition holds, or the viewer has ended."""
        self._graph.spin_until(lambda: condition() or not self._viewer.running, timeout, what)

    def _listen(self, line: str) -> None:
        """Find the address in what the viewer says, and pass the rest on."""
        head, _, rest = line.strip().partition('Viewer: ')
        if head or not rest:
            sys.stderr.write(line)
        elif rest.startswith('http'):
            self.url = rest
        else:
            self._shown = True


def show(pages: Sequence[Page], directory: str) -> None:
    """Open a browser on a person's screen, with one page (in the directory) for all arenas."""
    pages = [page for page in pages if page.url]
    if not pages:
        return
    url = pages[0].url
    if len(pages) > 1:
        file = Path(directory, 'arenas.html')
        file.write_text(ALL_PAGES + ''.join(
            f'<div>{page.name}<iframe src="{page.url}"></iframe></div>' for page in pages))
        url = file.as_uri()
        print(f'All of them in one page: {url}', flush=True)
    display = os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')
    opened = bool(display and sys.stdout.isatty() and webbrowser.open(url))
    for page in pages:
        page.opened = opened


def play(match: Match, options: argparse.Namespace) -> bool:
    """Drop the bricks that are asked for; tell whether all went as it should."""
    bricks: Iterable[Vector] = (
        [(x, y, z) for x, y, z in options.place] or two_bricks(match.parameters))
    if options.drops:
        bricks = random_bricks(match, options.seed, options.drops)
    outcomes = []
    for brick in bricks:
        if not match.title:
            print()
        outcomes.append(match.show(brick))
    caught = [outcome.watch.caught for outcome in outcomes]
    refused = [bool(outcome.watch.refusals) for outcome in outcomes]
    faults = sum(bool(outcome.faults) for outcome in outcomes)
    head = match.title or '\n'
    print(f'{head}{len(outcomes)} dropped: {sum(caught)} caught, '
          f'{sum(refused)} Unreachable, {faults} at fault\n', end='', flush=True)
    as_usual = options.drops or options.place or caught[0] and refused[1]
    return bool(as_usual and not faults)


def run(graph: Graph, pages: Sequence[Page], parameters: Parameters, start: float,
        options: argparse.Namespace) -> int:
    """Run the demo in an empty graph; return its exit status."""
    match = Match(graph, parameters, start)
    match.await_graph()
    for page in pages:
        page.await_browser()
    good = play(match, options)
    if options.stay:
        domain = os.environ.get('ROS_DOMAIN_ID') or '0'
        prefix = '' if domain == '0' else f'ROS_DOMAIN_ID={domain} '
        place, drop = map(match.observer.resolve_service_name, ('place', 'drop'))
        print('\nThe graph stays up until Ctrl-C. In another terminal, after "source '
              'turtle_brick/scripts/env.bash":\n',
              *(f'  {prefix}{command}' for command in commands(
                  place, drop, parameters.brick_start)), '', sep='\n')
        graph.remove(match.observer)  # which keeps all that it hears
        graph.spin_until(lambda: False, inf, 'Ctrl-C')
    return 0 if good else 1


def run_arena(name: str, parameters: Parameters, start: float,
              options: argparse.Namespace) -> NoReturn:
    """Run the demo in a namespace, as all that a process does."""
    note_interrupts()

    def work() -> int:
        with new_graph(name, options) as graph:
            return run(graph, [], parameters, start, options)

    sys.exit(in_words(work))


def run_arenas(names: Sequence[str], *how: Any) -> int:
    """Run the demo in several namespaces at the same time, each in a process of its own."""
    spawn = multiprocessing.get_context('spawn')
    processes = [spawn.Process(target=run_arena, args=(name, *how)) for name in names]
    # What is ignored now is so in the processes until they call note_interrupts: they are ended
    # from here, and Python says nothing about a Ctrl-C while it starts.
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    for process in processes:
        process.start()
    signal.signal(signal.SIGINT, handler)
    try:
        while running := [process.sentinel for process in processes if process.is_alive()]:
            wait(running, LONGEST_WAIT)
            if INTERRUPTED.is_set():
                raise KeyboardInterrupt
    finally:
        for process in processes:
            process.terminate()
            process.join()
    return 1 if any(process.exitcode for process in processes) else 0


def new_graph(name: str, options: argparse.Namespace) -> Graph:
    """Return an empty graph in a namespace, or in none."""
    return Graph(namespace=name, quiet=not options.verbose, tf_inside=bool(name))


def in_words(work: Callable[[], int]) -> int:
    """Do a piece of work; return its exit status, and tell what goes wrong in one sentence."""
    try:
        return work()
    except KeyboardInterrupt:
        return 0
    except (DomainError, PackageNotFoundError, ParameterError, TimeoutError, ValueError) as error:
        print(f'demo: {error.args[0]}', file=sys.stderr)
        return 1


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo; return its exit status."""
    parser = argparse.ArgumentParser(prog='demo', description=__doc__.split('\n\n')[0].strip())
    parser.add_argument(
        '--place', nargs=3, type=float, action='append', metavar=('X', 'Y', 'Z'), default=[],
        help='drop a brick from here (m, in the world) instead of the usual two; repeatable')
    parser.add_argument(
        '--drops', type=at_least_one, metavar='N', help='drop N random bricks instead')
    parser.add_argument(
        '--seed', type=int, default=1, metavar='N', help='of the random bricks (default: 1)')
    parser.add_argument(
        '--arenas', type=at_least_one, default=1, metavar='N',
        help='N arenas side by side, each in a namespace of its own, arena_1, arena_2, ...; '
        'each takes half a core or more')
    parser.add_argument(
        '--no-view', action='store_true', help='do not show the graph in a browser')
    parser.add_argument(
        '--verbose', action='store_true', help='show what the nodes log, not just warnings')
    options = parser.parse_args(args)
    options.stay = sys.stdin.isatty() and sys.stdout.isatty()
    note_interrupts()
    return in_words(lambda: run_all(options))


def run_all(options: argparse.Namespace) -> int:
    """Show the arenas and what happens in them; return the exit status."""
    parameters = load()
    names = [f'arena_{number + 1}' for number in range(options.arenas)]
    with chosen_domain() as shared, ExitStack() as stack:
        graphs = [stack.enter_context(new_graph(name, options))
                  for name in (names if len(names) > 1 else [''])]
        if shared:
            look_out(*graphs)
        pages = [] if options.no_view else [Page(graph) for graph in graphs]
        show(pages, stack.enter_context(TemporaryDirectory()))
        how = (parameters, monotonic(), options)
        if len(graphs) == 1:
            return run(graphs[0], pages, *how)
        for page in pages:
            page.await_browser()
        return run_arenas(names, *how)


if __name__ == '__main__':
    sys.exit(main())
