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
"""The stand-in for launch 3.4.11: launch descriptions, launch files and the launch service."""

import asyncio
from contextlib import suppress
from functools import cache
from importlib.machinery import SourceFileLoader
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_loader
import os
import signal
import traceback
from types import SimpleNamespace

from launch import actions
from launch.actions import (Action, DeclareLaunchArgument, OnExecutionComplete,
                            SetLaunchConfiguration)
from launch.substitutions import (describe, get_logger, launch_config, log_file, missing_name,
                                  perform, Substitution)

__all__ = ['Action', 'LaunchContext', 'LaunchDescription', 'LaunchService', 'Substitution']
__getattr__ = missing_name('launch')
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP)


class LaunchDescription:
    """A list of entities, usually actions, that a launch executes in order."""

    condition = task = None

    def __init__(self, initial_entities=()):
        self.entities = list(initial_entities)
        self.add_action = self.add_entity = self.entities.append

    def get_sub_entities(self, context=None):
        return self.entities

    execute = get_sub_entities

    def declared_arguments(self, entity=None, given=(), conditional=False):
        """Return a list of (argument, is_required) for all declared arguments."""
        found = []
        for each in (entity or self).get_sub_entities():
            under = conditional or each.condition is not None
            names = [describe(name) for name, _ in getattr(each, 'launch_arguments', ())]
            if isinstance(each, DeclareLaunchArgument):
                found.append((each, each.default_value is None and not under
                              and describe(each.name) not in given))
            else:
                found += self.declared_arguments(each, (*given, *names), under)
        return found

    def get_launch_arguments(self):
        found = {}
        for argument, _ in self.declared_arguments():
            found.setdefault(argument.name, argument)
        return list(found.values())


class InvalidLaunchFileError(Exception):
    """Raised when a launch file cannot be loaded."""


class InvalidPythonLaunchFileError(InvalidLaunchFileError):
    """Raised when a Python launch file does not define generate_launch_description()."""


def get_launch_description_from_python_launch_file(path):
    loader = SourceFileLoader('python_launch_file', path)
    module = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    if not hasattr(module, 'generate_launch_description'):
        raise InvalidPythonLaunchFileError(
            f"launch file at '{path}' does not contain the required function "
            "'generate_launch_description()'")
    return module.generate_launch_description()


@cache
def extensions(group):
    """Return the entry points in a group, keyed by name."""
    return {each.name: each for each in entry_points(group=group)}


def get_launch_description_from_any_launch_file(path):
    suffix = os.path.splitext(path)[1][1:]
    parsers = extensions('launch.frontend.parser')
    for name in [suffix] if suffix in parsers else parsers:
        try:
            return parsers[name].load()(path)
        except Exception as error:
            if name == suffix:
                raise InvalidLaunchFileError(
                    'Caught multiple exceptions when trying to load file of format '
                    f'[{suffix}]:\n - {type(error).__name__}: {error}') from error
    raise InvalidLaunchFileError(
        'The launch file may have a syntax error, or its format is unknown')


class LaunchDescriptionSource:
    """A launch file whose path may contain substitutions."""

    read = staticmethod(get_launch_description_from_any_launch_file)

    def __init__(self, launch_file_path):
        self.path = launch_file_path

    def get_launch_description(self, context):
        self.location = perform(context, self.path)
        return self.read(self.location)

    def try_get_launch_description_without_context(self):
        with suppress(Exception):  # The path may depend on unset launch configurations.
            return self.get_launch_description(LaunchContext())


class PythonLaunchDescriptionSource(LaunchDescriptionSource):

    read = staticmethod(get_launch_description_from_python_launch_file)


# All other launch description sources select the parser by the suffix of the launch file.
AnyLaunchDescriptionSource = FrontendLaunchDescriptionSource = LaunchDescriptionSource
XMLLaunchDescriptionSource = YAMLLaunchDescriptionSource = LaunchDescriptionSource


class IncludeLaunchDescription(Action):

    def __init__(self, launch_description_source, **options):
        if not isinstance(launch_description_source, LaunchDescriptionSource):
            launch_description_source = LaunchDescriptionSource(launch_description_source)
        super().__init__(launch_description_source, **options)
        self.launch_arguments = self.given.arguments['launch_arguments'] = list(
            self.launch_arguments or ())

    def get_sub_entities(self):
        found = self.launch_description_source.try_get_launch_description_without_context()
        return [found] if found else []

    def do(self, context, launch_description_source, *, launch_arguments=()):
        description = launch_description_source.get_launch_description(context)
        context.launch_file = os.path.abspath(launch_description_source.location)
        names = [perform(context, name) for name, _ in launch_arguments]
        for argument, required in description.declared_arguments():
            if required and argument.name not in names:
                raise RuntimeError(
                    f"Included launch description missing required argument '{argument.name}' "
                    f"(description: '{argument.description}'), given: [{', '.join(names)}]")
        return [*(SetLaunchConfiguration(*each) for each in launch_arguments), description]


actions.IncludeLaunchDescription = IncludeLaunchDescription


class LaunchContext:
    """The state of a launch: launch configurations, environment variables and processes."""

    def __init__(self, *, argv=None, noninteractive=False):
        self.launch_configurations = {}
        self.environment = os.environ
        self.initial_environment = dict(os.environ)
        self.launch_file = ''
        self.saved_configurations, self.saved_environments = [], []
        self.argv = argv
        self.locals = SimpleNamespace(event=None)
        self.shutting_down = asyncio.Event()
        self.tasks = []
        self.processes = []
        self.handlers = []  # latest event handler first
        self.process_count = 0
        self.signal = signal.SIGINT  # the first signal sent to end a process
        self.perform_substitution = lambda substitution: substitution.perform(self)

    def set_environment(self, environment):
        """Replace all environment variables of this process with the given ones."""
        self.environment.clear()
        self.environment.update(environment)

    @property
    def is_shutdown(self):
        return self.shutting_down.is_set()

    def create_task(self, coroutine):
        """Start a task that must end before the launch can end."""
        self.tasks.append(asyncio.ensure_future(coroutine))
        return self.tasks[-1]

    def emit(self, kind, **details):
        """Pass an event to all matching handlers and execute the entities that they return."""
        event = SimpleNamespace(**{'kind': kind, 'action': None, **details})
        for handler in list(self.handlers):
            if handler.matches(event):
                if handler.handle_once:
                    self.handlers.remove(handler)
                outer, self.locals.event = self.locals.event, event
                found = handler.handle(event, self)
                for each in found if isinstance(found, (list, tuple)) else filter(None, [found]):
                    self.visit(each)
                self.locals.event = outer

    def visit(self, entity):
        """Execute an entity and the entities that it returns, unless its condition is false."""
        if entity.condition is None or entity.condition.evaluate(self):
            for each in entity.execute(self) or ():
                self.visit(each)
            if any(type(handler) is OnExecutionComplete for handler in self.handlers):
                self.create_task(self.emit_after(entity.task, 'on_completion', action=entity))

    async def emit_after(self, task, kind, **details):
        if task:
            await asyncio.wait([task])
        self.emit(kind, **details)

    async def pause(self, seconds):
        """Wait for a duration (s) or until the launch begins to shut down."""
        with suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self.shutting_down.wait(), seconds)

    def shutdown(self, reason):
        if not self.is_shutdown:
            self.shutting_down.set()
            self.create_task(self.emit_after(None, 'on_shutdown', reason=reason,
                                             due_to_sigint=reason == 'ctrl-c (SIGINT)'))
        for process in self.processes:
            process.end(self.signal)


class LaunchService:
    """Executes launch descriptions and manages the processes that they start."""

    def __init__(self, *, argv=None, noninteractive=False, debug=False):
        self.context = LaunchContext(argv=argv, noninteractive=noninteractive)
        self._descriptions = []
        self.include_launch_description = self._descriptions.append
        self._level = 'DEBUG' if debug else 'INFO'
        self._logger = get_logger('launch')
        self._status = 0
        self._loop = None

    def shutdown(self):
        """End the launch. This method is thread-safe."""
        with suppress(RuntimeError):  # The launch has ended.
            self._loop.call_soon_threadsafe(
                self.context.shutdown, 'LaunchService.shutdown() called')

    def run(self, *, shutdown_when_idle=True):
        """Run the launch in the main thread and return its exit status."""
        status = asyncio.run(self.run_async(shutdown_when_idle))
        number = self.context.signal
        if number != signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
        return status

    async def run_async(self, shutdown_when_idle=True):
        context, self._loop = self.context, asyncio.get_running_loop()
        self._loop.set_exception_handler(lambda _, details: self._fail(
            details.get('exception') or details['message']))
        launch_config.level, launch_config.on_closed_stdout = self._level, self._on_closed_stdout
        signals = []
        handlers = {number: signal.signal(number, lambda number, frame: (
            signals.append(number),
            self._loop.call_soon_threadsafe(self._on_signal, number))) for number in SIGNALS}
        if not shutdown_when_idle:
            context.create_task(context.shutting_down.wait())
        log_file('launch.log')
        self._logger.info(f'All log files can be found below {launch_config.log_dir}')
        self._logger.info(f'Default logging verbosity is set to {self._level}')
        try:
            for description in self._descriptions:
                context.visit(description)
        except Exception as error:
            if not signals:  # Ctrl-C also interrupts the program run by a Command substitution.
                self._fail(error)
        await asyncio.sleep(0)  # handle pending signals
        while context.tasks or not context.is_shutdown:
            if not context.tasks:
                context.shutdown('idle')
            done, _ = await asyncio.wait(context.tasks, return_when=asyncio.FIRST_COMPLETED)
            context.tasks = [task for task in context.tasks if task not in done]
            for error in filter(None, [task.exception() for task in done]):
                self._fail(error)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        return self._status

    def _fail(self, error):
        if isinstance(error, Exception):
            self._logger.debug(''.join(traceback.format_exception(error)).rstrip())
        self._logger.error(f'Caught exception in launch (see debug for traceback): {error}')
        self._status = 1
        self.context.shutdown(str(error))

    def _on_signal(self, number):
        if number == signal.SIGINT:
            again = ' again, ignoring...' if self.context.is_shutdown else ''
            self._logger.warning(f'user interrupted with ctrl-c (SIGINT){again}')
            if again:
                return
        self.context.signal = number
        self.context.shutdown(f'ctrl-c ({signal.Signals(number).name})')

    def _on_closed_stdout(self):
        self._status = 120
        self.context.shutdown('stdout is closed')
