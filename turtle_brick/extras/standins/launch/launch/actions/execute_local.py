# SPDX-License-Identifier: Apache-2.0
"""The action ExecuteLocal, which starts a process and ends it together with the launch."""

from __future__ import annotations

import asyncio
import codecs
from collections.abc import Mapping
import os
import pty
import signal
import subprocess
import threading
import traceback
from typing import Any, Union

from launch.action import Action
from launch.descriptions.executable import Executable
from launch.event_handler import Reaction
from launch.event_handlers.on_process_exit import OnProcessExit
from launch.events.process.process_exited import ProcessExited
from launch.events.process.process_started import ProcessStarted
from launch.events.process.process_stderr import ProcessStderr
from launch.events.process.process_stdout import ProcessStdout
from launch.launch_context import LaunchContext
from launch.logging import get_logger, write
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitutions.launch_configuration import LaunchConfiguration
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import perform_typed_substitution
from turtle_graph.client.children import end_with_parent

Output = Union[SomeSubstitutionsType, Mapping[str, Any]]
"""The name of an output configuration, or its destinations keyed by stdout, stderr and both."""

OUTPUTS: dict[str, Mapping[str, Any]] = {
    'screen': {'both': 'screen'},
    'log': {'both': 'log', 'stderr': 'screen'},
    'both': {'both': ['screen', 'log']},
    'own_log': {'both': 'own_log', 'stdout': 'own_log', 'stderr': 'own_log'},
    'full': {'both': ['screen', 'log', 'own_log'], 'stdout': 'own_log', 'stderr': 'own_log'}}
"""Output destinations for stdout, stderr and both streams, keyed by the value of `output`."""

READ_SIZE = 65536
"""Number of bytes that a stream reads at a time."""

READS_AT_END = 20
"""Number of reads after a process has ended. A pipe holds at most 1 MiB, which is 16 reads."""


def targets_of(output: Mapping[str, Any], process: str, stream: str) -> list[str]:
    """Return the targets of the output of a process: 'screen' or names of log files."""
    targets = []
    own_logs = {'both': f'{process}.log', stream: f'{process}-{stream}.log'}
    for source, own_log in own_logs.items():
        destinations = output.get(source, [])
        for name in [destinations] if isinstance(destinations, str) else destinations:
            targets_by_name = {'screen': 'screen', 'log': 'launch.log', 'own_log': own_log}
            if name not in targets_by_name:
                raise ValueError(f"A destination in the output of process '{process}' is "
                                 f"'{name}', but must be screen, log or own_log")
            targets.append(targets_by_name[name])
    return targets


class ExecuteLocal(Action):
    """
    Starts a process on this machine.

    The launch ends the process with SIGINT, SIGTERM and SIGKILL, with a timeout (s) between them.
    """

    def __init__(self, *, process_description: Executable, shell: bool = False,
                 sigterm_timeout: Any = LaunchConfiguration('sigterm_timeout', default=5),
                 sigkill_timeout: Any = LaunchConfiguration('sigkill_timeout', default=5),
                 emulate_tty: bool = False, output: Output = 'log', on_exit: Reaction = (),
                 respawn: bool | SomeSubstitutionsType = False,
                 respawn_delay: float | None = None, respawn_max_retries: int = -1,
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.process_description = process_description
        self.shell = shell
        self.sigterm_timeout = sigterm_timeout
        self.sigkill_timeout = sigkill_timeout
        self.emulate_tty = emulate_tty
        self.output = output
        self.on_exit = on_exit
        self.respawn = respawn
        self.respawn_delay = respawn_delay
        self.respawn_max_retries = respawn_max_retries
        self.return_code: int | None = None
        self._popen: subprocess.Popen[bytes] | None = None
        self._task: asyncio.Future[None] | None = None
        self._details: dict[str, Any] = {}

    @property
    def cmd(self) -> list[Any]:
        """Return the words of the command, which are lists of substitutions."""
        return self.process_description.cmd

    @property
    def name(self) -> str:
        """Return the name of the process, which ends with a number."""
        return self.process_description.final_name

    @property
    def process_details(self) -> dict[str, Any] | None:
        """Return the arguments of the events of the process, or None before it starts."""
        return self._details or None

    def get_asyncio_future(self) -> asyncio.Future[None] | None:
        return self._task

    def execute(self, context: LaunchContext) -> None:
        """Expand the substitutions, and schedule the start of the process."""
        if self in context.processes:
            raise RuntimeError(f"The process '{self.name}' is executed more than once. Create "
                               'one action for each process')
        self.process_description.prepare(context)
        self._context = context
        self._logger = get_logger(self.name)
        output = self._expand_output(context)
        self._targets = [targets_of(output, self.name, stream) for stream in ('stdout', 'stderr')]
        self._respawns = perform_typed_substitution(context, self.respawn, bool)
        self._emulates_tty = perform_typed_substitution(
            context, context.launch_configurations.get('emulate_tty', self.emulate_tty), bool)
        context.register_event_handler(OnProcessExit(target_action=self, on_exit=self.on_exit))
        if not context.is_shutdown:
            context.processes.append(self)
            self._task = context.create_task(self._run())

    def _expand_output(self, context: LaunchContext) -> Mapping[str, Any]:
        """Return the output destinations for stdout, stderr and both streams."""
        override = os.environ.get('OVERRIDE_LAUNCH_PROCESS_OUTPUT')
        if not override and isinstance(self.output, Mapping):
            return self.output
        name = override or perform_substitutions(
            context, normalize_to_list_of_substitutions(self.output))
        if name not in OUTPUTS:
            raise ValueError(f"The output of process '{self.name}' is '{name}', but must be "
                             f'{", ".join(OUTPUTS)}')
        return OUTPUTS[name]

    async def _run(self) -> None:
        """Run the process, and start it again if it respawns."""
        retries = self.respawn_max_retries
        while not self._context.is_shutdown:
            try:
                await self._run_once()
            except (OSError, ValueError):
                self._logger.error(
                    f'exception occurred while executing process:\n{traceback.format_exc()}')
                return
            if not self._respawns or not retries:
                return
            retries -= 1
            await self._context.pause(self.respawn_delay or 0)

    def _start(self) -> tuple[subprocess.Popen[bytes], list[int]]:
        """Start the process, and return it and the readable ends of its stdout and stderr."""
        description = self.process_description
        pipes = [pty.openpty() if self._emulates_tty else os.pipe() for _ in range(2)]
        try:
            popen = subprocess.Popen(
                ' '.join(description.final_cmd) if self.shell else description.started_cmd,
                shell=self.shell, cwd=description.final_cwd, env=description.final_env,
                stdin=subprocess.PIPE, stdout=pipes[0][1], stderr=pipes[1][1],
                preexec_fn=end_with_parent)
        except BaseException:
            for reader, _ in pipes:
                os.close(reader)
            raise
        finally:
            for _, writer in pipes:
                os.close(writer)
        return popen, [reader for reader, _ in pipes]

    async def _run_once(self) -> None:
        """Run the process, and report its start, its output and its end."""
        description = self.process_description
        popen, readers = self._start()
        self._popen = popen
        self._logger.info(f'process started with pid [{popen.pid}]')
        self._details = {
            'action': self, 'name': self.name, 'pid': popen.pid, 'cmd': description.final_cmd,
            'cwd': description.final_cwd, 'env': description.final_env}
        self._context.emit_event_sync(ProcessStarted(**self._details))
        streams = [_Stream(self, readers[0], ProcessStdout, self._targets[0]),
                   _Stream(self, readers[1], ProcessStderr, self._targets[1])]
        loop = asyncio.get_running_loop()
        self._ended: asyncio.Future[int] = loop.create_future()
        threading.Thread(daemon=True, target=lambda: loop.call_soon_threadsafe(
            self._ended.set_result, popen.wait())).start()
        code = self.return_code = await self._ended
        for stream in streams:
            for _ in range(READS_AT_END):
                stream.read()
        if code == 0:
            self._logger.info(f'process has finished cleanly [pid {popen.pid}]')
        else:
            cmd = ' '.join(word for word in description.final_cmd if word.strip())
            self._logger.error(
                f"process has died [pid {popen.pid}, exit code {code}, cmd '{cmd}'].")
        for stream in streams:
            stream.close()
        assert popen.stdin is not None
        popen.stdin.close()
        self._context.emit_event_sync(ProcessExited(returncode=code, **self._details))

    def emit_output(self, kind: type[ProcessStdout] | type[ProcessStderr], text: bytes) -> None:
        """Emit an event for text that the process has written."""
        self._context.emit_event_sync(kind(text=text, **self._details))

    def end(self, number: signal.Signals) -> None:
        """End the process by sending signals, up to SIGKILL if necessary."""
        if self._popen is not None and self._popen.poll() is None:
            self._context.create_task(self._end(self._popen, number))

    async def _end(self, popen: subprocess.Popen[bytes], first: signal.Signals) -> None:
        """Send SIGINT (unless `first` is another signal), SIGTERM and SIGKILL."""
        term = self._timeout(self.sigterm_timeout)
        kill = self._timeout(self.sigkill_timeout)
        if first == signal.SIGINT:
            if await self._send(popen, signal.SIGINT, term, float(term), 'SIGTERM'):
                return
            kill_message: str | float = float(term) + float(kill)
        else:
            kill_message = kill
        if not await self._send(popen, signal.SIGTERM, kill_message, float(kill), 'SIGKILL'):
            await self._send(popen, signal.SIGKILL)

    def _timeout(self, value: Any) -> str | float:
        """Return a timeout (s) as the number that was given, or as text."""
        if isinstance(value, float):
            return value
        return perform_substitutions(self._context, normalize_to_list_of_substitutions(value))

    async def _send(self, popen: subprocess.Popen[bytes], number: signal.Signals,
                    shown: str | float = '', timeout: float | None = None,
                    stronger: str = '') -> bool:
        """
        Send a signal, and return whether the process ends within a timeout (s).

        :param shown: timeout (s) in the message
        :param stronger: name of the next signal
        """
        self._logger.info(f"sending signal '{number.name}' to process[{self.name}]")
        popen.send_signal(number)
        await asyncio.wait([self._ended], timeout=timeout)
        if self._ended.done():
            return True
        self._logger.error(
            f"process[{self.name}] failed to terminate '{shown}' seconds after receiving "
            f"'{number.name}', escalating to '{stronger}'")
        return False


class _Stream:
    """The output lines of a process on stdout or stderr."""

    def __init__(self, process: ExecuteLocal, reader: int,
                 kind: type[ProcessStdout] | type[ProcessStderr], targets: list[str]) -> None:
        os.set_blocking(reader, False)
        self._process = process
        self._reader = reader
        self._kind = kind
        self._targets = targets
        self._rest = ''
        self._decoder = codecs.getincrementaldecoder('utf-8')('replace')
        asyncio.get_running_loop().add_reader(reader, self.read)

    def read(self) -> None:
        """Read the available output, and write its complete lines."""
        try:
            data = os.read(self._reader, READ_SIZE)
        except BlockingIOError:
            return
        except OSError:  # The terminal is closed.
            data = b''
        if data:
            self._process.emit_output(self._kind, data)
        else:
            asyncio.get_running_loop().remove_reader(self._reader)
        *lines, self._rest = (self._rest + self._decoder.decode(data)).split('\n')
        for line in lines:
            self._write(line)

    def _write(self, line: str) -> None:
        write(f'[{self._process.name}] {line}', self._targets)

    def close(self) -> None:
        """Write the last line even if it is incomplete, and close the stream."""
        if self._rest:
            self._write(self._rest)
        asyncio.get_running_loop().remove_reader(self._reader)
        os.close(self._reader)
