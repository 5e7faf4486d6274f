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
benchmark: measure what the live graph costs, how regular it is and how quickly it reacts.

How it is measured:

* The graph is started twice: every node as a process of its own (the installed executables), and
  composed (one process, one executor; a turtlesim or robot_state_publisher that cannot be composed
  runs beside). Its floor is measured before and after it, in the same way, and the mean taken,
  since processors change their pace: bare nodes that publish and receive the same messages at the
  same rates and compute nothing (`turtle_brick.tools.benchmark_nodes`). The ratio of the two is
  what the nodes' own work costs.
* Processor time is the user and system time that Linux books on a process and its threads
  (/proc/<pid>/stat) over a window: "idle", the brick hovering and the robot at rest, while nobody
  else listens to what comes 100 or 250 times per second; and "catching", one drop after another,
  with one listener more, which drops them. Peak memory is VmHWM, start-up included.
* Intervals are taken in further windows, with that listener, which costs the publishers some time:
  idle, and under two busy loops beside. Their instants are those at which the middleware took a
  message over for publication (source_timestamp), not those of its arrival here. Given are the
  mean, the 1st, 50th and 99th percentile and the greatest.
* Drift is counted in steps of the physics: gaps between the stamps of the brick's transforms,
  and what the stamps fall behind the clock of their publication.
* Latency is taken from drops on a robot at rest, each from a random distance that asks for
  motion. The release is the stamp of the last position before the brick falls; the decision is
  the goal's publication; motion is the first pose of turtlesim that has changed.
* Headless drops are those of `sweep`, in this process, by its own processor time.
* Set-up, if asked for, is `source turtle_brick/scripts/env.bash` in a fresh clone with an empty
  HOME and environment, and once more. The package index's speed is part of it.

Everything runs in a ROS domain of its own. What other programs use meanwhile is measured too, and
said: above a twentieth of a core the numbers are not worth much. So is what the host of a virtual
machine keeps from it: while it does, everything comes late, and the percentiles show it.
"""

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timezone
from importlib.util import find_spec
import json
from math import cos, hypot, inf, pi, sin
import os
from pathlib import Path
import platform
from random import Random
import sys
from threading import Event
from time import monotonic, process_time, time_ns
from typing import Any, NamedTuple
from xml.etree import ElementTree

from ament_index_python.packages import get_package_share_path
from rclpy.node import Node
from rclpy.utilities import get_rmw_implementation_identifier
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import load, ParameterError, Parameters
from turtle_brick.core.reachability import guaranteed_distance
from turtle_brick.physics import STEP
from turtle_brick.ros.tf import BASE_LINK, BRICK
from turtle_brick.tools.graph import Graph
from turtle_brick.tools.interrupts import INTERRUPTS
from turtle_brick.tools.measuring import (BrickSample, busy_time, chain, Drift, drift, Events,
                                          intervals, peak_memory)
from turtle_brick.tools.measuring import Place as RobotPlace
from turtle_brick.tools.measuring import processor_model, processor_time, spread, stolen_time
from turtle_brick.tools.processes import FOREIGN, Processes, start_graph
from turtle_brick.tools.report import draw, plain, report
from turtle_referee.domains import reserved_domain
from turtle_referee.drops import DropWatch
from turtle_referee.hands import Hands
from turtle_referee.names import Profile
from turtle_referee.observer import Observer
from turtle_referee.record import Record

START_TIME = 60.0
"""How long (s) processes may take to start and to find each other."""

WARM_UP = 3.0
"""How long (s) a graph runs before it is measured."""

HOVERING = 0.5
"""How long (s) a brick hovers before it is dropped."""

LEAD = 100_000_000
"""How long (ns) before a brick is asked to fall its positions are looked at."""

BUSY_LOOPS = 2


class Window(NamedTuple):
    """What was used in a stretch of time."""

    seconds: float
    cores: dict[str, float]
    """Cores that each process used."""
    others: float
    """Cores that all programs outside the benchmark used."""


class Benchmark:
    """The measurements, one after another."""

    def __init__(self, options: argparse.Namespace, parameters: Parameters) -> None:
        """
        Measure nothing yet.

        :param options: of the command line
        :param parameters: the physical numbers
        """
        self.options = options
        self.parameters = parameters
        self.random = Random(1)
        self.others: list[float] = []

    def say(self, text: str) -> None:
        """Tell what is being done."""
        print(text, file=sys.stderr, flush=True)

    def run(self) -> dict[str, Any]:
        """Measure everything; return what was found."""
        found: dict[str, Any] = {'machine': machine()}
        begin, stolen = monotonic(), stolen_time()
        for name, composed in (('processes', False), ('composed', True)):
            self.say(f'{name}: the floor')
            before = self.with_graph('bare', composed, self.measure_floor)
            real = self.with_graph('real', composed, self.measure)
            self.say(f'{name}: the floor once more')
            after = self.with_graph('bare', composed, self.measure_floor)
            found[name] = {'floor': mean_floor(before, after), **real}
        found['others_cores'] = max(self.others)
        found['stolen_cores'] = (stolen_time() - stolen) / (monotonic() - begin)
        return found

    def with_graph(self, kind: str, composed: bool, measure: Any) -> dict[str, Any]:
        """Start a graph, measure it and end it."""
        with Graph(quiet=True) as watch, Processes() as processes:
            start_graph(processes, watch, kind, composed)
            with self.observing(watch, processes) as hands:
                self.await_in(watch, processes, lambda: is_complete(hands.observer), START_TIME,
                              'the nodes find each other')
                self.await_in(watch, processes, lambda: hands.record.topics['odom'], START_TIME,
                              'the robot moves or rests')
            watch.spin_for(WARM_UP)
            return measure(watch, processes)

    @contextmanager
    def observing(self, watch: Graph, processes: Processes) -> Iterator[Hands]:
        """Hear the graph, and be heard by it, for a while."""
        observer = watch.add(Observer, parameters=False, name='benchmark',
                             profile=Profile.from_parameters(self.parameters))
        try:
            yield Hands(watch, observer)
        finally:
            watch.remove(observer)
            processes.check()

    @staticmethod
    def await_in(watch: Graph, processes: Processes, condition: Any, timeout: float,
                 what: str) -> None:
        """Wait until a condition holds, with an eye on the processes."""
        def holds() -> bool:
            processes.check()
            return condition()
        watch.spin_until(holds, timeout, what)

    def measure_floor(self, watch: Graph, processes: Processes) -> dict[str, Any]:
        """Measure bare nodes, which nobody listens to."""
        window = self.window(processes, lambda: Event().wait(self.options.seconds))
        return {'cores': window.cores, 'memory': memory(processes)}

    def measure(self, watch: Graph, processes: Processes) -> dict[str, Any]:
        """Measure the real nodes in every way."""
        seconds = self.options.seconds
        found: dict[str, Any] = {}
        self.say('  idle, nobody listening')
        found['idle'] = self.window(processes, lambda: Event().wait(seconds)).cores
        outcomes: Counter = Counter()
        with self.observing(watch, processes) as hands:
            self.await_in(watch, processes, hands.sees_everything, START_TIME,
                          'the nodes find the listener')

            def catch() -> None:
                end = monotonic() + seconds
                while monotonic() < end:
                    outcomes[outcome(self.throw(hands))] += 1

            self.say('  catching, listening')
            found['catching'] = self.window(processes, catch).cores
            found['memory'] = memory(processes)
            self.say('  idle, listening')
            found['intervals'], found['drift'] = self.listen(hands)
            self.say('  under two busy loops, listening')
            with Processes() as loops:
                for number in range(BUSY_LOOPS):
                    loops.start(f'loop{number}', sys.executable, '-c', 'while True: pass')
                found['intervals_busy'], found['drift_busy'] = self.listen(hands)
            self.say(f'  {self.options.drops} drops')
            found['latency'] = self.measure_latency(hands, outcomes)
        found['outcomes'] = dict(outcomes)
        return found

    def window(self, processes: Processes, action: Any) -> Window:
        """Return what is used while something happens."""
        def snapshot() -> tuple[float, float, float, dict[str, float]]:
            return (monotonic(), busy_time(), process_time(),
                    {process.name: processor_time(process.pid) for process in processes.all})

        begin, busy, own, used = snapshot()
        action()
        processes.check()
        end, busy_then, own_then, used_then = snapshot()
        seconds = end - begin
        cores = {name: (used_then[name] - used[name]) / seconds for name in used}
        others = (busy_then - busy - (own_then - own)) / seconds - sum(cores.values())
        self.others.append(max(others, 0.0))
        return Window(seconds, cores, others)

    def throw(self, hands: Hands) -> DropWatch:
        """
        Place a brick where it can be caught, drop it and wait until all is over.

        :raises ValueError: a service has refused
        :raises TimeoutError: a service did not answer
        """
        place = self.brick()
        hands.place(place, HOVERING).check()
        drop = hands.drop(place)
        assert drop.ask is not None
        drop.ask.check()
        return drop

    def brick(self) -> Vector:
        """Return where to drop the next brick, so that the robot has to move and can make it."""
        z = self.parameters.brick_start[2]
        distance = self.random.uniform(0.5, 0.9) * guaranteed_distance(z, self.parameters)
        angle = self.random.uniform(-pi, pi)
        return CENTER[0] + distance * cos(angle), CENTER[1] + distance * sin(angle), z

    def listen(self, hands: Hands) -> tuple[dict[str, Any], Drift]:
        """Return the spreads of all intervals over a window, and the drift of the physics."""
        begin = time_ns()
        hands.graph.spin_for(self.options.seconds)
        hands.observer.listener.fetch()
        record = hands.record
        instants = {name: [heard.published for heard in record.heard(name, begin)]
                    for name in ('cmd_vel', 'odom', 'joint_states')}
        steps = []
        for label, frame in (('odom -> base_link', BASE_LINK), ('world -> brick', BRICK)):
            heard = record.frames[frame].heard(begin)
            # Several steps may come in one message.
            instants[label] = sorted({published for published, _ in heard})
            if frame == BRICK:
                steps = heard
        return ({name: spread(intervals(published)) for name, published in instants.items()},
                drift([sample.stamp for _, sample in steps],
                      [published for published, _ in steps], STEP))

    def measure_latency(self, hands: Hands, outcomes: Counter) -> list[dict[str, float]]:
        """Return the chain of each of some drops, and count how they ended."""
        chains = []
        for _ in range(self.options.drops):
            drop = self.throw(hands)
            outcomes[outcome(drop)] += 1
            links = chain(events(hands.record, drop.begin - LEAD, drop.end))
            if links is not None:
                chains.append(links)
        if not chains:
            raise RuntimeError('no drop was heard from its release to the first motion')
        return chains


def is_complete(node: Node) -> bool:
    """Tell whether every node of a graph has all that it publishes and hears."""
    # One more hears everything: the node itself.
    return (node.count_publishers('/tf') == 3
            and node.count_subscribers('/tf') == 3
            and all(node.count_publishers(topic) == 1 for topic in (
                'odom', 'turtle1/pose', 'turtle1/cmd_vel', 'joint_states', 'goal_pose'))
            and all(node.count_subscribers(topic) == 2 for topic in (
                'turtle1/pose', 'turtle1/cmd_vel', 'joint_states', 'goal_pose'))
            and node.count_services('place') == 1 and node.count_services('drop') == 1)


def outcome(drop: DropWatch) -> str:
    """Return how a drop ended: 'caught', 'refused' or 'missed'."""
    return 'caught' if drop.caught else 'refused' if drop.refusals else 'missed'


def events(record: Record, begin: int, end: int) -> Events:
    """Return what was heard in a stretch of time (ns), as `measuring.chain` wants it."""
    return Events(
        brick=[BrickSample(sample.stamp, published, sample.pose.position[2])
               for published, sample in record.frames[BRICK].heard(begin, end)],
        goals=[heard.published for heard in record.heard('goal_pose', begin, end)],
        commands=[(heard.published, hypot(heard.message.linear.x, heard.message.linear.y))
                  for heard in record.heard('cmd_vel', begin, end)],
        poses=[RobotPlace(heard.published, heard.message.x, heard.message.y)
               for heard in record.heard('pose', begin, end)],
        transforms=[RobotPlace(published, *sample.pose.position[:2])
                    for published, sample in record.frames[BASE_LINK].heard(begin, end)])


def mean_floor(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """Return the mean of two floors; of their peak memories the greater."""
    return {
        'cores': {name: (cores + after['cores'][name]) / 2.0
                  for name, cores in before['cores'].items()},
        'memory': {name: max(peak, after['memory'][name])
                   for name, peak in before['memory'].items()},
    }


def memory(processes: Processes) -> dict[str, int]:
    """Return the peak memory of each process so far, in bytes."""
    return {process.name: peak_memory(process.pid) for process in processes.all}


def machine() -> dict[str, Any]:
    """Return what the numbers were measured on and with."""
    def package_version(name: str) -> str:
        manifest = get_package_share_path(name) / 'package.xml'
        return ElementTree.parse(manifest).findtext('version', '')

    return {
        'processor': processor_model(),
        'cores': len(os.sched_getaffinity(0)),
        'system': platform.platform(),
        'python': platform.python_version(),
        'turtle_brick': package_version('turtle_brick'),
        'rclpy': package_version('rclpy'),
        'middleware': get_rmw_implementation_identifier(),
        **{name: package_version(name) + ('' if find_spec(module) is None else ' (stand-in)')
           for name, module in FOREIGN.items()},
        'date': datetime.now(timezone.utc).strftime('%Y-%m-%d %H:%M UTC'),
        'load_average': os.getloadavg()[0],
    }


def parse(args: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line; what is wrong with it ends the process with a sentence."""
    first, rest = __doc__.strip().split('\n\n', 1)
    parser = argparse.ArgumentParser(
        prog='benchmark', description=first.partition(': ')[2].capitalize(), epilog=rest,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=60.0, metavar='T',
                        help='length of each window (s, default: 60); there are twelve')
    parser.add_argument('--drops', type=int, default=20, metavar='N',
                        help='drops for the latency, each way (default: 20)')
    parser.add_argument('--output', type=Path, default=Path('.'), metavar='DIR',
                        help='where benchmark.json and latency.png go (default: here)')
    parser.add_argument('--no-figure', dest='figure', action='store_false',
                        help='make no latency.png')
    options = parser.parse_args(args)
    if not 1.0 <= options.seconds < inf:
        parser.error(f'--seconds {options.seconds:g}: at least 1')
    if options.drops < 1:
        parser.error(f'--drops {options.drops}: at least 1')
    if options.output.exists() and not options.output.is_dir():
        parser.error(f'--output {options.output}: this is not a directory')
    return options


def main(args: Sequence[str] | None = None) -> int:
    """Run the benchmark; return its exit status."""
    options = parse(args)
    INTERRUPTS.take_over()
    try:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        with reserved_domain() as domain:
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            found = Benchmark(options, load()).run()
        found.update(seconds=options.seconds, drops=options.drops)
        options.output.mkdir(parents=True, exist_ok=True)
        (options.output / 'benchmark.json').write_text(
            json.dumps(plain(found), indent=1) + '\n', encoding='utf-8')
        print(report(found))
        print(f'\n{options.output / "benchmark.json"}')
        if options.figure:
            draw(found, options.output / 'latency.png')
    except KeyboardInterrupt:
        print('benchmark: stopped, and nothing written', file=sys.stderr)
        return 0
    except (OSError, ParameterError, RuntimeError, TimeoutError, ValueError) as error:
        print(f'benchmark: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
