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
import re
import shlex
import signal
import subprocess
import threading
import traceback

from launch.substitutions import (Deferred, get_logger, LaunchConfiguration, missing_name,
                                  normalize_to_list_of_substitutions, perform, read_typed, write)
from turtle_graph.client.children import end_with_parent

__getattr__ = missing_name('launch')


class Action(Deferred):
    """The base class of all actions. Subclasses implement `do`."""

    actions = ()
    task = None  # set to a task if the action continues after execute() returns
    execute = Deferred.call

    def __init__(self, *args, condition=None, **kwargs):
        super().__init__(*args, **kwargs)
        self.condition = condition

    def get_sub_entities(self):
        return self.actions


def action(name, function):
    """Create an action class whose `do` method is a given function."""
    return type(name, (Action,), {'do': staticmethod(function)})


def _append(context, name, value, prepend=False, separator=os.pathsep):
    name = perform(context, name)
    values = [context.environment.get(name, ''), perform(context, value)]
    if prepend is True or prepend is not False and read_typed(perform(context, prepend), bool):
        values.reverse()
    context.environment[name] = perform(context, separator).join(filter(None, values))


def _reset(context, launch_configurations={}):
    context.launch_configurations = {
        perform(context, name): perform(context, value)
        for name, value in launch_configurations.items()}


def _unset_configuration(context, name):
    context.launch_configurations.pop(perform(context, name), None)


def _unset_variable(context, name):
    context.environment.pop(perform(context, name), None)


def _pop_configurations(context):
    context.launch_configurations = context.saved_configurations.pop()


def _shut_down(context, *, reason='reason not given'):
    if getattr(context.locals.event, 'kind', None) == 'on_exit':
        get_logger('launch').info(f'process[{context.locals.event.process_name}] was required: '
                                  'shutting down launched system')
    context.shutdown(perform(context, reason))


OpaqueFunction = action(
    'OpaqueFunction', lambda context, *, function, args=(), kwargs={}: function(
        context, *args, **kwargs))
SetLaunchConfiguration = action(
    'SetLaunchConfiguration', lambda context, name, value: context.launch_configurations.update(
        {perform(context, name): perform(context, value)}))
UnsetLaunchConfiguration = action('UnsetLaunchConfiguration', _unset_configuration)
ResetLaunchConfigurations = action('ResetLaunchConfigurations', _reset)
PushLaunchConfigurations = action(
    'PushLaunchConfigurations', lambda context: context.saved_configurations.append(
        dict(context.launch_configurations)))
PopLaunchConfigurations = action('PopLaunchConfigurations', _pop_configurations)
SetEnvironmentVariable = action(
    'SetEnvironmentVariable', lambda context, name, value: context.environment.update(
        {perform(context, name): perform(context, value)}))
UnsetEnvironmentVariable = action('UnsetEnvironmentVariable', _unset_variable)
AppendEnvironmentVariable = action('AppendEnvironmentVariable', _append)
ResetEnvironment = action('ResetEnvironment', lambda context: context.set_environment(
    context.initial_environment))
PushEnvironment = action('PushEnvironment', lambda context: context.saved_environments.append(
    dict(context.environment)))
PopEnvironment = action('PopEnvironment', lambda context: context.set_environment(
    context.saved_environments.pop()))
LogInfo = action('LogInfo', lambda context, *, msg: get_logger('launch.user').info(
    perform(context, msg)))
Shutdown = action('Shutdown', _shut_down)
EmitEvent = action('EmitEvent', lambda context, *, event: context.shutdown(
    perform(context, event.reason)))
RegisterEventHandler = action('RegisterEventHandler', lambda context, event_handler: (
    context.handlers.insert(0, event_handler)))
UnregisterEventHandler = action('UnregisterEventHandler', lambda context, event_handler: (
    context.handlers.remove(event_handler)))


# ------------------------------------------------------------------------- launch.event_handlers

class EventHandler:
    """An event handler whose reactions are entities or functions that return entities."""

    def __init__(self, *, target_action=None, handle_once=False, **reactions):
        self.target_action, self.handle_once = target_action, handle_once
        self.reactions = reactions
        if not reactions or not set(reactions) <= set(self.kinds):
            raise TypeError(f'{type(self).__name__} requires {" or ".join(self.kinds)}, but got '
                            f'{", ".join(reactions) or "nothing"}')
        if not (target_action is None or isinstance(target_action, Action)
                or callable(target_action)):
            raise TypeError("action_matcher must be an 'Action' instance or a callable, but got "
                            f"'{target_action}'")

    def matches(self, event):
        target = self.target_action
        return event.kind in self.reactions and (
            target in (None, event.action) or callable(target) and target(event.action))

    def handle(self, event, context):
        reaction = self.reactions[event.kind]
        if event.kind in OnProcessIO.kinds:
            return reaction(event)
        return reaction(event, context) if callable(reaction) else reaction


def event_handler(name, *kinds):
    """Create an event handler class for the given kinds of events, such as 'on_exit'."""
    return type(name, (EventHandler,), {'kinds': kinds})


OnExecutionComplete = event_handler('OnExecutionComplete', 'on_completion')
OnProcessExit = event_handler('OnProcessExit', 'on_exit')
OnProcessIO = event_handler('OnProcessIO', 'on_stdin', 'on_stdout', 'on_stderr')
OnProcessStart = event_handler('OnProcessStart', 'on_start')
OnShutdown = event_handler('OnShutdown', 'on_shutdown')


# ------------------------------------------------------------------------------------------------

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
        kept = [SetLaunchConfiguration(*each) for each in launch_configurations.items()]
        if not scoped:
            return [*kept, *actions]
        if not forwarding:
            kept = [ResetEnvironment(), ResetLaunchConfigurations(launch_configurations)]
        return [PushLaunchConfigurations(), PushEnvironment(), *kept, *actions, PopEnvironment(),
                PopLaunchConfigurations()]


class TimerAction(Action):

    def __init__(self, **options):
        super().__init__(**options)
        if isinstance(self.period, int):
            raise TypeError("'TimerAction' expected 'period' to be a float, a str or a "
                            f"substitution, but got '{self.period}' of type '<class 'int'>'")

    def do(self, context, *, period, actions):
        async def wait(file=context.launch_file, settings=dict(context.launch_configurations)):
            await context.pause(period if isinstance(period, float) else float(
                perform(context, period)))
            context.launch_file = file
            current, context.launch_configurations = context.launch_configurations, settings
            for each in actions if not context.is_shutdown else ():
                context.visit(each)
            context.launch_configurations = current
        self.task = context.create_task(wait())


OUTPUTS = {
    'screen': {'both': 'screen'}, 'log': {'both': 'log', 'stderr': 'screen'},
    'both': {'both': 'screen log'},
    'own_log': {'both': 'own_log', 'stdout': 'own_log', 'stderr': 'own_log'},
    'full': {'both': 'screen log own_log', 'stdout': 'own_log', 'stderr': 'own_log'}}
"""Output destinations for stdout, stderr and both streams, keyed by the value of `output`."""


def destinations(output, process, stream):
    """Return the destinations of a process's stdout or stderr: 'screen' or log file names."""
    if not isinstance(output, dict) and output not in OUTPUTS:
        raise ValueError(f'{output} is not a valid standard output config i.e. "screen", "log" or '
                         '"both"')
    own_logs = {'both': f'{process}.log', stream: f'{process}-{stream}.log'}
    output, found = output if isinstance(output, dict) else OUTPUTS[output], []
    for source, own_log in own_logs.items():
        names = output.get(source, '')
        for name in names.split() if isinstance(names, str) else names:
            if name not in ('screen', 'log', 'own_log'):
                raise ValueError(f'{name} is not a valid output destination i.e. "screen", "log" '
                                 'or "own_log"')
            found.append({'screen': 'screen', 'log': 'launch.log', 'own_log': own_log}[name])
    return found


class ExecuteProcess(Action):

    popen = process_details = return_code = None

    def do(self, context, *, cmd, prefix=None, name=None, cwd=None, env=None, additional_env={},
           shell=False, emulate_tty=False, output='log', on_exit=(), respawn=False,
           respawn_delay=None, respawn_max_retries=-1,
           sigterm_timeout=LaunchConfiguration('sigterm_timeout', default=5),
           sigkill_timeout=LaunchConfiguration('sigkill_timeout', default=5)):
        """Expand the substitutions in the arguments, and schedule the start of the process."""
        def text(value):
            return None if value is None else perform(context, value)

        def texts(values):
            return {text(name): text(value) for name, value in values.items()}

        settings, self.command = context.launch_configurations, [*map(text, cmd)]
        if prefix is None and re.match(settings.get('launch-prefix-filter', ''),
                                       os.path.basename(self.command[0])):
            prefix = settings.get('launch-prefix')
        self.command[:0] = shlex.split(text(prefix) or '')
        context.process_count += 1
        self.name = f'{text(name) or os.path.basename(self.command[0])}-{context.process_count}'
        if self in context.processes:
            raise RuntimeError(
                f"ExecuteLocal action '{self.name}': executed more than once: {self}")
        self.variables = {**(context.environment if env is None else texts(env)),
                          **texts(additional_env or {})}
        self.directory = text(cwd)
        output = os.environ.get('OVERRIDE_LAUNCH_PROCESS_OUTPUT') or (
            output if isinstance(output, dict) else text(output))
        self.targets = [destinations(output, self.name, each) for each in ('stdout', 'stderr')]
        self.respawn = respawn if isinstance(respawn, bool) else read_typed(text(respawn), bool)
        if 'emulate_tty' in settings:
            self.emulate_tty = read_typed(settings['emulate_tty'], bool)
        self.context, self.logger = context, get_logger(self.name)
        context.handlers.insert(0, OnProcessExit(target_action=self, on_exit=on_exit))
        if not context.is_shutdown:
            context.processes.append(self)
            self.task = context.create_task(self._run())

    def emit(self, kind, **details):
        self.context.emit(kind, **self.process_details, process_name=self.name, **details)

    async def _run(self):
        retries = self.respawn_max_retries
        while not self.context.is_shutdown:
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
                stdout=pipes[0][1], stderr=pipes[1][1], preexec_fn=end_with_parent)
        except BaseException:
            for reader, _ in pipes:
                os.close(reader)
            raise
        finally:
            for _, writer in pipes:
                os.close(writer)
        pid = self.popen.pid
        self.logger.info(f'process started with pid [{pid}]')
        self.process_details = {'action': self, 'name': self.name, 'pid': pid, 'cmd': self.command,
                                'cwd': self.directory, 'env': self.variables}
        self.emit('on_start')
        loop = asyncio.get_running_loop()
        streams = [_Stream(self, index, end) for index, (end, _) in enumerate(pipes)]
        self.ended = loop.create_future()
        threading.Thread(daemon=True, target=lambda: loop.call_soon_threadsafe(
            self.ended.set_result, self.popen.wait())).start()
        code = self.return_code = await self.ended
        for stream in streams:
            for _ in range(20):  # A pipe holds at most 1 MiB, so 16 reads of 64 KiB suffice.
                stream.read()
        if code == 0:
            self.logger.info(f'process has finished cleanly [pid {pid}]')
        else:
            cmd = ' '.join(filter(str.strip, self.command))
            self.logger.error(f"process has died [pid {pid}, exit code {code}, cmd '{cmd}'].")
        for stream in streams:
            stream.close()
        self.popen.stdin.close()
        self.emit('on_exit', returncode=code)

    def end(self, number):
        """End the process by sending signals, up to SIGKILL if necessary."""
        if self.popen and self.popen.poll() is None:
            self.context.create_task(self._end(number))

    async def _end(self, first):
        term, kill = (each if isinstance(each, float) else perform(self.context, each)
                      for each in (self.sigterm_timeout, self.sigkill_timeout))
        both = float(term) + float(kill) if first == signal.SIGINT else kill
        for number, seconds, shown, stronger in (
                (signal.SIGINT, float(term), term, 'SIGTERM'),
                (signal.SIGTERM, float(kill), both, 'SIGKILL'),
                (signal.SIGKILL, None, None, None))[first != signal.SIGINT:]:
            self.logger.info(f"sending signal '{number.name}' to process[{self.name}]")
            self.popen.send_signal(number)
            await asyncio.wait([self.ended], timeout=seconds)
            if self.ended.done():
                return
            self.logger.error(
                f"process[{self.name}] failed to terminate '{shown}' seconds after receiving "
                f"'{number.name}', escalating to '{stronger}'")


class _Stream:
    """The output lines of a process on stdout or stderr."""

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
        else:
            self.process.emit(('on_stdout', 'on_stderr')[self.index], text=data)
        *lines, self.rest = (self.rest + self.decode(data)).split('\n')
        self.write(lines)

    def write(self, lines):
        for line in lines:
            write(f'[{self.process.name}] {line}', self.process.targets[self.index])

    def close(self):
        self.write([self.rest] if self.rest else [])
        asyncio.get_running_loop().remove_reader(self.end)
        os.close(self.end)
