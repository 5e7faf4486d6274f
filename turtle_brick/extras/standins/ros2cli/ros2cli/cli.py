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
"""The `ros2` command, which runs a verb such as `topic list`."""

import argparse
from collections import defaultdict
from contextlib import redirect_stdout
from functools import partial
from importlib import import_module
from io import StringIO
import os
from pathlib import Path
import re
import signal
import sys
import traceback

import argcomplete
import yaml


def positive(text):
    """Convert an argument to a positive number."""
    if not float(text) > 0.0:
        raise argparse.ArgumentTypeError('Value must be positive')
    return float(text)


class LeftOut(argparse.Action):
    """An unsupported option, which ends the command with an error."""

    def __call__(self, parser, namespace, values, option_string=None):
        sys.exit(f'this stand-in for ros2cli does not support {parser.prog} {option_string}')


TYPES = {'int': int, 'float': float, 'positive': positive, 'left out': LeftOut}
"""Python objects for the `type` and `action` values in command_line.yaml."""


def add_arguments(parser, arguments):
    """Add arguments to a parser. Each list within `arguments` is a mutually exclusive group."""
    for each in arguments:
        if isinstance(each, list):
            add_arguments(parser.add_mutually_exclusive_group(), each)
            continue
        for names, options in each.items():
            if isinstance(options, str):
                options = {'action': 'store_true', 'help': options}
            parser.add_argument(*names.split(), **{
                name: TYPES.get(value, value) if name in ('action', 'type') else value
                for name, value in options.items()})


def add_commands(parser, prefix, typed, table):
    """Add the commands with a given prefix to a parser. Only `typed` commands get arguments."""
    commands = {name[len(prefix):]: text for name, text in table['words'].items()
                if name.startswith(prefix) and ' ' not in name[len(prefix):]}
    width = max(len(name) for name, text in commands.items() if text)
    children = parser.add_subparsers(
        title='Commands', description=''.join(
            f'{name:{width}}  {text}\n' for name, text in commands.items() if text),
        metavar=f'Call `{f"ros2 {prefix}".strip()} <command> -h` for more detailed usage.')
    parser.set_defaults(function=lambda _: parser.print_help())
    for name, text in commands.items():
        if name in typed[:1]:
            child = children.add_parser(name, description=text,
                                        formatter_class=argparse.RawDescriptionHelpFormatter)
            add_command(child, prefix + name, typed[1:], table)
        elif not name.startswith('_'):
            children.add_parser(name)


def add_command(parser, command, typed, table):
    """Add a command's arguments and either its function or its subcommands to a parser."""
    add_arguments(parser, table['arguments'].get(command, ()))
    for module, commands in table['modules'].items():
        if command in commands:
            # Import only this command's module because `ros2 run` starts faster without rclpy.
            parser.set_defaults(function=getattr(import_module(f'ros2cli.{module}'),
                                                 command.replace(' ', '_').strip('_')))
            return
    add_commands(parser, f'{command} ', typed, table)


def parse(argv):
    """Parse the command line and select the function to run."""
    text = Path(__file__).with_name('command_line.yaml').read_text(encoding='utf-8')
    table = yaml.load(text, Loader=yaml.CSafeLoader)
    parser = argparse.ArgumentParser(
        prog='ros2', formatter_class=argparse.RawDescriptionHelpFormatter, **table['ros2'])
    add_arguments(parser, table['arguments']['ros2'])
    completing = '_ARGCOMPLETE' in os.environ  # The user has pressed Tab.
    line = os.environ['COMP_LINE'].split()[1:] if completing else argv
    words = [word for word in line if not word.startswith('-')]
    for name, instead in table['instead'].items():
        if f'{" ".join(words)} '.startswith(f'{name} '):
            sys.exit(f'ros2 {name} is not supported by this stand-in: {instead}')
    add_commands(parser, '', words, table)
    if completing:
        argcomplete.autocomplete(
            parser, exclude=['-h', '--help'], always_complete_options=False,
            default_completer=partial(complete, table['completed']))
    return parser.parse_args(argv)


def complete(verbs, action, parsed_args, **_):
    """Return completions for an argument by running another verb."""
    os.environ.pop('_ARGCOMPLETE', None)
    with redirect_stdout(StringIO()) as output:
        if action.dest in verbs:
            given = defaultdict(str, vars(parsed_args))
            args = parse(verbs[action.dest].format_map(given).split())
            args.function(args)
            leave_graph(0)
    return [line.split()[-1] for line in output.getvalue().splitlines() if line.strip()]


def leave_graph(status):
    """Leave the ROS graph if a command has joined it."""
    if 'ros2cli.graph' in sys.modules:
        sys.modules['ros2cli.graph'].leave(status)


def main():
    """Run the verb given on the command line and exit with its status."""
    # Signals end the process without an exception, which Python may ignore during an import, until
    # the verb has joined the graph. A background job in a shell script ignores SIGINT by default.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    try:
        args = parse(sys.argv[1:])
        if not args.use_python_default_buffering:
            sys.stdout.reconfigure(line_buffering=True)
        status = args.function(args)
        sys.stdout.flush()
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
