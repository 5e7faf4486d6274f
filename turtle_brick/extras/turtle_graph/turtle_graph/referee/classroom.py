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
Judge the workspaces of a class of students, each in its own environment and ROS domain.

Each subdirectory of the given directory contains the built workspace of one student. The
environment of a workspace contains only the ROS installation and the packages of that workspace.
"""

import argparse
from collections.abc import Sequence
from contextlib import suppress
from itertools import product
import os
from pathlib import Path
import re
import shlex
import sys
from time import strftime

from turtle_graph.client.processes import Process
from turtle_graph.referee import report
from turtle_graph.referee.options import HOURS
from turtle_graph.referee.rules.rule import FAILED, MET, OPEN, Rules

RESULTS = Path('judged')
"""Directory for the results of all students (JSON files and HTML pages)."""
PACKAGES = ('turtle_brick', 'turtle_brick_interfaces')
"""Packages to remove from the environment before a student's workspace is sourced."""
INSTALL_DIRECTORIES = ('install', '.ros/install')
"""Directories, relative to a workspace, into which colcon and env.bash install packages."""
SHARE_DIRECTORIES = ('turtle_brick/share/turtle_brick', 'share/turtle_brick')
"""Paths of turtle_brick's `share` directory in isolated and in merged colcon installations."""
LAUNCH_FILES = ('turtle_arena*launch.py', 'turtle_arena*launch.xml')
"""File name patterns for the launch files of the arena, in order of preference."""
ROS_SETUP = Path(__file__).resolve().parents[4] / 'scripts/ros.bash'
"""Bash script that sets up the ROS environment without sourcing any workspace."""
PREFIX = re.compile('^_colcon_prefix_chain_sh_COLCON_CURRENT_PREFIX=(.*)$', re.M)
"""Pattern for the line in colcon's setup.sh that contains the original install directory."""
SOURCE = '[ ! -e "$1" ] || source "$1" >&2 && IFS= source "$2" && exec "${@:3}"'
"""Bash code that sources ROS and a workspace, then runs a command. IFS keeps spaces in paths."""
JUDGE = ('import sys; sys.path[0] = sys.argv.pop(1); '
         'from turtle_graph.referee.referee import main; sys.exit(main())')
"""Python code that runs this referee even if a student's workspace contains another referee."""
TIME_LIMIT, END_TIME = 400.0, 60.0
"""Time limits (s) for judging one launch file, and for the report after an interruption."""


def rules_in_hour(rules: Rules, hour: int | None) -> Rules:
    """Return the rules for a given hour of class, or all rules if the hour is None."""
    def hour_of(name: str) -> int:
        return max((len(prefix), number) for number, prefixes in HOURS.items()
                   for prefix in prefixes if name.startswith(prefix))[1]

    return rules if hour is None else Rules(rule for rule in rules if hour_of(rule.name) == hour)


def clean_environment() -> dict[str, str]:
    """Return the environment without the paths of workspaces that contain any of PACKAGES."""
    hidden = [prefix for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
              if any(Path(prefix, 'share', package).is_dir() for package in PACKAGES)]

    def is_hidden(entry: str) -> bool:
        return (any(f'{entry}/'.startswith(f'{prefix}/') for prefix in hidden)
                or any(Path(entry, package).is_dir() for package in PACKAGES))

    paths = {name: os.pathsep.join(one for one in value.split(os.pathsep) if not is_hidden(one))
             for name, value in os.environ.items() if name.endswith('PATH')}
    return {**paths, 'ROS_DOMAIN_ID': '', 'COLCON_PYTHON_EXECUTABLE': sys.executable}


def find_install(workspace: Path) -> tuple[Path, Path]:
    """Return the setup file and share directory of a built workspace, or raise LookupError."""
    for install, share in product(INSTALL_DIRECTORIES, SHARE_DIRECTORIES):
        setup = workspace / install / 'local_setup.bash'
        if setup.is_file() and (workspace / install / share).is_dir():
            for chain in setup.parent.glob('setup.sh'):
                prefix = PREFIX.search(chain.read_text(encoding='utf-8'))
                if prefix is not None and not Path(prefix[1]).is_dir():
                    raise LookupError(f'not built on this machine: {install} belongs in '
                                      f'{prefix[1]}, which does not exist')
            return setup, workspace / install / share
    raise LookupError('not built')


def find_launch_files(share: Path) -> list[str]:
    """Return the names of all arena launch files below a share directory."""
    names = [path.name for pattern in LAUNCH_FILES for path in sorted(share.rglob(pattern))]
    if not names:
        raise LookupError('no file turtle_arena.launch.py or turtle_arena.launch.xml is installed')
    return list(dict.fromkeys(names))


def judge_launch(workspace: Path, setup: Path, json: Path, options: argparse.Namespace,
                 arguments: Sequence[str], command: Sequence[str]) -> int:
    """Judge a graph and return the exit status, or raise LookupError if there is no result."""
    print(f'  {shlex.join(command)}', file=sys.stderr, flush=True)
    with Process(['bash', '-c', SOURCE, 'bash', str(ROS_SETUP), str(setup.resolve()),
                  sys.executable, '-c', JUDGE, str(Path(__file__).parents[2]), *arguments, '--',
                  *command],
                 clean_environment(), sys.stderr.write if options.verbose else None,
                 workspace) as process:
        try:
            process.wait(TIME_LIMIT)
        except TimeoutError:
            print(f'  stopping after {TIME_LIMIT:g} s', file=sys.stderr, flush=True)
            with suppress(TimeoutError):
                process.stop(timeout=END_TIME)
    if not json.exists():
        raise LookupError(process.exit_message())
    return process.wait(0.0)


def judge_workspace(workspace: Path, json: Path, options: argparse.Namespace,
                    command: Sequence[str]) -> int:
    """Judge a workspace and return the exit status, or raise LookupError if there is no result."""
    setup, share = find_install(workspace)
    arguments = [f'--student={workspace.name}', f'--json={json.resolve()}',
                 f'--page={json.resolve().with_suffix(".html")}']
    arguments += [f'--{name}={getattr(options, name)}'
                  for name in ('hour', 'namespace') if getattr(options, name)]
    if options.profile:
        arguments.append(f'--profile={options.profile.resolve()}')
    if options.verbose:
        arguments.append('--verbose')
    for file in [''] if command else find_launch_files(share):
        status = judge_launch(workspace, setup, json, options, arguments, command or [
            'ros2', 'launch', 'turtle_brick', file, 'view:=none'])
        row = report.read(json, workspace.name)
        if any(row[mark] for mark in (MET, FAILED, OPEN)):
            break
        faults = '; '.join(row['faults'])
        arguments.append(f'--note={file or "the command"}: {faults}')
    return status


def judge_class(rules: Rules, options: argparse.Namespace, command: Sequence[str]) -> int:
    """Judge all workspaces in a directory, write a summary, and return the exit status."""
    workspaces = sorted(path for path in options.classroom.iterdir()
                        if path.is_dir() and not path.name.startswith('.'))
    if not workspaces:
        raise ValueError(f'{options.classroom} has no subdirectories, but --class requires '
                         'one subdirectory per student')
    RESULTS.mkdir(exist_ok=True)
    count = len(workspaces)
    results = [RESULTS / f'{workspace.name}.json' for workspace in workspaces]
    for path in (*results, *(json.with_suffix('.html') for json in results)):
        path.unlink(missing_ok=True)
    statuses = set()
    try:
        for number, (workspace, json) in enumerate(zip(workspaces, results), 1):
            print(f'{workspace.name} ({number} of {count}) ...', file=sys.stderr, flush=True)
            try:
                statuses.add(judge_workspace(workspace, json, options, command))
            except LookupError as error:
                json.write_text(report.as_json([], {
                    'date': strftime(report.DATE), 'notes': [str(error)]}), encoding='utf-8')
                statuses.add(2)
    finally:  # Ctrl-C prints the results so far.
        report.summarize(RESULTS, [rule.name for rule in rules], options.csv or Path('class.csv'),
                         options.page or Path('class.html'),
                         [json.stem for json in results if json.exists()])
    return statuses.pop() if len(statuses) == 1 else 1
