# SPDX-License-Identifier: Apache-2.0
"""Find the errors in the output of ros2 launch, and say what is missing."""

from importlib.util import find_spec
from pathlib import Path
import re
import signal

DEATH = re.compile(r'^\[ERROR\] \[((\S+)-\d+)\]: process has died .*exit code (-?\d+),', re.M)
"""Pattern for a "process has died" message, with groups for process label, name and exit code."""
TRACEBACK = re.compile(r'^ *Traceback .*\n(?:(?: .*)?\n)*(.+)', re.M)
"""Pattern for a Python traceback, with a group for the error in the last line."""
LAUNCH_ERROR = re.compile(r'^\[ERROR\] \[launch\]: Caught exception in launch [^:]*: '
                          r'((?:.|\n(?!\[))*)', re.M)
"""Pattern for the error that ends ros2 launch, with a group for the whole message."""
MISSING = re.compile(r"[Pp]ackage '([\w.]+)' not found|No module named '([\w.]+)")
"""Pattern for an error message with the name of a missing package or Python module."""
LATER = ('turtlesim_msgs',)
"""Packages of later releases of ROS."""
LACKS = re.compile(r'[Tt]his environment|stand-in for|is for another release')
"""Pattern for an error message about a part of ROS that only the environment lacks."""


def launch_error(output: str) -> str:
    """Return the error that prevented ros2 launch from starting a graph, or ''."""
    errors = LAUNCH_ERROR.findall(output)
    if not errors:
        return '; '.join(crashes(output))
    error = errors[-1]
    # A sentence about the launch file precedes the errors of the parsers. The first parser is the
    # one for the file type.
    sentence, *causes = error.split('\n - ')
    if causes and 'Captured' not in sentence:
        error = causes[0]
    command, _, printed = error.partition('Captured stderr output:')
    error = traceback_error(printed or error) or printed or error
    if printed:
        program = Path(command.partition('Command: ')[2].partition(' ')[0]).name
        error = f'{program} printed an error or a warning, which stops the launch: {error}'
    return ' '.join(error.split())


def crashes(output: str) -> list[str]:
    """Extract the name and error of each failed process from the output of ros2 launch."""
    messages = []
    for label, name, status in DEATH.findall(output):
        if int(status) in (-signal.SIGINT, -signal.SIGTERM):
            continue  # The process was stopped by ros2 launch.
        printed = ''.join(f'{line.removeprefix(f"[{label}] ")}\n' for line in output.splitlines()
                          if line.startswith(f'[{label}] '))
        messages.append(f'{name} crashed: {traceback_error(printed) or f"exit status {status}"}')
    return list(dict.fromkeys(messages))


def traceback_error(printed: str) -> str:
    """Return the error that a traceback ends with, or the first one if handling it also failed."""
    errors = TRACEBACK.findall(printed)
    if not errors:
        return ''
    return errors[0] if 'During handling of the above exception, ' in printed else errors[-1]


def explain_missing(error: str) -> str:
    """Extend an error message to say whether the workspace or the environment lacks a package."""
    error = error.partition(', searching: ')[0].strip('"')
    if LACKS.search(error):
        return f'{error} (the environment may lack it)' if 'stand-in for' in error else error
    match = MISSING.search(error)
    if match is None:
        return error
    package, module = match.groups()
    name = package or module
    if name in LATER:
        return f'{error} (the workspace is for another release: Jazzy does not contain {name})'
    if name.startswith('turtle_brick'):
        return f'{error} (the workspace does not contain {name})'
    if module and '.' not in module and find_spec(module):
        return f'{error} (it is here, but the program was started with another Python)'
    return f'{error} (the workspace and this installation of ROS do not contain {name})'
