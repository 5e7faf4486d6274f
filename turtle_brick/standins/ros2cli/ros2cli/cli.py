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
"""The command `ros2`: its command line, which command_line.yaml describes, and its exit."""

import argparse
from contextlib import contextmanager, redirect_stdout
from functools import partial
from importlib import import_module
from io import StringIO
import os
from pathlib import Path
import re
import signal
import sys
import traceback

import yaml


def positive(text):
    """Convert an argument to a number above 0."""
    if not float(text) > 0.0:
        raise argparse.ArgumentTypeError('Value must be positive')
    return float(text)


def refuse(what):
    """Exit with a line that names what is left out."""
    sys.exit(f'{what}: this needs the real ros2cli, which this one stands in for')


class LeftOut(argparse.Action):
    """An option that is left out."""

    def __call__(self, parser, namespace, values, option_string=None):
        """Exit with a line about it."""
        refuse(f'{parser.prog} {option_string}')


@contextmanager
def undisturbed(*others):
    """
    Have Ctrl-C, SIGTERM and others wait: what they find half imported or made complains.

    :return: The signals that were held before, for a process that is started meanwhile.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, *others})
    try:
        yield before
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


TYPES = {'int': int, 'float': float, 'positive': positive, 'left out': LeftOut}


def add_arguments(parser, arguments):
    """Add arguments to a parser; a list holds those that exclude each other."""
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


def add_words(parser, before, typed, table):
    """Let words follow those `before`, and the typed one with all that can follow it."""
    words = {name[len(before):]: text for name, text in table['words'].items()
             if name.startswith(before) and ' ' not in name[len(before):]}
    width = max(len(word) for word in words if words[word])
    children = parser.add_subparsers(
        title='Commands', description=''.join(
            f'{word:{width}}  {text}\n' for word, text in words.items() if text),
        metavar=f'Call `{f"ros2 {before}".strip()} <command> -h` for more detailed usage.')
    parser.set_defaults(function=lambda _: parser.print_help())
    for word, text in words.items():
        if word not in typed[:1]:
            if word[0] != '_':
                children.add_parser(word)
            continue
        child = children.add_parser(word, description=text,
                                    formatter_class=argparse.RawDescriptionHelpFormatter)
        name = before + word
        add_arguments(child, table['arguments'].get(name, ()))
        module = [module for module, names in table['modules'].items() if name in names]
        if module:
            # only the one that is needed: `ros2 run` need not wait for rclpy
            child.set_defaults(function=getattr(
                import_module(f'ros2cli.{module[0]}'), name.replace(' ', '_').strip('_')))
        elif any(other.startswith(f'{name} ') for other in table['words']):
            add_words(child, f'{name} ', typed[1:], table)
        else:
            child.parse_known_args = lambda *_: refuse(f'ros2 {name}')


def parse(argv):
    """Return what a command line says; its `function` is to do it."""
    text = Path(__file__).with_name('command_line.yaml').read_text(encoding='utf-8')
    table = yaml.load(text, Loader=yaml.CSafeLoader)
    parser = argparse.ArgumentParser(
        prog='ros2', formatter_class=argparse.RawDescriptionHelpFormatter, **table['ros2'])
    add_arguments(parser, table['arguments']['ros2'])
    line = os.environ['COMP_LINE'].split()[1:] if '_ARGCOMPLETE' in os.environ else argv
    words = [word for word in line if not word.startswith('-')]
    for name, instead in table['instead'].items():
        if f'{" ".join(words)} '.startswith(f'{name} '):
            sys.exit(f'ros2 {name}: this needs a ROS 2 that is installed; here, {instead}')
    add_words(parser, '', words, table)
    if line is not argv:  # the user has pressed Tab
        from argcomplete import autocomplete
        autocomplete(parser, exclude=['-h', '--help'], always_complete_options=False,
                     default_completer=partial(complete, table['completed']))
    return parser.parse_args(argv)


def complete(verbs, action, parsed_args, **_):
    """Return what another verb says that an argument of the command line can be."""
    os.environ.pop('_ARGCOMPLETE', None)
    with redirect_stdout(StringIO()) as said:
        if action.dest in verbs:
            args = parse(verbs[action.dest].format(**vars(parsed_args)).split())
            args.function(args)
    return [line.split()[-1] for line in said.getvalue().splitlines()]


def main():
    """Do what the command line says."""
    status = None

    def interrupt(number, _):
        """End with the real one's status, whatever a middleware makes of the exception."""
        nonlocal status
        status = int(number)
        raise KeyboardInterrupt

    # What has been begun is tidied up on SIGTERM as well. A shell has its background jobs ignore
    # SIGINT.
    signal.signal(signal.SIGTERM, interrupt)
    signal.signal(signal.SIGINT, interrupt)
    try:
        with undisturbed():
            args = parse(sys.argv[1:])
        if not args.use_python_default_buffering:
            sys.stdout.reconfigure(line_buffering=True)
        status = args.function(args)
        sys.stdout.flush()
    except KeyboardInterrupt:
        pass
    except BrokenPipeError:  # nobody reads on, as in `ros2 topic echo /odom | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 1
    except RuntimeError as error:
        status = status or str(error)
    except (ValueError, re.error, yaml.YAMLError) as error:  # the end of the real one's traceback
        status = ''.join(traceback.format_exception_only(type(error), error)).rstrip()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(status)
