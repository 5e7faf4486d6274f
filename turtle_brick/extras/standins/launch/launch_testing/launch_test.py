# SPDX-License-Identifier: Apache-2.0
"""The `launch_test` command."""

from __future__ import annotations

import argparse
import importlib.util
import os
import signal
import sys
from types import ModuleType

from launch_testing.loader import TestRun
from launch_testing.test_runner import LaunchTestRunner


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command to a parser."""
    parser.add_argument('launch_test_file', help='Path to the launch test.')
    parser.add_argument('--package-name', help='Name of the package the test is in. Useful to '
                        'aggregate xUnit reports.')
    parser.add_argument('-v', '--verbose', action='store_true', help='Run with verbose output')
    parser.add_argument('-s', '--show-args', '--show-arguments', action='store_true',
                        help='Show arguments that may be given to the launch test.')
    parser.add_argument('launch_arguments', nargs='*', help="Arguments in '<name>:=<value>' "
                        'format (for duplicates, last one wins).')
    parser.add_argument('--junit-xml', metavar='XMLPATH',
                        help='Do write xUnit reports to specified path.')


def load_module(path: str) -> ModuleType:
    """Import the module in a file."""
    name = os.path.splitext(os.path.basename(path))[0]
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main() -> bool:
    """Run the tests in a file, and return whether a test has failed."""
    parser = argparse.ArgumentParser(description='Launch integration testing tool.')
    add_arguments(parser)
    options = parser.parse_args()
    path = options.launch_test_file
    if not os.path.isfile(path):
        parser.error(f"Test file '{path}' does not exist")
    for given, name in ((options.show_args, '-s'), (options.junit_xml, '--junit-xml')):
        if given:
            parser.error(f'this stand-in for launch_testing does not support {name}')
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Only the launch service handles Ctrl-C.
    arguments = {}
    for text in options.launch_arguments:
        name, _, arguments[name] = text.partition(':=')
    try:
        runner = LaunchTestRunner(TestRun(load_module(path)), arguments, options.verbose)
        return bool(runner.run())
    except Exception as error:
        parser.error(str(error))
