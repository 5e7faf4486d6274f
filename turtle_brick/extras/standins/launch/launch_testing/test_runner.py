# SPDX-License-Identifier: Apache-2.0
"""The runner of launch tests."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import threading
import unittest

from launch import LaunchDescription, LaunchDescriptionEntity, LaunchService
from launch.actions import RegisterEventHandler, SetLaunchConfiguration
from launch.event_handlers import OnProcessExit, OnProcessIO, OnProcessStart
from launch_testing.actions.ready import ReadyToTest
from launch_testing.io_handler import ActiveIoHandler
from launch_testing.loader import TestRun
from launch_testing.proc_info_handler import ActiveProcInfoHandler

START_TIME = 15.0
"""Timeout (s) for ReadyToTest."""


def ready_to_test_actions(entity: LaunchDescriptionEntity) -> Iterator[ReadyToTest]:
    """Yield the ReadyToTest actions in an entity."""
    if isinstance(entity, ReadyToTest):
        yield entity
    for child in entity.get_sub_entities():
        yield from ready_to_test_actions(child)


class LaunchTestRunner:
    """Runs a launch, tests while it is running, and tests after it has shut down."""

    def __init__(self, test_run: TestRun, launch_arguments: Mapping[str, str],
                 debug: bool = False) -> None:
        self._test_run = test_run
        self._proc_info = ActiveProcInfoHandler()
        self._proc_output = ActiveIoHandler()
        self._ready = threading.Event()
        self._service = LaunchService(debug=debug)
        self._results: list[unittest.TestResult] = []
        description, named = test_run.normalized_test_description()
        ready_actions = list(ready_to_test_actions(description))
        if not ready_actions:
            raise Exception('generate_test_description functions must return a LaunchDescription '
                            'containing a ReadyToTest action')
        for action in ready_actions:
            action.add_callback(self._ready.set)
        self._service.include_launch_description(LaunchDescription([
            RegisterEventHandler(OnProcessStart(on_start=self._on_start)),
            RegisterEventHandler(OnProcessExit(
                on_exit=lambda event, context: self._proc_info.append(event))),
            RegisterEventHandler(OnProcessIO(on_stdout=self._proc_output.append,
                                             on_stderr=self._proc_output.append)),
            *(SetLaunchConfiguration(name, value) for name, value in launch_arguments.items()),
            description]))
        test_run.bind({
            **named, 'launch_service': self._service, 'proc_info': self._proc_info,
            'proc_output': self._proc_output, 'test_args': dict(launch_arguments)})

    def _on_start(self, event: object, context: object) -> None:
        self._proc_info.append(event)  # type: ignore[arg-type]
        self._proc_output.track(event)  # type: ignore[arg-type]

    def run(self) -> list[tuple[str, str]]:
        """Run the tests, and return the test name and text of each failure."""
        keep_alive = getattr(self._test_run.test_description_function, 'keep_alive', False)
        threading.Thread(target=self._run_tests, daemon=True).start()
        self._service.run(shutdown_when_idle=not keep_alive)
        if not self._results:
            self._print_processes()
            return [(test.id(), 'Exception: Launch stopped before the active tests finished.\n')
                    for test in self._test_run.all_tests]
        self._results.append(_run_suite(self._test_run.post_shutdown_tests))
        return [(test.id(), text) for result in self._results
                for test, text in (*result.errors, *result.failures)]

    def _run_tests(self) -> None:
        """Run the tests beside the launch, and then shut it down."""
        if self._ready.wait(START_TIME):
            self._results.append(_run_suite(self._test_run.pre_shutdown_tests))
        else:
            print('Timed out waiting for processes to start up')
        self._service.shutdown()

    def _print_processes(self) -> None:
        """Print the exit codes and the output of the processes that have failed."""
        print('Processes under test stopped before tests completed')
        for action in self._proc_info.processes():
            code = self._proc_info.exit_code(action)
            if code:
                print(f"Process '{action.name}' exited with {code}\n"
                      f"##### '{action.name}' output #####\n"
                      f'{self._proc_output.text(action)}\n{"#" * (len(action.name) + 21)}')


def _run_suite(suite: unittest.TestSuite) -> unittest.TestResult:
    return unittest.TextTestRunner(verbosity=2).run(suite)
