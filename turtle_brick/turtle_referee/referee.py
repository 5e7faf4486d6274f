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
referee: judge an implementation of the exercise, sentence by sentence, from outside.

It watches a running graph through topics, services and TF alone, asks it for what a user would
(goal_pose, tilt, place, drop), and says for each requirement of the assignment what was measured
and what was expected: kept, broken, or open, where it can't be judged, and why. What stands behind
"--" is started as the graph, and ended:

    ros2 run turtle_brick referee -- ros2 launch turtle_brick turtle_arena.launch.py view:=none

The status is 0 if nothing is broken, 1 if something is, 2 if nothing was judged.
"""

import argparse
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from datetime import datetime
from functools import partial
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
from platform import python_version
import shlex
import sys
from time import monotonic

from rclpy.utilities import get_rmw_implementation_identifier
from turtle_referee import report
from turtle_referee.graph_client.domains import restrict_to_localhost, reserved_domain
from turtle_referee.graph_client.observer import Observer
from turtle_referee.graph_client.processes import Process
from turtle_referee.graph_client.profile import Profile
from turtle_referee.graph_client.record import Record
from turtle_referee.graph_client.spinning import NodeSpinner
from turtle_referee.rules import arena_rules, catcher_rules, robot_rules
from turtle_referee.rules.rule import BROKEN, Rules
from turtle_referee.trial import MEETING, Trial

RULES = Rules((*robot_rules.RULES, *arena_rules.RULES, *catcher_rules.RULES))

STARTING = 60.0  # how long (s) a graph may take to start


def watch(profile: Profile, options: argparse.Namespace, command: Sequence[str],
          say: Callable[[str], None]) -> Record:
    """Let a graph show what it can, which a command starts if there is one; return the record."""
    with ExitStack() as stack:
        spinner = stack.enter_context(NodeSpinner(
            partial(Observer, profile=profile), namespace=options.namespace))
        process = stack.enter_context(Process(
            command, listener=sys.stderr.write if options.verbose else None)) if command else None
        record = spinner.node.record
        Trial(spinner, spinner.node, say, STARTING if command else MEETING,
              is_alive=lambda: process is None or process.running).run()
        if process is not None and not process.running:
            record.notes.append(process.exit_message())
        return record


def versions() -> dict[str, str]:
    """Return what the workspace is made of that is judged, as far as it tells."""
    told = {'ROS': os.environ.get('ROS_DISTRO', '')}
    for package in ('rclpy', 'turtlesim', 'turtle_brick'):
        with suppress(PackageNotFoundError):
            told[package] = version(package)
    return {**told, 'rmw': get_rmw_implementation_identifier(), 'Python': python_version()}


def parse(args: Sequence[str]) -> tuple[argparse.Namespace, list[str]]:
    """Return the options and the command that starts the graph."""
    first, rest = __doc__.strip().split('\n\n', 1)
    parser = argparse.ArgumentParser(
        prog='referee', description=first.partition(': ')[2].capitalize(), epilog=rest,
        usage='%(prog)s [options] [-- COMMAND ...]',
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--namespace', default='', metavar='NAME',
                        help='the namespace that the graph is in')
    for name, kind, words in (
            ('profile', 'FILE', 'YAML: what the implementation calls topics and services, and '
             'numbers that no node tells'),
            ('json', 'FILE', 'write everything as JSON'),
            ('page', 'FILE', 'write a page with plots (HTML)'),
            ('summary', 'DIR', 'judge nothing: tell in one table of all JSON files below'),
            ('csv', 'FILE', 'write that table')):
        parser.add_argument(f'--{name}', type=Path, metavar=kind, help=words)
    parser.add_argument('--verbose', action='store_true',
                        help='show what the graph prints that is started')
    # `ros2 run` keeps a "--" that comes first for itself.
    parser.add_argument('command', nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    args = list(args)
    place = args.index('--') if '--' in args else len(args)
    options = parser.parse_args(args[:place])
    for name in ('csv', 'json', 'page'):
        path = getattr(options, name)
        if path is not None and not path.parent.is_dir():
            parser.error(f'--{name} {path}: there is no directory {path.parent}')
    command = [*options.command, *args[place + 1:]]
    if options.summary and (command or options.json) or options.csv and not options.summary:
        parser.error('--csv goes with --summary, --json and a command do not')
    return options, command


def main(args: Sequence[str] | None = None) -> int:
    """Judge a graph; return the exit status."""
    options, command = parse(sys.argv[1:] if args is None else args)
    begin = monotonic()

    def say(text: str) -> None:
        print(f'{monotonic() - begin:6.1f} s  {text}', file=sys.stderr, flush=True)

    profile = Profile()
    try:
        if options.profile is not None:
            profile.load(options.profile)
        if options.summary is not None:
            return report.summarize(
                options.summary, [rule.name for rule in RULES], options.csv, options.page)
        with ExitStack() as reserved:
            if command and not os.environ.get('ROS_DOMAIN_ID'):
                restrict_to_localhost()
                os.environ['ROS_DOMAIN_ID'] = str(reserved.enter_context(reserved_domain()))
            record = watch(profile, options, command, say)
        about = {'date': f'{datetime.now().astimezone():%Y-%m-%d %H:%M %z}',
                 'command': shlex.join(command), 'versions': versions(),
                 'numbers': profile.numbers, 'seconds': round(monotonic() - begin, 1),
                 'notes': record.notes}
        judgements = [] if record.is_empty() else RULES.judge(record)
        if options.json is not None:
            options.json.write_text(report.as_json(judgements, about), encoding='utf-8')
        if not judgements:
            raise RuntimeError('; '.join(record.notes))
        if options.page is not None:
            options.page.write_text(report.page(judgements, about), encoding='utf-8')
        report.print_judgements(judgements, record.notes)
    except KeyboardInterrupt:
        print('referee: stopped, and nothing judged', file=sys.stderr)
        return 2
    except (OSError, RuntimeError, ValueError) as error:
        print(f'referee: {error}', file=sys.stderr)
        return 2
    return 1 if any(judgement.mark == BROKEN for judgement in judgements) else 0


if __name__ == '__main__':
    sys.exit(main())
