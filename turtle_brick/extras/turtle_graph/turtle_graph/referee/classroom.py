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

from turtle_graph.client.processes import END_TIME, Process
from turtle_graph.referee import report
from turtle_graph.referee.rules.rule import Rules

HOURS = {
    1: ('frames', 'names', 'URDF', 'rate', 'odom'),
    2: ('joint_states', 'drive: rolling', 'drive: stem', 'tilt'),
    3: ('walls', 'brick', 'markers', 'place', 'drop', 'fall', 'slide'),
    4: ('cmd_vel', 'drive: goal', 'drive: overshoot', 'drive: speed', 'drive: straight'),
    5: ('verdict', 'text', 'carry', 'tip off', 'again')}
"""Name prefixes of the requirements judged in each hour of class."""
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
ROS_SETUP = Path(__file__).parents[1] / 'scripts/ros.bash'
"""Bash script that sets up the ROS environment without sourcing any workspace."""
PREFIX = re.compile('^_colcon_prefix_chain_sh_COLCON_CURRENT_PREFIX=(.*)$', re.M)
"""Pattern for the line in colcon's setup.sh that contains the original install directory."""
SOURCE = '[ ! -e "$1" ] || source "$1" >&2 && IFS= source "$2" && exec "${@:3}"'
"""Bash code that sources ROS and a workspace, then runs a command. IFS keeps spaces in paths."""
JUDGE = ('import sys; sys.path[0] = sys.argv.pop(1); '
         'from turtle_graph.referee.referee import main; sys.exit(main())')
"""Python code that runs this referee even if a student's workspace contains another referee."""
TIME_LIMIT = 240.0
"""Time limit (s) for judging one launch file."""


def rules_in_hour(rules: Rules, hour: int | None) -> Rules:
    """Return the rules for a given hour of class, or all rules if the hour is None."""
    return rules if hour is None else Rules(
        rule for rule in rules if rule.name.startswith(HOURS[hour]))


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


def judge_launch(setup: Path, json: Path, options: argparse.Namespace, arguments: Sequence[str],
                 command: Sequence[str]) -> int:
    """Judge a graph and return the exit status, or raise LookupError if there is no result."""
    print(f'  {shlex.join(command)}', file=sys.stderr, flush=True)
    with Process(['bash', '-c', SOURCE, 'bash', str(ROS_SETUP), str(setup.resolve()),
                  sys.executable, '-c', JUDGE, str(Path(__file__).parents[2]), *arguments, '--',
                  *command],
                 clean_environment(), sys.stderr.write if options.verbose else None) as process:
        try:
            with suppress(TimeoutError):
                process.wait(TIME_LIMIT)
        finally:
            process.stop(timeout=2.0 * END_TIME)  # The referee stops the graph before exiting.
        if not json.exists():
            raise LookupError(process.exit_message())
        return process.wait(0.0)


def judge_workspace(workspace: Path, json: Path, page: Path, options: argparse.Namespace,
                    command: Sequence[str]) -> int:
    """Judge a workspace and return the exit status, or raise LookupError if there is no result."""
    setup, share = find_install(workspace)
    arguments = [f'--student={workspace.name}', f'--json={json}', f'--page={page}']
    arguments += [f'--{name}={getattr(options, name)}'
                  for name in ('hour', 'namespace', 'profile') if getattr(options, name)]
    if options.verbose:
        arguments.append('--verbose')
    for file in [''] if command else find_launch_files(share):
        status = judge_launch(setup, json, options, arguments, command or [
            'ros2', 'launch', 'turtle_brick', file, 'view:=none'])
        if status != 2:
            break
        faults = '; '.join(report.read(json, workspace.name)['faults'])
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
    statuses = set()
    for number, workspace in enumerate(workspaces, 1):
        print(f'{workspace.name} ({number} of {len(workspaces)}) ...', file=sys.stderr, flush=True)
        json, page = (RESULTS / f'{workspace.name}.{kind}' for kind in ('json', 'html'))
        json.unlink(missing_ok=True)
        page.unlink(missing_ok=True)
        try:
            statuses.add(judge_workspace(workspace, json, page, options, command))
        except (LookupError, TimeoutError) as error:
            json.write_text(report.as_json([], {
                'date': strftime(report.DATE), 'notes': [str(error)]}), encoding='utf-8')
            statuses.add(2)
    report.summarize(RESULTS, [rule.name for rule in rules], options.csv or Path('class.csv'),
                     options.page or Path('class.html'), [path.name for path in workspaces])
    return statuses.pop() if len(statuses) == 1 else 1
