# SPDX-License-Identifier: Apache-2.0

"""
lesson: print the numbers and draw the figures for the lesson in doc/lesson.

Each part belongs to one page of the lesson. The sketches (sketch-*.svg) were drawn by hand.
"""

import argparse
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
import sys

from turtle_brick.core.parameters import load, ParameterError

PARTS = {'frames': 'frames', 'rolling': 'rolling', 'falling': 'falling', 'queue': 'queueing',
         'reach': 'reach'}
"""Modules of the parts of the lesson. They import matplotlib."""


def part(name: str) -> str:
    """Return the name of a lesson part, or raise ArgumentTypeError if the name is unknown."""
    if name not in PARTS:
        raise argparse.ArgumentTypeError(f'{name!r} (choose from {", ".join(PARTS)})')
    return name


def main(args: Sequence[str] | None = None) -> int:
    """Run the selected parts of the lesson, by default all, and return the exit status."""
    parser = argparse.ArgumentParser(
        prog='lesson',
        description='Print the numbers and draw the figures for the lesson in doc/lesson.')
    parser.add_argument('parts', nargs='*', type=part, metavar='PART',
                        help=f'part of the lesson: {", ".join(PARTS)} (default: all)')
    parser.add_argument('--params-file', type=Path, metavar='FILE',
                        help='parameter file (default: config/turtle.yaml of the package)')
    parser.add_argument('--output', type=Path, default=Path('lesson'), metavar='DIR',
                        help='directory for the figures (default: lesson)')
    options = parser.parse_args(args)
    try:
        parameters = load(options.params_file)
        options.output.mkdir(parents=True, exist_ok=True)
        for name in options.parts or PARTS:
            lesson = import_module(f'turtle_brick_tools.lesson.{PARTS[name]}')
            print(f'{name}:', *lesson.report(parameters), sep='\n', flush=True)
            path = options.output / f'lesson-{name}.png'
            lesson.draw(parameters, path)
            print(f'  {path}', flush=True)
    except (OSError, ParameterError) as error:
        print(f'lesson: {error}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('lesson: interrupted', file=sys.stderr)
        return 130
    return 0


if __name__ == '__main__':
    sys.exit(main())
