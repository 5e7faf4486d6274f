# SPDX-License-Identifier: Apache-2.0
"""Judge a graph or a class, as described in turtle_graph.referee.options."""

import argparse
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from functools import partial
import gc
import os
from pathlib import Path
import shlex
import signal
import sys
from time import monotonic, strftime

import psutil
from turtle_graph.client.domains import reserved_domain, restrict_to_localhost
from turtle_graph.client.launch_errors import crashes, explain_missing, launch_error
from turtle_graph.client.observer import Observer
from turtle_graph.client.processes import no_descendants, printable, Process
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Record
from turtle_graph.client.spinning import handle_signals, NodeSpinner
from turtle_graph.client.storage import load, save
from turtle_graph.referee import class_table, report
from turtle_graph.referee.classroom import judge_class, rules_in_hour
from turtle_graph.referee.options import parse
from turtle_graph.referee.rules import arena_rules, catcher_rules, robot_rules
from turtle_graph.referee.rules.rule import FAILED, Judgment, Rules
from turtle_graph.referee.trial import DISCOVERY_TIME, Program, PROGRAMS, STRUCTURE, Trial

RULES = Rules((*robot_rules.RULES, *arena_rules.RULES, *catcher_rules.RULES))

SOURCE_SETUP = ('bash', '-c', 'IFS= source "$1" >&2 && exec "${@:2}"', 'bash')
"""Beginning of a command that sources a setup file first. IFS keeps spaces in its paths."""
IN_NAMESPACE = Path(__file__).with_name('in_namespace.launch.xml')
"""Launch file that starts another launch file in a namespace."""
NAMESPACE = '/judged'
"""The namespace in that launch file."""
START_TIME = 60.0
"""Timeout (s) for discovering a graph that the referee has started."""
MAX_OPEN = 10
"""Maximum number of requirements that the load of the machine may leave open."""


def observe(profile: Profile, options: argparse.Namespace, command: Sequence[str],
            log: Callable[[str], None], program: Program, namespace: str) -> Record:
    """Observe a graph. If a command starts it, start it in a ROS domain of its own."""
    with ExitStack() as stack:
        if command:
            restrict_to_localhost()
            os.environ['ROS_DOMAIN_ID'] = str(stack.enter_context(reserved_domain()))
        log(f'judging ROS domain {os.environ.get("ROS_DOMAIN_ID") or 0}')
        if not command:
            observer = run_trial(stack, None, profile, log, program, namespace)
            observer.find_duplicates()
        else:
            process = stack.enter_context(Process(
                [*SOURCE_SETUP, str(options.setup), *command] if options.setup else command,
                listener=sys.stderr.write if options.verbose else None))
            observer = run_trial(stack, process, profile, log, program, namespace)
            namespaces = observer.other_namespaces()
            if (not observer.record.idle and len(namespaces) == 1
                    and report.INCOMPLETE not in observer.record.notes):
                # The command started a graph in a different namespace.
                observer = run_trial(stack, process, profile, log, program, namespaces.pop())
            add_faults(observer.record, process)
        for name, reason in observer.record.unclear.items():
            observer.record.note(f'{name} is unclear: {reason}')
        log('stopping')
        return observer.record


def run_trial(stack: ExitStack, process: Process | None, profile: Profile,
              log: Callable[[str], None], program: Program, namespace: str) -> Observer:
    """Send test requests to a graph, and return the observer that has recorded it."""
    make_observer = partial(Observer, profile=profile)
    if process is not None:
        make_observer.keywords['processes'] = partial(graph_processes, process)
    spinner = stack.enter_context(NodeSpinner(make_observer, namespace=namespace))
    observer: Observer = spinner.node
    try:
        Trial(spinner, observer, log, START_TIME if process else DISCOVERY_TIME,
              is_alive=lambda: process is None or process.running, program=program).run()
    except KeyboardInterrupt:
        observer.record.note(report.INCOMPLETE)
    observer.record_users()
    for topic, count in observer.poller.skipped.items():
        observer.record.note(f'skipped {count} messages on {topic} because reading them takes '
                             'more time than there is')
    return observer


def graph_processes(launched: Process) -> list[int]:
    """Return the IDs of all launched processes except rviz2, which only shows the graph."""
    identifiers = []
    for process in launched.family():
        with suppress(psutil.Error):  # The process has ended.
            if 'rviz2' not in (Path(argument).name for argument in process.cmdline()):
                identifiers.append(process.pid)
    return identifiers


def observe_names(record: Record, options: argparse.Namespace, log: Callable[[str], None]) -> None:
    """Start the graph in a namespace, and record the names that it has there."""
    command = ['ros2', 'launch', str(IN_NAMESPACE), f'judged_file:={options.in_namespace}']
    renamed = observe(Profile(), options, command, log, STRUCTURE, NAMESPACE)
    if renamed.idle:
        record.namespace = renamed.namespace
        record.publishers, record.users = renamed.publishers, renamed.users


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


def judge(rules: Rules, profile: Profile, options: argparse.Namespace, command: Sequence[str]
          ) -> int:
    """Judge a graph, write all reports and return the exit status, or raise RuntimeError."""
    begin = monotonic()

    def log(text: str) -> None:
        print(f'{monotonic() - begin:6.1f} s  {text}', file=sys.stderr, flush=True)

    record = observe(profile, options, command, log, PROGRAMS[options.hour], options.namespace)
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    if record.idle and options.in_namespace and report.INCOMPLETE not in record.notes:
        observe_names(record, options, log)
    record.notes = [*options.note, *record.notes]
    record.about = {
        'student': options.student, 'date': strftime(report.DATE), 'command': shlex.join(command),
        'domain': domain, 'seconds': round(monotonic() - begin, 1)}
    if options.record is not None:
        save(record, options.record)
    log('evaluating the measurements')
    return evaluate(rules, record, options)


def evaluate(rules: Rules, record: Record, options: argparse.Namespace) -> int:
    """Judge a record, write all reports and return the exit status, or raise RuntimeError."""
    judgments = rules.judge(record) if record.idle else []
    loads = record.loads or [os.getloadavg()[0]]
    machine = (f'load {loads[0]:.1f} at the start, {max(loads):.1f} at most, on {os.cpu_count()} '
               'processors')
    about = {**record.about, 'numbers': record.profile.numbers, 'crashes': record.crashes,
             'notes': record.notes, 'machine': machine, 'load': record.load_summary()}
    if options.json is not None:
        report.write(options.json, report.as_json(judgments, about))
    if not judgments:
        raise RuntimeError('; '.join([*record.crashes, *record.notes]))
    if options.page is not None:
        report.write(options.page, report.page(judgments, about))
    report.print_judgments(judgments, about)
    return exit_status(judgments, record)


def exit_status(judgments: Sequence[Judgment], record: Record) -> int:
    """Return 1 if a requirement failed or a node crashed, 2 for an incomplete judgment, or 0."""
    failed = bool(record.crashes) or FAILED in {judgment.mark for judgment in judgments}
    incomplete = not failed and report.left_open(judgments) > MAX_OPEN
    return 2 if incomplete or report.INCOMPLETE in record.notes else int(failed)


def main(args: Sequence[str] | None = None) -> int:
    """Run the referee and return the exit status."""
    options, command = parse(sys.argv[1:] if args is None else args)
    gc.disable()  # With 100,000 recorded messages, a collection could pause the referee for 0.4 s.
    handle_signals(signal.default_int_handler)  # SIGTERM and SIGHUP end like Ctrl-C.
    profile = Profile()
    try:
        if options.profile is not None:
            profile.load(options.profile)
        rules = rules_in_hour(RULES, options.hour)
        if options.classroom is not None:
            return judge_class(rules, options, command)
        if options.from_file is not None:
            return evaluate(rules, load(options.from_file), options)
        if options.summary is not None:
            return class_table.summarize(
                options.summary, [rule.name for rule in rules], options.csv, options.page)
        return judge(rules, profile, options, command)
    except KeyboardInterrupt:
        print('referee: interrupted', file=sys.stderr)
    except (OSError, RuntimeError, ValueError) as error:
        print(printable(f'referee: {error}'), file=sys.stderr)
    return 2


@no_descendants()
def main_alone() -> int:
    """Run the referee as a program that leaves no process behind."""
    return main()
