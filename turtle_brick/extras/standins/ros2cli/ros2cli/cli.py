# SPDX-License-Identifier: Apache-2.0
"""The `ros2` command, which runs a verb such as `topic list`."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import os
from pathlib import Path
import re
import signal
import sys
import traceback
from typing import Any

import argcomplete
from ros2cli.command import add_subparsers, CommandExtension, get_class, Status
from ros2pkg.api import get_executable_paths
import yaml

COMMANDS = {
    'action': 'Various action related sub-commands',
    'daemon': 'Various daemon related sub-commands',
    'interface': 'Show information about ROS interfaces',
    'launch': 'Run a launch file',
    'node': 'Various node related sub-commands',
    'param': 'Various param related sub-commands',
    'pkg': 'Various package related sub-commands',
    'run': 'Run a package specific executable',
    'service': 'Various service related sub-commands',
    'topic': 'Various topic related sub-commands'}
"""Description of each command. The command `topic` is in ros2topic/command/topic.py."""

HIDDEN_COMMANDS = ('static_transform_publisher', 'tf2_echo', 'view_frames')
"""Commands in ros2cli/command that programs of tf2_ros and tf2_tools run as `ros2 _tf2_echo`."""


def get_command(name: str) -> CommandExtension:
    """Return the command with a name."""
    package = 'ros2cli' if name == 'daemon' or name in HIDDEN_COMMANDS else f'ros2{name}'
    return get_class(f'{package}.command.{name}', name, 'Command')()


def is_installed(words: Sequence[str]) -> bool:
    """Return whether `run` or `launch` finds its package and executable, for example as source."""
    if words[0] not in ('run', 'launch'):
        return False
    try:
        paths = get_executable_paths(words[1])
    except RuntimeError:
        return False
    return words[0] == 'launch' or any(os.path.basename(path) in words[2:3] for path in paths)


def explain_alternative(words: Sequence[str]) -> None:
    """End the program with an alternative if the stand-in lacks the command."""
    text = Path(__file__).with_name('alternatives.yaml').read_text(encoding='utf-8')
    for name, alternative in yaml.load(text, Loader=yaml.CSafeLoader).items():
        if f'{" ".join(words)} '.startswith(f'{name} ') and not is_installed(words):
            sys.exit(f'ros2 {name} is not supported by this stand-in: {alternative}')


def make_parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """Return a parser. Only the command on the command line gets arguments."""
    parser = argparse.ArgumentParser(
        prog='ros2', formatter_class=argparse.RawDescriptionHelpFormatter,
        description='ros2 is an extensible command-line tool for ROS 2.',
        epilog='This is a stand-in for ros2cli. Missing verbs and options cause an error.')
    parser.add_argument(
        '--use-python-default-buffering', action='store_true',
        help='Do not force line buffering in stdout and instead use the python default '
        'buffering, which might be affected by PYTHONUNBUFFERED/-u and depends on whatever '
        'stdout is interactive or not')
    parser.set_defaults(main=lambda *, args: parser.print_help())
    subparsers = add_subparsers(parser, 'ros2', COMMANDS)
    for name in COMMANDS:
        if name not in words[:1]:
            subparsers.add_parser(name)
    for name in (*COMMANDS, *HIDDEN_COMMANDS):
        typed_name = f'_{name}' if name in HIDDEN_COMMANDS else name
        if typed_name in words[:1]:
            child = subparsers.add_parser(
                typed_name, description=COMMANDS.get(name),
                formatter_class=argparse.RawDescriptionHelpFormatter)
            command = get_command(name)
            child.set_defaults(main=command.main)
            command.add_arguments(child, f'ros2 {typed_name}', words[1:])
    return parser


def complete(parser: argparse.ArgumentParser) -> None:
    """Print completions and end the program if the user has pressed the Tab key."""
    argcomplete.autocomplete(parser, exclude=['-h', '--help'], always_complete_options=False)


def leave_graph(status: int) -> None:
    """Leave the ROS graph if a command has joined it."""
    if 'ros2cli.node.direct' in sys.modules:
        sys.modules['ros2cli.node.direct'].leave(status)


def run(argv: Sequence[str]) -> Status:
    """Run the command with the given arguments, and return its status."""
    completing = '_ARGCOMPLETE' in os.environ
    line = os.environ['COMP_LINE'].split()[1:] if completing else argv
    words = [word for word in line if not word.startswith('-')]
    explain_alternative(words)
    parser = make_parser(words)
    complete(parser)
    args = parser.parse_args(argv)
    if not args.use_python_default_buffering:
        sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    main_function: Callable[..., Any] = args.main
    status = main_function(args=args)
    sys.stdout.flush()
    return status


def main() -> None:
    """Run the command given on the command line and exit with its status."""
    # Signals end the process without an exception, which Python may ignore during an import, until
    # the verb has joined the graph. A background job in a shell script ignores SIGINT by default.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    try:
        status = run(sys.argv[1:])
    except KeyboardInterrupt as error:
        status = error.args[0]
    except BrokenPipeError:  # The reader, such as `head`, has closed the pipe.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 1
    except RuntimeError as error:
        status = str(error)
    except (OSError, ValueError, re.error, yaml.YAMLError) as error:
        # Print only the last lines of the traceback that the real command prints.
        status = ''.join(traceback.format_exception_only(type(error), error)).rstrip()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if isinstance(status, str):
        print(status, file=sys.stderr)
        status = 1
    leave_graph(status or 0)
    sys.exit(status)
