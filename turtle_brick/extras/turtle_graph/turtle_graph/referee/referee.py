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
referee: judge an implementation of the assignment by its topics, services and TF.

The referee sends the same commands as a user (goal_pose, tilt, place, drop). The referee reports
the measured and expected results for each requirement of the assignment, and marks the requirement
as met, failed or open. An open requirement could not be judged. To let the referee start and stop
the graph, pass the launch command after "--":

    ros2 run turtle_graph referee -- ros2 launch turtle_brick turtle_arena.launch.py view:=none

The exit status is 0 if no requirement failed, 1 if at least one failed, and 2 if no requirement
was judged.
"""

import argparse
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
import os
from pathlib import Path
import shlex
import sys
from time import monotonic, strftime
from typing import Any

from turtle_graph.client.domains import reserved_domain, restrict_to_localhost
from turtle_graph.client.observer import Observer
from turtle_graph.client.processes import crashes, explain_missing, launch_error, Process
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Record
from turtle_graph.client.spinning import NodeSpinner
from turtle_graph.referee import report
from turtle_graph.referee.classroom import HOURS, judge_class, rules_in_hour
from turtle_graph.referee.rules import arena_rules, robot_rules
from turtle_graph.referee.rules.rule import FAILED, Judgment, Rules
from turtle_graph.referee.trial import DISCOVERY_TIME, Trial

RULES = Rules((*robot_rules.RULES, *arena_rules.RULES))

START_TIME = 60.0
"""Timeout (s) for discovering a graph that the referee has started."""


def observe(profile: Profile, options: argparse.Namespace, command: Sequence[str],
            log: Callable[[str], None]) -> Record:
    """Send all test requests to a running or newly started graph, and return the record."""
    with ExitStack() as stack:
        process = stack.enter_context(Process(
            command, listener=sys.stderr.write if options.verbose else None)) if command else None

        def run_trial(namespace: str) -> Observer:
            spinner = stack.enter_context(
                NodeSpinner(partial(Observer, profile=profile), namespace=namespace))
            Trial(spinner, spinner.node, log, START_TIME if command else DISCOVERY_TIME,
                  is_alive=lambda: process is None or process.running).run()
            return spinner.node

        observer = run_trial(options.namespace)
        namespaces = observer.other_namespaces()
        if command and not observer.record.idle and len(namespaces) == 1:
            # The command started a graph in a different namespace.
            observer = run_trial(namespaces.pop())
        if process is not None:
            add_faults(observer.record, process)
        return observer.record


def add_faults(record: Record, process: Process) -> None:
    """Record the crashes and errors in the output of the command that started the graph."""
    # Without a display, rviz2 cannot run, so a crash of rviz2 is ignored.
    record.crashes = [explain_missing(crash) for crash in crashes(process.output)
                      if os.environ.get('DISPLAY') or not crash.startswith('rviz2 ')]
    error = launch_error(process.output) or ('' if process.running else process.exit_message())
    if not record.idle and error:
        record.notes, record.crashes = [f'found no graph: {explain_missing(error)}'], []
    elif not process.running:
        record.notes.append(process.exit_message())


def parse(args: Sequence[str]) -> tuple[argparse.Namespace, list[str]]:
    """Split the arguments into options and the command that starts the graph."""
    first, rest = __doc__.strip().split('\n\n', 1)
    parser = argparse.ArgumentParser(
        prog='referee', description=first.partition(': ')[2].capitalize(), epilog=rest,
        usage='%(prog)s [options] [-- COMMAND ...]',
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--namespace', default='', metavar='NAME', help='namespace of the graph')
    for name, kind, text in (
            ('profile', 'FILE', 'YAML file with other names for topics and services, and with '
             'numbers that no node provides as parameters'),
            ('json', 'FILE', 'write all results as JSON'),
            ('page', 'FILE', 'write an HTML page with plots'),
            ('summary', 'DIR', 'summarize all JSON files below a directory, but judge no graph'),
            ('csv', 'FILE', 'write the summary or the class table as CSV')):
        parser.add_argument(f'--{name}', type=Path, metavar=kind, help=text)
    parser.add_argument(
        '--class', type=Path, metavar='DIR', dest='classroom',
        help='judge all workspaces in a directory (one per student), and write judged/*, '
             'class.csv and class.html')
    parser.add_argument('--hour', type=int, choices=HOURS,
                        help='judge only the requirements for one hour of class')
    parser.add_argument('--student', metavar='NAME', help='student name shown on the page')
    parser.add_argument('--note', action='append', default=[], help=argparse.SUPPRESS)
    parser.add_argument('--verbose', action='store_true', help='show the output of the command')
    # `ros2 run` removes the "--" if it is the first argument.
    parser.add_argument('command', nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    args = list(args)
    split = args.index('--') if '--' in args else len(args)
    options = parser.parse_args(args[:split])
    for name in ('csv', 'json', 'page'):
        path = getattr(options, name)
        if path is not None and not path.parent.is_dir():
            parser.error(f'--{name} {path}: the directory {path.parent} does not exist')
    command = [*options.command, *args[split + 1:]]
    if options.classroom and (options.summary or options.json or options.student):
        parser.error('--class cannot be combined with --summary, --json or --student')
    if options.classroom and not options.classroom.is_dir():
        parser.error(f'--class {options.classroom} is not a directory')
    if options.summary and (command or options.json):
        parser.error('--summary cannot be combined with --json or a command')
    if options.csv and not (options.summary or options.classroom):
        parser.error('--csv requires --summary or --class')
    return options, command


def judge(rules: Rules, profile: Profile, options: argparse.Namespace, command: Sequence[str]
          ) -> list[Judgment]:
    """Judge a graph and write all reports, or raise RuntimeError if no graph was found."""
    begin = monotonic()

    def log(text: str) -> None:
        print(f'{monotonic() - begin:6.1f} s  {text}', file=sys.stderr, flush=True)

    with ExitStack() as stack:
        if command and not os.environ.get('ROS_DOMAIN_ID'):
            restrict_to_localhost()
            os.environ['ROS_DOMAIN_ID'] = str(stack.enter_context(reserved_domain()))
        record = observe(profile, options, command, log)
    record.notes = [*options.note, *record.notes]
    log('evaluating the measurements')
    judgments = rules.judge(record) if record.idle else []
    about: dict[str, Any] = {
        'student': options.student, 'date': strftime(report.DATE), 'command': shlex.join(command),
        'numbers': profile.numbers, 'seconds': round(monotonic() - begin, 1),
        'crashes': record.crashes, 'notes': record.notes, 'overload': record.stall_summary()}
    if options.json is not None:
        options.json.write_text(report.as_json(judgments, about), encoding='utf-8')
    if not judgments:
        raise RuntimeError('; '.join([*record.crashes, *record.notes]))
    if options.page is not None:
        options.page.write_text(report.page(judgments, about), encoding='utf-8')
    report.print_judgments(judgments, about)
    return judgments


def main(args: Sequence[str] | None = None) -> int:
    """Run the referee and return the exit status."""
    options, command = parse(sys.argv[1:] if args is None else args)
    profile = Profile()
    try:
        if options.profile is not None:
            profile.load(options.profile)
        rules = rules_in_hour(RULES, options.hour)
        if options.classroom is not None:
            return judge_class(rules, options, command)
        if options.summary is not None:
            return report.summarize(
                options.summary, [rule.name for rule in rules], options.csv, options.page)
        judgments = judge(rules, profile, options, command)
    except KeyboardInterrupt:
        print('referee: interrupted', file=sys.stderr)
        return 2
    except (OSError, RuntimeError, ValueError) as error:
        print(f'referee: {error}', file=sys.stderr)
        return 2
    return 1 if any(judgment.mark == FAILED for judgment in judgments) else 0
