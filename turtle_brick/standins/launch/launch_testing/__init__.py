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
"""The stand-in for launch_testing 3.4.3: a pytest plugin and the `launch_test` command."""

import argparse
import functools
import importlib.util
import inspect
import os
import re
import signal
import sys
import threading
from types import SimpleNamespace
import unittest

from launch import LaunchDescription, LaunchService
from launch.actions import action, SetLaunchConfiguration
from launch.substitutions import missing_name
import pytest

__getattr__ = missing_name('launch_testing')
START_TIME = 15.0
ReadyToTest = action('ReadyToTest', lambda context: context.notify('ready'))


def post_shutdown_test():
    """Return a decorator for a test class that runs after all processes have exited."""
    def mark(test_class):
        test_class.after_shutdown = True
        return test_class
    return mark


class Processes:
    """Process exit codes and outputs, which tests receive as proc_info and proc_output."""

    def __init__(self):
        self.changed, self.ready, self.found = threading.Condition(), threading.Event(), {}

    def record_event(self, event, process=None, *details):
        """Record a launch event."""
        with self.changed:
            if event == 'ready':
                self.ready.set()
            elif event == 'started':
                self.found.setdefault(process, SimpleNamespace(
                    process_name=process.label, action=process, output=([], []))).returncode = None
            elif event == 'exited':
                self.found[process].returncode, = details
            else:
                self.found[process].output[details[1]].append(details[0])
            self.changed.notify_all()

    def __iter__(self):
        return iter(list(self.found.values()))

    def select(self, process=None):
        """Return the processes that match an action or part of a process name (default: all)."""
        return [each for each in self if process in (None, each.action) or (
            isinstance(process, str) and process in each.process_name)]

    def wrote(self, expected, process, stream):
        """Return whether the output of a process contains a string or matches a pattern."""
        pattern = expected if isinstance(expected, re.Pattern) else re.compile(re.escape(expected))
        return any(pattern.search(b''.join(each.output[stream != 'stdout']).decode(
            errors='replace')) for each in self.select(process))

    def _wait(self, condition, timeout, name):
        with self.changed:
            assert self.changed.wait_for(condition, timeout), f'Timed out waiting for {name}'

    def assertWaitForStartup(self, process, *, timeout=10):
        self._wait(lambda: self.select(process), timeout, f'process {process} to start')

    def assertWaitForShutdown(self, process, *, timeout=10):
        self._wait(lambda: any(each.returncode is not None for each in self.select(process)),
                   timeout, f'process {process} to end')

    def assertWaitFor(self, expected_output, process=None, *, timeout=10, stream='stderr'):
        self._wait(lambda: self.wrote(expected_output, process, stream), timeout,
                   f"output '{expected_output}'")


def assertExitCodes(proc_info, allowable_exit_codes=(0,), process=None):
    for each in proc_info.select(process):
        assert each.returncode in allowable_exit_codes, (
            f'Proc {each.process_name} exited with code {each.returncode}')


def assertInStdout(proc_output, expected_output, process, stream='stdout'):
    names = ', '.join(each.process_name for each in proc_output.select(process))
    assert proc_output.wrote(expected_output, process, stream), (
        f"Did not find '{expected_output}' in output for any of the matching processes: {names}")


assertInStderr = functools.partial(assertInStdout, stream='stderr')


def tests_of(module, given):
    """Return the test suites to run before and after the shutdown."""
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
    """Run the launch tests in a module and return the name and text of each failure."""
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
    service.context.listeners.append(processes.record_event)
    service.include_launch_description(LaunchDescription(
        [*(SetLaunchConfiguration(*each) for each in arguments), description]))
    running, ended = tests_of(module, {
        **named, 'launch_service': service, 'proc_info': processes, 'proc_output': processes,
        'test_args': dict(arguments)})
    names = [test.id() for test in running]

    def test():
        if processes.ready.wait(START_TIME):
            results.append(unittest.TextTestRunner(verbosity=2).run(running))
        else:
            print('Timed out waiting for processes to start up')
        service.shutdown()

    threading.Thread(target=test, daemon=True).start()
    service.run()
    if not results:
        print('Processes under test stopped before tests completed')
        for each in filter(lambda each: each.returncode, processes):
            print(f"Process '{each.process_name}' exited with {each.returncode}\n"
                  f"##### '{each.process_name}' output #####")
            print(*(text.decode(errors='replace') for text in sum(each.output, [])), sep='\n')
            print('#' * (len(each.process_name) + 21))
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
    config.addinivalue_line('markers', 'launch_test: the function describes what to launch')


def pytest_pycollect_makemodule(module_path, parent):
    """Collect a module as one test if generate_test_description has the launch_test mark."""
    if b'launch_test' not in module_path.read_bytes():
        return None
    module = pytest.Module.from_parent(parent, path=module_path)
    try:
        marks = getattr(getattr(module.obj, 'generate_test_description', None), 'pytestmark', ())
    except (Exception, pytest.skip.Exception):
        return module  # pytest reports the error when it collects the module.
    if any(mark.name == 'launch_test' for mark in marks):
        return LaunchTestFile.from_parent(parent, path=module_path, module=module.obj)
    return module


class LaunchTestFile(pytest.File):
    """A file with a single launch test."""

    def __init__(self, module, **options):
        super().__init__(**options)
        self.module = module

    def collect(self):
        return [LaunchTest.from_parent(self, name=self.path.stem)]


class Failures(Exception):
    """An exception that lists the failures of a launch test."""

    @property
    def reprcrash(self):
        """Return a summary for pytest."""
        return SimpleNamespace(message='\n'.join(f'{name} failed' for name, _ in self.args))

    def __str__(self):
        width = max(len(line) for _, text in self.args for line in text.splitlines())
        return '\n' + '\n\n'.join(f'{"=" * width}\nFAIL: {name}\n{"-" * width}\n{text}'
                                  for name, text in self.args)

    def toterminal(self, out):
        out.write(str(self))


class LaunchTest(pytest.Item):
    """A pytest item that runs the launch test in a file."""

    def runtest(self):
        failures = run(self.parent.module)
        if failures:
            raise Failures(*failures)

    def repr_failure(self, excinfo):
        return excinfo.value if excinfo.errisinstance(Failures) else super().repr_failure(excinfo)

    def reportinfo(self):
        return self.path, 0, f'launch tests: {self.name}'
