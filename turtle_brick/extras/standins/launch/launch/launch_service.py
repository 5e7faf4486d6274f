# SPDX-License-Identifier: Apache-2.0
"""The launch service."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
import logging
import os
import signal
import traceback
from typing import Any

from launch.events.shutdown import Shutdown
from launch.launch_context import LaunchContext
from launch.launch_description import LaunchDescription
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.logging import get_logger, launch_config, log_file

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP)


class LaunchService:
    """Executes launch descriptions and manages the processes that they start."""

    def __init__(self, *, argv: Sequence[str] | None = None, noninteractive: bool = False,
                 debug: bool = False) -> None:
        self.context = LaunchContext(argv=argv, noninteractive=noninteractive)
        self._descriptions: list[LaunchDescriptionEntity] = []
        self._level = logging.DEBUG if debug else logging.INFO
        self._logger = get_logger('launch')
        self._status = 0
        self._signals: list[int] = []
        self._loop: asyncio.AbstractEventLoop | None = None

    def include_launch_description(self, launch_description: LaunchDescription) -> None:
        """Add a launch description that run() executes."""
        self._descriptions.append(launch_description)

    def shutdown(self) -> None:
        """End the launch. This method is thread-safe."""
        if self._loop is not None:
            with suppress(RuntimeError):  # The launch has ended.
                self._loop.call_soon_threadsafe(
                    self._shut_down, 'LaunchService.shutdown() called')

    def run(self, *, shutdown_when_idle: bool = True) -> int:
        """Run the launch in the main thread and return its exit status."""
        status = asyncio.run(self.run_async(shutdown_when_idle=shutdown_when_idle))
        number = self.context.signal
        if number != signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
        return status

    async def run_async(self, *, shutdown_when_idle: bool = True) -> int:
        """Run the launch in an event loop and return its exit status."""
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(self._on_exception)
        launch_config.level = self._level
        launch_config.on_closed_stdout = self._on_closed_stdout
        handlers = {number: signal.signal(number, self._on_signal) for number in SIGNALS}
        if not shutdown_when_idle:
            self.context.create_task(self.context.shutting_down.wait())
        log_file('launch.log')
        self._logger.info(f'All log files can be found below {launch_config.log_dir}')
        self._logger.info(
            f'Default logging verbosity is set to {logging.getLevelName(self._level)}')
        try:
            for description in self._descriptions:
                description.visit(self.context)
        except Exception as error:
            if not self._signals:  # Ctrl-C also interrupts the program of a Command substitution.
                self._fail(error)
        await asyncio.sleep(0)  # handle pending signals
        await self._wait_for_tasks()
        for number, handler in handlers.items():
            signal.signal(number, handler)
        return self._status

    async def _wait_for_tasks(self) -> None:
        """Wait until all tasks have ended, and shut down when the launch is idle."""
        context = self.context
        while context.tasks or not context.is_shutdown:
            if not context.tasks:
                self._shut_down('idle')
            done, _ = await asyncio.wait(context.tasks, return_when=asyncio.FIRST_COMPLETED)
            context.tasks = [task for task in context.tasks if task not in done]
            for task in done:
                error = task.exception()
                if error is not None:
                    self._fail(error)

    def _shut_down(self, reason: str) -> None:
        self.context.shutdown(Shutdown(reason=reason))

    def _on_exception(self, loop: asyncio.AbstractEventLoop, details: dict[str, Any]) -> None:
        self._fail(details.get('exception') or details['message'])

    def _fail(self, error: BaseException | str) -> None:
        if isinstance(error, BaseException):
            self._logger.debug(''.join(traceback.format_exception(error)).rstrip())
        self._logger.error(f'Caught exception in launch (see debug for traceback): {error}')
        self._status = 1
        self._shut_down(str(error))

    def _on_signal(self, number: int, frame: object) -> None:
        self._signals.append(number)
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._end_on_signal, signal.Signals(number))

    def _end_on_signal(self, number: signal.Signals) -> None:
        if number == signal.SIGINT:
            again = ' again, ignoring...' if self.context.is_shutdown else ''
            self._logger.warning(f'user interrupted with ctrl-c (SIGINT){again}')
            if again:
                return
        self.context.signal = number
        self.context.shutdown(Shutdown(
            reason=f'ctrl-c ({number.name})', due_to_sigint=number == signal.SIGINT))

    def _on_closed_stdout(self) -> None:
        self._status = 120
        self._shut_down('stdout is closed')
