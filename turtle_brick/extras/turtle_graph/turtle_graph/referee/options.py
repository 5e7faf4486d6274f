# SPDX-License-Identifier: Apache-2.0
"""
referee: judge an implementation of the assignment by its topics, services and TF.

The referee sends the same commands as a user (goal_pose, tilt, place, drop). The referee reports
the measured and expected results for each requirement of the assignment, and marks the requirement
as met, failed or open. An open requirement could not be judged. To let the referee start and stop
the graph, pass the launch command after "--":

    ros2 run turtle_graph referee -- ros2 launch turtle_brick turtle_arena.launch.py view:=none

The exit status is 0 if no requirement failed and no node crashed, 1 if one did, and 2 if the
judgment is incomplete: it was interrupted, found no graph, or left more than ten requirements open
because of the load of the machine.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

HOURS = {
    1: ('frames', 'names', 'config', 'URDF', 'rate', 'odom'),
    2: ('joint_states', 'rate: joint_states', 'drive: rolling', 'drive: stem', 'tilt'),
    3: ('walls', 'brick', 'frames: brick', 'rate: brick', 'markers', 'place', 'drop', 'fall',
        'slide'),
    4: ('cmd_vel', 'rate: cmd_vel', 'drive: goal', 'drive: overshoot', 'drive: speed',
        'drive: straight'),
    5: ('verdict', 'text', 'carry', 'tip off', 'again')}
"""Name prefixes of the requirements judged in each hour of class. The longest prefix counts."""


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
            ('record', 'FILE', 'save everything that was observed'),
            ('page', 'FILE', 'write an HTML page with plots'),
            ('summary', 'DIR', 'summarize all JSON files below a directory, but judge no graph'),
            ('csv', 'FILE', 'write the summary or the class table as CSV')):
        parser.add_argument(f'--{name}', type=Path, metavar=kind, help=text)
    parser.add_argument(
        '--from', type=Path, metavar='FILE', dest='from_file',
        help='judge what --record has saved, without a graph')
    parser.add_argument(
        '--class', type=Path, metavar='DIR', dest='classroom',
        help='judge all workspaces in a directory (one per student), and write all results to '
             'the directory judged')
    parser.add_argument('--setup', type=Path, metavar='FILE',
                        help='setup file of a workspace to source for the command only')
    parser.add_argument('--in-namespace', type=Path, metavar='FILE',
                        help='launch file to start a second time, in a namespace, to judge '
                             'whether names are relative')
    parser.add_argument('--hour', type=int, choices=HOURS,
                        help='judge only the requirements for one hour of class')
    parser.add_argument('--student', metavar='NAME', help='student name shown on the page')
    parser.add_argument('--note', metavar='TEXT', action='append', default=[],
                        help='note to add to the results')
    parser.add_argument('--verbose', action='store_true', help='show the output of the command')
    # `ros2 run` removes the "--" if it is the first argument.
    parser.add_argument('command', nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    args = list(args)
    split = args.index('--') if '--' in args else len(args)
    options = parser.parse_args(args[:split])
    for name in ('csv', 'json', 'page', 'record'):
        path = getattr(options, name)
        if path is not None and not path.parent.is_dir():
            parser.error(f'--{name} {path}: the directory {path.parent} does not exist')
    command = [*options.command, *args[split + 1:]]
    if options.classroom and (options.summary or options.json or options.student
                              or options.setup or options.in_namespace):
        parser.error('--class cannot be combined with --summary, --json, --student, --setup or '
                     '--in-namespace')
    if options.classroom and not options.classroom.is_dir():
        parser.error(f'--class {options.classroom} is not a directory')
    if options.summary and (command or options.json):
        parser.error('--summary cannot be combined with --json or a command')
    if options.from_file and (command or options.record):
        parser.error('--from cannot be combined with --record or a command')
    if options.csv and not (options.summary or options.classroom):
        parser.error('--csv requires --summary or --class')
    return options, command
