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
"""The stand-in for launch_testing 3.4.11: a pytest plugin and the `launch_test` command."""

import argparse
from contextlib import suppress
import functools
import importlib.util
import inspect
import os
import re
import signal
import sys
import threading
import unittest

from launch import LaunchDescription, LaunchService
from launch.actions import action, OnProcessIO, SetLaunchConfiguration
from launch.substitutions import missing_name
import pytest

__getattr__ = missing_name('launch_testing')
START_TIME = 15.0
MARKS = 'launch_test', 'rostest'
EXIT_OK, EXIT_SIGINT, EXIT_SIGQUIT, EXIT_SIGKILL, EXIT_SIGSEGV = 0, 130, 131, 137, 139
ReadyToTest = action('ReadyToTest', lambda context: context.emit('on_ready'))


def post_shutdown_test():
    def mark(test_class):
        test_class.after_shutdown = True
        return test_class
    return mark


def keep_alive(test_description):
    """Mark a test description so that its launch continues after all processes have exited."""
    test_description.keep_alive = True
    return test_description


class Record(list):
    """The output events, the name and the exit code of a process."""

    returncode = None

    def __init__(self, action):
        super().__init__()
        self.action, self.process_name = action, action.name

    def written_to(self, *streams):
        return b''.join(event.text for event in self if event.kind[3:] in streams)

    @property
    def text(self):
        return self.written_to('stdout', 'stderr')


class Processes:
    """The exit codes and output of processes, available to tests as proc_info and proc_output."""

    handle_once = False

    def __init__(self):
        self.changed, self.ready, self.found = threading.Condition(), threading.Event(), {}

    def matches(self, event):
        return True

    def handle(self, event, context):
        with self.changed:
            if event.kind == 'on_ready':
                self.ready.set()
            elif event.kind == 'on_start':
                self.found.setdefault(event.action, Record(event.action)).returncode = None
            elif event.kind == 'on_exit':
                self.found[event.action].returncode = event.returncode
            elif event.kind in OnProcessIO.kinds:
                self.found[event.action].append(event)
            self.changed.notify_all()

    def __iter__(self):
        return iter(list(self.found.values()))

    def __getitem__(self, process):
        return self.select(process)[0]

    def processes(self):
        return list(self.found)

    def process_names(self):
        return [each.process_name for each in self]

    def select(self, process=None):
        """Return the process records that match an action or part of a name (default: all)."""
        found = [each for each in self if process in (None, each.action) or (
            isinstance(process, str) and process in each.process_name)]
        if not found or len(found) > 1 and process is not None:
            raise NoMatchingProcessException(
                f"Found {len(found)} processes matching name '{process}'. Procs: "
                f'{", ".join(self.process_names())}')
        return found

    def wrote(self, expected, process, stream):
        """Return whether the output of a process contains a string or matches a pattern."""
        pattern = expected if isinstance(expected, re.Pattern) else re.compile(re.escape(expected))
        return any(pattern.search(each.written_to(stream).decode(errors='replace'))
                   for each in self.select(process))

    def _wait(self, condition, timeout, name):
        def is_true():
            with suppress(NoMatchingProcessException):
                return condition()

        with self.changed:
            assert self.changed.wait_for(is_true, timeout), f'Timed out waiting for {name}'

    def assertWaitForStartup(self, process, *, timeout=10):
        self._wait(lambda: self.select(process), timeout, f'process {process} to start')

    def assertWaitForShutdown(self, process, *, timeout=10):
        self._wait(lambda: self[process].returncode is not None, timeout,
                   f'process {process} to end')

    def assertWaitFor(self, expected_output, process=None, *, timeout=10, stream='stderr'):
        self._wait(lambda: self.wrote(expected_output, process, stream), timeout,
                   f"output '{expected_output}'")


class NoMatchingProcessException(Exception):
    """Raised when no process, or more than one process, matches a name."""


def assertExitCodes(proc_info, allowable_exit_codes=(EXIT_OK,), process=None):
    for each in proc_info.select(process):
        assert each.returncode in allowable_exit_codes, (
            f'Proc {each.process_name} exited with code {each.returncode}')


def assertInStream(proc_output, expected_output, process, *, stream='stderr'):
    names = ', '.join(each.process_name for each in proc_output.select(process))
    assert proc_output.wrote(expected_output, process, stream), (
        f"Did not find '{expected_output}' in output for any of the matching processes: {names}")


assertInStdout = functools.partial(assertInStream, stream='stdout')
assertInStderr = functools.partial(assertInStream, stream='stderr')


def tests_of(module, given):
    """Return one test suite to run before the launch shuts down, and one to run afterward."""
    suites = unittest.TestSuite(), unittest.TestSuite()
    for suite in unittest.defaultTestLoader.loadTestsFromModule(module):
        for test in suite:
            method = getattr(test, test._testMethodName)
            wanted = set(given) & set(inspect.signature(method).parameters)
            test.__dict__.update(given, **{test._testMethodName: functools.wraps(method)(
                functools.partial(method, **{name: given[name] for name in wanted}))})
            suites[getattr(test, 'after_shutdown', False)].addTest(test)
    return suites


def has_ready_to_test(entity):
    return isinstance(entity, ReadyToTest) or any(
        map(has_ready_to_test, entity.get_sub_entities()))


def run(module, arguments=(), debug=False):
    """Run the launch tests in a module, and return the test name and text of each failure."""
    unexpected = list(inspect.signature(module.generate_test_description).parameters)
    if unexpected:
        raise Exception(
            f"generate_test_description has unexpected extra argument '{unexpected[0]}'")
    description = module.generate_test_description()
    if not isinstance(description, tuple):
        description = description, {}
    description, named = description
    if not has_ready_to_test(description):
        raise Exception('generate_test_description functions must return a LaunchDescription '
                        'containing a ReadyToTest action')
    processes, service, results = Processes(), LaunchService(debug=debug), []
    service.context.handlers.append(processes)
    service.include_launch_description(LaunchDescription(
        [*(SetLaunchConfiguration(*each) for each in arguments), description]))
    running, ended = tests_of(module, {
        **named, 'launch_service': service, 'proc_info': processes, 'proc_output': processes,
        'test_args': dict(arguments)})
    names = [test.id() for test in (*running, *ended)]

    def test():
        if processes.ready.wait(START_TIME):
            results.append(unittest.TextTestRunner(verbosity=2).run(running))
        else:
            print('Timed out waiting for processes to start up')
        service.shutdown()

    threading.Thread(target=test, daemon=True).start()
    service.run(shutdown_when_idle=not hasattr(module.generate_test_description, 'keep_alive'))
    if not results:
        print('Processes under test stopped before tests completed')
        for each in filter(lambda each: each.returncode, processes):
            print(f"Process '{each.process_name}' exited with {each.returncode}\n"
                  f"##### '{each.process_name}' output #####\n"
                  f'{each.text.decode(errors="replace")}\n{"#" * (len(each.process_name) + 21)}')
        return [(name, 'Exception: Launch stopped before the active tests finished.\n')
                for name in names]
    results.append(unittest.TextTestRunner(verbosity=2).run(ended))
    return [(test.id(), text) for result in results
            for test, text in (*result.errors, *result.failures)]


def main():
    """Run the `launch_test` command."""
    parser = argparse.ArgumentParser(description='Launch integration testing tool.')
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
    options = parser.parse_args()
    path = options.launch_test_file
    if not os.path.isfile(path):
        parser.error(f"Test file '{path}' does not exist")
    for given, name in ((options.show_args, '-s'), (options.junit_xml, '--junit-xml')):
        if given:
            parser.error(f'this stand-in for launch_testing does not support {name}')
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Only the launch service handles Ctrl-C.
    name = os.path.splitext(os.path.basename(path))[0]
    spec = importlib.util.spec_from_file_location(name, path)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        return bool(run(module, [each.partition(':=')[::2] for each in options.launch_arguments],
                        options.verbose))
    except Exception as error:
        parser.error(error)


# ---------------------------------------------------------------------------------- pytest plugin

def pytest_configure(config):
    for mark in MARKS:
        config.addinivalue_line('markers', f'{mark}: the function describes what to launch')


def pytest_pycollect_makemodule(module_path, parent):
    """Collect a module as one test if generate_test_description has a launch test mark."""
    if not any(mark.encode() in module_path.read_bytes() for mark in MARKS):
        return None
    module = pytest.Module.from_parent(parent, path=module_path)
    try:
        marks = getattr(getattr(module.obj, 'generate_test_description', None), 'pytestmark', ())
    except (Exception, pytest.skip.Exception):
        return module  # pytest reports the import error when it collects the module.
    if any(mark.name in MARKS for mark in marks):
        return LaunchTestFile.from_parent(parent, path=module_path)
    return module


class LaunchTestFile(pytest.Module):
    """A module that pytest collects as a single launch test."""

    def collect(self):
        return [LaunchTest.from_parent(self, name=self.path.stem)]


class LaunchTest(pytest.Item):
    """A pytest item that runs the launch test in a file."""

    def runtest(self):
        failures = run(self.parent.obj)
        if failures:
            summary = '\n'.join(f'{name} failed' for name, _ in failures)
            details = '\n\n'.join(f'{"=" * 70}\nFAIL: {name}\n{"-" * 70}\n{text}'
                                  for name, text in failures)
            pytest.fail(f'{summary}\n{details}', pytrace=False)

    def reportinfo(self):
        return self.path, 0, f'launch tests: {self.name}'
