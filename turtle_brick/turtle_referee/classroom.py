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
Judge the workspaces of a class one by one, each in its own environment and ROS domain.

Each subdirectory of the class directory is a built workspace. Each workspace's environment
contains only its own packages and the ROS installation.
"""

import argparse
from collections.abc import Sequence
from contextlib import suppress
from itertools import product
import os
from pathlib import Path
import sys

from graph_client.processes import END_TIME, Process
from turtle_referee import report
from turtle_referee.rules.rule import Rules

HOURS = {
    1: ('frames', 'names', 'URDF', 'rate', 'odom'),
    2: ('joint_states', 'drive: rolling', 'drive: stem', 'tilt'),
    3: ('walls', 'brick', 'markers', 'place', 'drop', 'fall', 'slide'),
    4: ('cmd_vel', 'drive: goal', 'drive: overshoot', 'drive: speed', 'drive: straight'),
    5: ('verdict', 'text', 'carry', 'tip off', 'again')}
"""Name prefixes of the requirements judged in each hour of class."""

RESULTS = Path('judged')
"""Directory for the JSON files and HTML pages of all students."""

PACKAGES = ('turtle_brick', 'turtle_brick_interfaces')
"""Packages to hide from the environment before a workspace is sourced."""

INSTALL_DIRECTORIES = ('install', '.ros/install')
"""Directories, relative to a workspace, in which colcon and env.bash install packages."""

SHARE_DIRECTORIES = ('turtle_brick/share/turtle_brick', 'share/turtle_brick')
"""Paths to the package's `share` directory in isolated and in merged installations."""

LAUNCH_FILES = ('turtle_arena.launch.py', 'turtle_arena.launch.xml')
"""Launch files for the arena, in order of preference."""

SOURCE = 'IFS= source "$0" && exec "$@"'
"""Bash code that sources a workspace and runs a command. The empty IFS keeps spaces in paths."""

JUDGE = ('import sys; sys.path[0] = sys.argv.pop(1); '
         'from turtle_referee.referee import main; sys.exit(main())')
"""Python program that runs this referee, even if the workspace contains another referee."""

TIME_LIMIT = 600.0
"""Time limit (s) for judging one workspace."""


def rules_in_hour(rules: Rules, hour: int | None) -> Rules:
    """Return the rules for a given hour of class, or all rules if the hour is None."""
    return rules if hour is None else Rules(
        rule for rule in rules if rule.name.startswith(HOURS[hour]))


def clean_environment() -> dict[str, str]:
    """Return environment variables without the paths of workspaces that contain PACKAGES."""
    hidden = [prefix for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
              if any(Path(prefix, 'share', package).is_dir() for package in PACKAGES)]

    def is_hidden(entry: str) -> bool:
        return (any(f'{entry}/'.startswith(f'{prefix}/') for prefix in hidden)
                or any(Path(entry, package).is_dir() for package in PACKAGES))

    paths = {name: os.pathsep.join(one for one in value.split(os.pathsep) if not is_hidden(one))
             for name, value in os.environ.items() if name.endswith('PATH')}
    return {**paths, 'ROS_DOMAIN_ID': '', 'COLCON_PYTHON_EXECUTABLE': sys.executable}


def find_install(workspace: Path) -> tuple[Path, Path] | None:
    """Return a workspace's setup file and share directory, or None if either is missing."""
    for install, share in product(INSTALL_DIRECTORIES, SHARE_DIRECTORIES):
        setup = workspace / install / 'local_setup.bash'
        if setup.is_file() and (workspace / install / share).is_dir():
            return setup, workspace / install / share
    return None


def judge_workspace(workspace: Path, json: Path, page: Path, options: argparse.Namespace,
                    command: Sequence[str]) -> tuple[int, str]:
    """Judge a workspace. Return the exit status and the reason for any missing result."""
    found = find_install(workspace)
    if found is None:
        return 2, 'not built'
    setup, share = found
    if not command:
        files = [name for name in LAUNCH_FILES if (share / 'launch' / name).is_file()]
        if not files:
            return 2, f'not built: {LAUNCH_FILES[0]} is not installed'
        command = ['ros2', 'launch', 'turtle_brick', files[0], 'view:=none']
    arguments = [f'--student={workspace.name}', f'--json={json}', f'--page={page}']
    arguments += [f'--{name}={getattr(options, name)}'
                  for name in ('hour', 'namespace', 'profile') if getattr(options, name)]
    if options.verbose:
        arguments.append('--verbose')
    with Process(['bash', '-c', SOURCE, str(setup.resolve()), sys.executable, '-c', JUDGE,
                  str(Path(__file__).parents[1]), *arguments, '--', *command],
                 clean_environment(), sys.stderr.write if options.verbose else None) as process:
        try:
            with suppress(TimeoutError):
                process.wait(TIME_LIMIT)
        finally:
            process.stop(timeout=2.0 * END_TIME)  # The referee stops the graph before it exits.
        if json.exists():
            return process.wait(0.0), ''
        return 2, process.exit_message()


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
        status, reason = judge_workspace(workspace, json, page, options, command)
        if reason:
            json.write_text(report.as_json([], {
                'date': report.date(), 'notes': [reason]}), encoding='utf-8')
        statuses.add(status)
    report.summarize(RESULTS, [rule.name for rule in rules], options.csv or Path('class.csv'),
                     options.page or Path('class.html'), [path.name for path in workspaces])
    return statuses.pop() if len(statuses) == 1 else 1
