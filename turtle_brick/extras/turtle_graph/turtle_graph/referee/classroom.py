# SPDX-License-Identifier: Apache-2.0
"""
Judge the workspaces of a class of students, each in its own environment and ROS domain.

Each subdirectory of the given directory contains the built workspace of one student. A graph runs
in an environment that contains only the ROS installation and the packages of its workspace. The
referee that judges it runs in another process, which can import only the workspace's interfaces.
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

from turtle_graph.client.launch_errors import LACKS, TRACEBACK
from turtle_graph.client.processes import printable, Process
from turtle_graph.referee import class_table, report
from turtle_graph.referee.options import HOURS
from turtle_graph.referee.rules.rule import FAILED, OPEN, Rules

RESULTS = Path('judged')
"""Directory for all results."""
PACKAGES = ('turtle_brick', 'turtle_brick_interfaces')
"""Packages to remove from the environment before a student's workspace is sourced."""
INSTALL_DIRECTORIES = ('install', '.ros/install')
"""Directories, relative to a workspace, into which colcon and env.bash install packages."""
SHARE_DIRECTORIES = ('turtle_brick/share/turtle_brick', 'share/turtle_brick')
"""Paths of turtle_brick's `share` directory in isolated and in merged colcon installations."""
LAUNCH_FILES = ('turtle_arena*launch.py', 'turtle_arena*launch.xml')
"""File name patterns for the launch files of the arena, in order of preference."""
INTERFACES = 'share/ament_index/resource_index/rosidl_interfaces'
"""Path, relative to a prefix, of the directory with one file per package with interfaces."""
PYTHON_DIRECTORIES = ('lib/python3*/site-packages', 'local/lib/python3*/dist-packages')
"""Patterns for the directories, relative to a prefix, that contain Python packages."""
PREFIX = re.compile('^_colcon_prefix_chain_sh_COLCON_CURRENT_PREFIX=(.*)$', re.M)
"""Pattern for the line in colcon's setup.sh that contains the original install directory."""
BUILD_LOGS = ('log/latest_build', '.ros/log/latest_build')
"""Directories, relative to a workspace, with colcon's logs of the last build."""
FAILED_JOB = re.compile(r"JobEnded: \{'identifier': '(.*)', 'rc': [^0]")
"""Pattern for the name of a package whose build failed, in the file events.log of colcon."""
REFEREE = Path(__file__).parent
"""Directory of the program that judges one graph. Running it does not use its installation."""
HOUR_OF_NAMES = 1
"""Hour of class with the requirement that is judged in a namespace."""
TIME_LIMIT, END_TIME = 400.0, 60.0
"""Time limits (s) for judging one launch file, and for the report after an interruption."""


class Unjudged(Exception):
    """Exception with a requirement in report.UNJUDGED, its mark and the reason for the mark."""


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

    paths = {name: os.pathsep.join(entry for entry in value.split(os.pathsep)
                                   if not is_hidden(entry))
             for name, value in os.environ.items() if name.endswith('PATH')}
    return {**paths, 'ROS_DOMAIN_ID': '', 'COLCON_PYTHON_EXECUTABLE': sys.executable}


def find_install(workspace: Path) -> tuple[Path, Path]:
    """Return the install and share directories of a built workspace, or raise Unjudged."""
    for name, share in product(INSTALL_DIRECTORIES, SHARE_DIRECTORIES):
        install = workspace / name
        # A failed build leaves the directory `share` without this file.
        if ((install / 'local_setup.bash').is_file()
                and (install / share / 'package.xml').is_file()):
            for path in install.glob('setup.sh'):
                prefix = PREFIX.search(path.read_text(encoding='utf-8', errors='replace'))
                if prefix is not None and not Path(prefix[1]).is_dir():
                    raise Unjudged('build', OPEN, f'not built on this machine: {name} belongs in '
                                   f'{prefix[1]}, which does not exist')
            return install, install / share
    raise Unjudged('build', FAILED, f'not built: {build_error(workspace)}')


def build_error(workspace: Path) -> str:
    """Return the first error in the logs of the last build of a workspace."""
    for directory in BUILD_LOGS:
        events = workspace / directory / 'events.log'
        if not events.is_file():
            continue
        failed = FAILED_JOB.search(events.read_text('utf-8', errors='replace'))
        if failed is not None:
            log = events.with_name(failed[1]) / 'stderr.log'
            text = printable(log.read_text('utf-8', errors='replace'))
            lines = [line.strip() for line in text.splitlines() if line.strip()]
            first = next((number for number, line in enumerate(lines) if 'error' in line.lower()),
                         max(len(lines) - 3, 0))
            error = (TRACEBACK.findall(text) or [' '.join(lines[first:first + 3])])[-1]
            return f'{failed[1]}: {error}'
    return 'there is no setup file of a package turtle_brick, and no log of a failed build'


def find_launch_files(share: Path) -> dict[str, Path]:
    """Return the names and paths of all arena launch files below a share directory."""
    paths = [path for pattern in LAUNCH_FILES for path in sorted(share.rglob(pattern))]
    if not paths:
        raise Unjudged('start', FAILED,
                       'no file turtle_arena.launch.py or turtle_arena.launch.xml is installed')
    return {path.name: path for path in paths}


def judging_environment(install: Path, share: Path) -> dict[str, str]:
    """Return a clean environment with the interfaces and files in an install directory."""
    environment = clean_environment()
    prefixes = {path.parents[4] for pattern in (INTERFACES, f'*/{INTERFACES}')
                for path in install.resolve().glob(f'{pattern}/*')}
    python = [str(path) for prefix in sorted(prefixes) for pattern in PYTHON_DIRECTORIES
              for path in prefix.glob(pattern)]
    # The program imports from the first directories of PYTHONPATH only what no other one has.
    for name, entries in (
            ('AMENT_PREFIX_PATH', [str(share.resolve().parents[1]),
                                   environment.get('AMENT_PREFIX_PATH', '')]),
            ('PYTHONPATH', [*python, environment.get('PYTHONPATH', '')]),
            ('LD_LIBRARY_PATH', [environment.get('LD_LIBRARY_PATH', ''),
                                 *(f'{prefix}/lib' for prefix in sorted(prefixes))])):
        environment[name] = os.pathsep.join(filter(None, entries))
    return environment


def judge_graph(workspace: Path, environment: dict[str, str], arguments: Sequence[str],
                json: Path, command: Sequence[str], verbose: bool) -> int:
    """Judge a graph and return the exit status, or raise Unjudged if there is no result."""
    json.unlink(missing_ok=True)
    print(f'  {printable(shlex.join(command))}', file=sys.stderr, flush=True)
    # With the option -E, Python executes no code from PYTHONPATH before the referee.
    with Process([sys.executable, '-E', str(REFEREE), *arguments, '--', *command],
                 environment, sys.stderr.write if verbose else None, workspace) as process:
        try:
            status = process.wait(TIME_LIMIT)
        except TimeoutError:
            print(f'  stopping after {TIME_LIMIT:g} s', file=sys.stderr, flush=True)
            status = 2
            with suppress(TimeoutError):
                process.stop(timeout=END_TIME)
    if not json.exists():
        raise Unjudged('start', OPEN, process.exit_message())
    return status


def shared_arguments(options: argparse.Namespace) -> list[str]:
    """Return the arguments of the referee that are the same for all workspaces."""
    arguments = [f'--{name}={value}' for name, value in (
        ('hour', options.hour), ('namespace', options.namespace),
        ('profile', options.profile and options.profile.resolve())) if value]
    return [*arguments, '--verbose'] if options.verbose else arguments


def judge_workspace(workspace: Path, json: Path, options: argparse.Namespace,
                    command: Sequence[str]) -> int:
    """
    Judge a workspace and return the exit status, or raise Unjudged if it could not be judged.

    :param json: file for the results
    :param command: command that starts the graph, or nothing for the launch files
    """
    install, share = find_install(workspace)
    arguments = [*shared_arguments(options), f'--student={workspace.name}', f'--json={json}',
                 f'--page={json.with_suffix(".html")}',
                 f'--setup={install.resolve() / "local_setup.bash"}']
    environment = judging_environment(install, share)
    launch_files = {} if command else find_launch_files(share)
    reasons: list[str] = []
    for name in launch_files or ['the command']:
        own = [f'--note={reason}' for reason in reasons]
        if name in launch_files and options.hour in (None, HOUR_OF_NAMES):
            own.append(f'--in-namespace={launch_files[name].resolve()}')
        status = judge_graph(workspace, environment, [*arguments, *own], json, command or [
            'ros2', 'launch', 'turtle_brick', name, 'view:=none'], options.verbose)
        row = class_table.read(json, workspace.name)
        if any(row[mark] for mark in report.COLORS):
            return status
        faults = '; '.join(fault for fault in row['faults'] if fault not in reasons)
        reasons.append(f'{name}: {faults}')
    reason = '; '.join(reasons)
    is_ours = LACKS.search(reason) or report.INCOMPLETE in reason
    raise Unjudged('start', OPEN if is_ours else FAILED, reason)


def find_workspaces(classroom: Path) -> list[Path]:
    """Return the subdirectories of a directory, or raise ValueError if it is not for a class."""
    workspaces = sorted(path for path in classroom.iterdir() if path.is_dir()
                        and not path.name.startswith('.') and path.resolve() != RESULTS.resolve())
    if not workspaces:
        raise ValueError(f'{classroom} has no subdirectories, but --class requires '
                         'one subdirectory per student')
    # The packages of a workspace may be in its top directory.
    packages = [path for path in workspaces if (path / 'package.xml').is_file()
                and not any((path / name).is_dir() for name in INSTALL_DIRECTORIES)]
    if packages or any((classroom / name).is_dir() for name in ('src', *INSTALL_DIRECTORIES)):
        raise ValueError(f'{classroom} is a workspace, but --class requires a directory with one '
                         'workspace per student')
    return workspaces


def judge_class(rules: Rules, options: argparse.Namespace, command: Sequence[str]) -> int:
    """Judge all workspaces in a directory, write a summary, and return the exit status."""
    workspaces = find_workspaces(options.classroom)
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / '.gitignore').write_text('*\n', encoding='utf-8')
    results = [RESULTS.resolve() / f'{workspace.name}.json' for workspace in workspaces]
    for path in (*results, *(json.with_suffix('.html') for json in results)):
        path.unlink(missing_ok=True)
    statuses = set()
    try:
        for number, (workspace, json) in enumerate(zip(workspaces, results), 1):
            print(f'{printable(workspace.name)} ({number} of {len(workspaces)}) ...',
                  file=sys.stderr, flush=True)
            try:
                statuses.add(judge_workspace(workspace, json, options, command))
            except Unjudged as error:
                report.write_unjudged(json, workspace.name, *error.args)
                statuses.add(2)
            except (OSError, ValueError) as error:  # Nothing in a workspace ends the class.
                report.write_unjudged(json, workspace.name, 'start', OPEN, f'not judged: {error}')
                statuses.add(2)
    finally:  # Ctrl-C prints the results so far.
        class_table.summarize(RESULTS, [rule.name for rule in rules],
                              options.csv or RESULTS / 'class.csv',
                              options.page or RESULTS / 'class.html',
                              [json.stem for json in results if json.exists()])
    return 1 if 1 in statuses else max(statuses, default=2)
