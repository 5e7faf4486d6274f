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
"""Stand-ins for the actions and event handlers in the `launch` package."""

import asyncio
import codecs
import os
import pty
import shlex
import signal
import subprocess
import threading
import traceback
from types import SimpleNamespace

from launch.substitutions import (Deferred, get_logger, LaunchConfiguration, missing_name,
                                  normalize_to_list_of_substitutions, perform, read_typed, write)

__getattr__ = missing_name('launch')


class Action(Deferred):
    """An action that calls its `do` method if its condition is true."""

    actions = ()
    execute = Deferred.call

    def __init__(self, *args, condition=None, **kwargs):
        super().__init__(*args, **kwargs)
        self.condition = condition

    def get_sub_entities(self):
        """Return the actions nested in this action."""
        return self.actions


def action(name, function):
    """Create an action class from a function that may return additional entities to execute."""
    return type(name, (Action,), {'do': staticmethod(function)})


def _append(context, name, value, prepend=False, separator=os.pathsep):
    name = perform(context, name)
    values = [context.environment.get(name, ''), perform(context, value)]
    if prepend is True or prepend is not False and read_typed(perform(context, prepend), bool):
        values.reverse()
    context.environment[name] = perform(context, separator).join(filter(None, values))


OpaqueFunction = action(
    'OpaqueFunction', lambda context, *, function, args=(), kwargs={}: function(
        context, *args, **kwargs))
SetLaunchConfiguration = action(
    'SetLaunchConfiguration', lambda context, name, value: context.launch_configurations.update(
        {perform(context, name): perform(context, value)}))
SetEnvironmentVariable = action(
    'SetEnvironmentVariable', lambda context, name, value: context.environment.update(
        {perform(context, name): perform(context, value)}))
UnsetEnvironmentVariable = action(
    'UnsetEnvironmentVariable', lambda context, name: context.environment.pop(
        perform(context, name), None) and None)
AppendEnvironmentVariable = action('AppendEnvironmentVariable', _append)
LogInfo = action('LogInfo', lambda context, *, msg: get_logger('launch.user').info(
    perform(context, msg)))
Shutdown = action('Shutdown', lambda context, *, reason='': context.shutdown())
EmitEvent = action('EmitEvent', lambda context, *, event: [event])

RegisterEventHandler = action('RegisterEventHandler', lambda context, event_handler: (
    context.handlers.insert(0, event_handler)))


class OnProcessExit(Deferred):

    def do(self, context, *, on_exit, target_action=None):
        event = context.event
        if target_action in (None, event.action) or (
                callable(target_action) and target_action(event.action)):
            found = on_exit(event, context) if callable(on_exit) else on_exit
            for each in found if isinstance(found, (list, tuple)) else filter(None, [found]):
                if isinstance(each, Shutdown):
                    get_logger('launch').info(f'process[{event.process_name}] was required: '
                                              'shutting down launched system')
                context.visit(each)


class DeclareLaunchArgument(Action):

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        default, choices = self.default_value, self.choices
        if default is not None:
            self.default_value = normalize_to_list_of_substitutions(default)
        if self.description and choices:
            self.description = f'{self.description.rstrip(".")}. Valid choices are: {choices}'
        self.description = self.description or (
            f'One of: {choices}' if choices else 'no description given')

    def do(self, context, name, *, default_value=None, description=None, choices=None):
        values, error = context.launch_configurations, None
        if name not in values and default_value is None:
            error = f'Required launch argument "{name}" was not provided.'
        elif name not in values:
            values[name] = perform(context, default_value)
        if not error and choices and values[name] not in choices:
            error = (f'Argument "{name}" provided value "{values[name]}" is not valid. '
                     f'Valid options are: {choices}')
        if error:
            get_logger('launch.actions.declare_launch_argument').error(error)
            raise RuntimeError(error)


class GroupAction(Action):

    def do(self, context, actions, *, scoped=True, forwarding=True, launch_configurations={}):
        outer, environment = context.launch_configurations, dict(context.environment)
        kept = {perform(context, name): perform(context, value)
                for name, value in launch_configurations.items()}

        def end(context):
            context.launch_configurations = outer
            context.set_environment(environment)

        if scoped:
            context.launch_configurations = dict(outer) if forwarding else {}
            context.set_environment(environment if forwarding else context.initial_environment)
        context.launch_configurations.update(kept)
        return [*actions, *([OpaqueFunction(function=end)] if scoped else [])]


class TimerAction(Action):

    def do(self, context, *, period, actions):
        async def wait(file=context.launch_file):
            await context.pause(period if isinstance(period, (int, float)) else float(
                perform(context, period)))
            context.launch_file = file
            for each in actions if not context.shutting_down.is_set() else ():
                context.visit(each)
        context.create_task(wait())


class ExecuteProcess(Action):

    popen = None

    def do(self, context, *, cmd, prefix=None, name=None, cwd=None, env=None, additional_env={},
           shell=False, emulate_tty=False, output='log', on_exit=(), respawn=False,
           respawn_delay=None, respawn_max_retries=-1,
           sigterm_timeout=LaunchConfiguration('sigterm_timeout', default=5),
           sigkill_timeout=LaunchConfiguration('sigkill_timeout', default=5)):
        """Expand the arguments, and start the process when the event loop resumes."""
        def text(value):
            return None if value is None else perform(context, value)

        self.command = [*shlex.split(text(prefix) or ''), *map(text, cmd)]
        context.process_count += 1
        self.label = f'{text(name) or os.path.basename(self.command[0])}-{context.process_count}'
        self.variables = dict(context.environment if env is None else (map(text, each)
                                                                       for each in env.items()))
        self.variables.update(map(text, each) for each in (additional_env or {}).items())
        self.directory = text(cwd)
        output = os.environ.get('OVERRIDE_LAUNCH_PROCESS_OUTPUT') or text(output)
        both, own = ['screen', 'launch.log'], f'{self.label}.log'
        targets = {  # for stdout and stderr
            'screen': (['screen'], ['screen']), 'log': (['launch.log'], both),
            'both': (both, both),
            'own_log': ([own, f'{self.label}-stdout.log'], [own, f'{self.label}-stderr.log'])}
        targets['full'] = tuple(both + each for each in targets['own_log'])
        if output not in targets:
            raise ValueError(f'{output} is not a valid standard output config i.e. "screen", '
                             '"log" or "both"')
        self.targets = targets[output]
        self.respawn = respawn if isinstance(respawn, bool) else read_typed(text(respawn), bool)
        if 'emulate_tty' in context.launch_configurations:
            self.emulate_tty = read_typed(context.launch_configurations['emulate_tty'], bool)
        self.context = context
        context.handlers.insert(0, OnProcessExit(target_action=self, on_exit=on_exit))
        self.logger = get_logger(self.label)
        if not context.shutting_down.is_set():
            context.processes.append(self)
            context.create_task(self._run())

    async def _run(self):
        retries = self.respawn_max_retries
        while not self.context.shutting_down.is_set():
            try:
                await self._run_once()
            except (OSError, ValueError):
                return self.logger.error(
                    f'exception occurred while executing process:\n{traceback.format_exc()}')
            if not self.respawn or not retries:
                return
            retries -= 1
            await self.context.pause(self.respawn_delay or 0)

    async def _run_once(self):
        pipes = [pty.openpty() if self.emulate_tty else os.pipe() for _ in range(2)]
        try:
            self.popen = subprocess.Popen(
                ' '.join(self.command) if self.shell else self.command, shell=self.shell,
                cwd=self.directory, env=self.variables, stdin=subprocess.PIPE,
                stdout=pipes[0][1], stderr=pipes[1][1])
        except BaseException:
            for reader, _ in pipes:
                os.close(reader)
            raise
        finally:
            for _, writer in pipes:
                os.close(writer)
        pid = self.popen.pid
        self.logger.info(f'process started with pid [{pid}]')
        self.context.notify('started', self)
        loop = asyncio.get_running_loop()
        streams = [_Stream(self, index, end) for index, (end, _) in enumerate(pipes)]
        self.ended = loop.create_future()
        threading.Thread(daemon=True, target=lambda: loop.call_soon_threadsafe(
            self.ended.set_result, self.popen.wait())).start()
        code = await self.ended
        for stream in streams:
            for _ in range(20):  # A pipe holds at most 1 MiB, so 16 reads would be enough.
                stream.read()
        if code == 0:
            self.logger.info(f'process has finished cleanly [pid {pid}]')
        else:
            cmd = ' '.join(filter(str.strip, self.command))
            self.logger.error(f"process has died [pid {pid}, exit code {code}, cmd '{cmd}'].")
        for stream in streams:
            stream.close()
        self.popen.stdin.close()
        self.context.notify('exited', self, code)
        self.context.event = SimpleNamespace(
            action=self, process_name=self.label, pid=pid, cmd=self.command,
            cwd=self.directory, env=self.variables, returncode=code)
        for handler in list(self.context.handlers):
            handler.call(self.context)

    def end(self, number):
        """Send SIGINT or SIGTERM, and then stronger signals until the process ends."""
        if self.popen and self.popen.poll() is None:
            self.context.create_task(self._end(number))

    async def _end(self, first):
        term, kill = (perform(self.context, timeout)
                      for timeout in (self.sigterm_timeout, self.sigkill_timeout))
        both = float(term) + float(kill) if first == signal.SIGINT else kill
        for number, seconds, shown, stronger in (
                (signal.SIGINT, float(term), term, 'SIGTERM'),
                (signal.SIGTERM, float(kill), both, 'SIGKILL'),
                (signal.SIGKILL, None, None, None))[first != signal.SIGINT:]:
            self.logger.info(f"sending signal '{number.name}' to process[{self.label}]")
            self.popen.send_signal(number)
            await asyncio.wait([self.ended], timeout=seconds)
            if self.ended.done():
                return
            self.logger.error(
                f"process[{self.label}] failed to terminate '{shown}' seconds after receiving "
                f"'{number.name}', escalating to '{stronger}'")


class _Stream:
    """The output of a process on stdout (index 0) or stderr (index 1), split into lines."""

    def __init__(self, process, index, end):
        os.set_blocking(end, False)
        self.process, self.index, self.end, self.rest = process, index, end, ''
        self.decode = codecs.getincrementaldecoder('utf-8')('replace').decode
        asyncio.get_running_loop().add_reader(end, self.read)

    def read(self):
        try:
            data = os.read(self.end, 65536)
        except BlockingIOError:
            return
        except OSError:  # The terminal is closed.
            data = b''
        if not data:
            asyncio.get_running_loop().remove_reader(self.end)
        self.process.context.notify('output', self.process, data, self.index)
        *lines, self.rest = (self.rest + self.decode(data)).split('\n')
        self.write(lines)

    def write(self, lines):
        for line in lines:
            write(f'[{self.process.label}] {line}', self.process.targets[self.index])

    def close(self):
        self.write([self.rest] if self.rest else [])
        asyncio.get_running_loop().remove_reader(self.end)
        os.close(self.end)
