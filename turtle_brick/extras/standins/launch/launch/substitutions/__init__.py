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
"""Stand-ins for logging, utilities, substitutions and conditions from the `launch` package."""

from contextlib import suppress
from datetime import datetime
from functools import lru_cache
import importlib
import inspect
import math
import os
from pathlib import Path
import random
import re
import shlex
import shutil
import socket
import subprocess
import sys
from textwrap import shorten
import time
from types import SimpleNamespace

import yaml


def missing_name(package):
    """Return a module-level __getattr__ that imports submodules and reports missing names."""
    def __getattr__(name):
        with suppress(ModuleNotFoundError):
            return importlib.import_module(f'{package}.{name}')
        kind = ImportError if name[:1].isupper() else AttributeError
        raise kind(f'{name} is not in the stand-in for {package}: check its spelling, use another '
                   'feature, or install the real ROS 2 Jazzy')
    return __getattr__


__getattr__ = missing_name('launch')


# -------------------------------------------------------------------------------- launch.logging

launch_config = SimpleNamespace(level='INFO', on_closed_stdout=lambda: None)


@lru_cache(None)
def log_file(name):
    """Open and return a file in the log directory, which is created if necessary."""
    if not hasattr(launch_config, 'log_dir'):
        base = os.environ.get('ROS_LOG_DIR') or os.path.join(
            os.environ.get('ROS_HOME') or os.path.join('~', '.ros'), 'log')
        stamp = datetime.now().strftime('%Y-%m-%d-%H-%M-%S-%f')
        launch_config.log_dir = os.path.join(
            os.path.expanduser(base), f'{stamp}-{socket.gethostname()}-{os.getpid()}')
        os.makedirs(launch_config.log_dir)
    return open(os.path.join(launch_config.log_dir, name), 'a', 1, 'utf-8', newline='')


def write(line, targets=('screen', 'launch.log')):
    """Write a line to the given targets: the screen, log files, or both."""
    for name in set(targets) - {'screen'}:
        stamp = f'{time.time():.7f} ' if name == 'launch.log' else ''
        log_file(name).write(f'{stamp}{line}\n')
    if 'screen' in targets:
        try:
            sys.stdout.write(f'{line}\n')
            sys.stdout.flush()
        except OSError:  # The reader of this output has closed the pipe.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            launch_config.on_closed_stdout()


class get_logger:
    """A logger with the methods debug(), info(), warning() and error()."""

    def __init__(self, name='root'):
        self.name = name

    def __getattr__(self, level):
        return lambda message: (level == 'debug' and launch_config.level != 'DEBUG') or write(
            f'[{level.upper()}] [{self.name}]: {message}')


# ------------------------------------------------------------------------------ launch.utilities

class Deferred:
    """Base class that stores constructor arguments until call() passes them to the method `do`."""

    def __init__(self, *args, **kwargs):
        signature = inspect.signature(self.do)
        try:
            self.given = signature.bind(None, *args, **kwargs)
        except TypeError as error:
            found = {**inspect.signature(type(self).__init__).parameters, **signature.parameters}
            names = [name for name, each in found.items() if name not in ('self', 'context')
                     and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)]
            raise TypeError(f'{type(self).__name__}.__init__() {error}. In the stand-in for '
                            f'launch, it has these arguments: {", ".join(names)}') from None
        self.given.apply_defaults()
        self.__dict__.update(self.given.arguments)

    def call(self, context):
        return self.do(context, *self.given.args[1:], **self.given.kwargs)

    def do(self, context):
        """Run the action or substitution. Subclasses override this method or its caller."""
        raise NotImplementedError


def normalize_to_list_of_substitutions(value):
    return [part if isinstance(part, Substitution) else TextSubstitution(text=part)
            for part in (value if isinstance(value, (list, tuple)) else [value])]


def perform_substitutions(context, value):
    return ''.join(part.perform(context) for part in normalize_to_list_of_substitutions(value))


perform = perform_substitutions


def read_typed(text, kind=None):
    """Convert a string to a type such as bool or list[int] (by default, to its YAML type)."""
    if kind in (str, int, float):
        return kind(text)
    if kind is bool and text in ('0', '1'):
        return text == '1'
    try:
        value = yaml.safe_load(text) if text else text
    except yaml.YAMLError as error:
        raise ValueError(f"Failed to convert '{shorten(text, 60)}' using yaml rules: "
                         f'yaml.safe_load() failed\n{error}') from None
    if not is_typed(value, kind):
        raise ValueError(f"'{shorten(text, 60)}' can not be converted to "
                         f"{kind or 'one of the types'}")
    return value


def is_typed(value, kind):
    """Return whether a value has a type such as bool or list[int] (by default, any of these)."""
    scalar = getattr(kind, '__args__', [kind])[0] or (str, int, float, bool)
    parts = value if isinstance(value, list) else [value]
    return (all(isinstance(part, scalar) for part in parts) and len(set(map(type, parts))) < 2
            and (kind is None or isinstance(value, list) is not (scalar is kind)))


# -------------------------------------------------------------------------- launch.substitutions

class SubstitutionFailure(RuntimeError):
    """Raised when a substitution cannot be expanded."""


class Substitution(Deferred):
    """The base class of all substitutions. Subclasses implement `do`."""

    perform = Deferred.call
    separator = ' + '

    def describe(self):
        """Return the unexpanded form of the substitution, as printed by `ros2 launch -s`."""
        return self.description.format(**{
            name: describe(value, self.separator) for name, value in self.given.arguments.items()})


def describe(value, separator=' + '):
    if isinstance(value, (list, tuple)):
        return separator.join(map(describe, value))
    return value.describe() if isinstance(value, Substitution) else f"'{value}'"


def substitution(name, description, function, base=Substitution):
    """Create a substitution class whose `do` method is a given function."""
    return type(name, (base,), {'description': description, 'do': staticmethod(function)})


class TextSubstitution(Substitution):

    def __init__(self, *, text):
        if not isinstance(text, (str, os.PathLike)):
            raise TypeError(f"Failed to normalize given item of type '{type(text)}', when only "
                            "'str' or 'launch.Substitution' were expected.")
        self.text = os.fspath(text)

    def describe(self):
        return f"'{self.text}'"

    def perform(self, context):
        return self.text


class PathBase(Substitution):
    """The base class of paths to which the operator `/` appends a component."""

    def __truediv__(self, component):
        return PathJoinSubstitution([*getattr(self, 'substitutions', [self]), component])


def _look_up(what, values, name, default, context):
    if name in values:
        return values[name]
    if default is None:
        raise SubstitutionFailure(f"{what} '{name}' does not exist")
    return perform(context, [part if isinstance(part, Substitution) else str(part) for part in (
        default if isinstance(default, (list, tuple)) else [default])])


def _launch_file(name, context):
    if not context.launch_file:
        raise SubstitutionFailure(f'{name} used outside of a launch file (in a script)')
    return context.launch_file


LaunchConfiguration = substitution(
    'LaunchConfiguration', 'LaunchConfig({variable_name})',
    lambda context, variable_name, *, default=None: _look_up(
        'launch configuration', context.launch_configurations, perform(context, variable_name),
        default, context))
EnvironmentVariable = substitution(
    'EnvironmentVariable', 'EnvVar({name})',
    lambda context, name, *, default_value=None: _look_up(
        'environment variable', context.environment, perform(context, name), default_value,
        context))
ThisLaunchFile = substitution(
    'ThisLaunchFile', 'ThisLaunchFile()', lambda context: _launch_file('ThisLaunchFile', context))
ThisLaunchFileDir = substitution(
    'ThisLaunchFileDir', 'ThisLaunchFileDir()',
    lambda context: os.path.dirname(_launch_file('ThisLaunchFileDir', context)),
    PathBase)
FileContent = substitution('FileContent', 'FileContent({path})', lambda context, path: (
    Path(perform(context, path)).read_text(encoding='utf-8')))
LaunchLogDir = substitution(
    'LaunchLogDir', 'LaunchLogDir()', lambda context: launch_config.log_dir, PathBase)
LocalSubstitution = substitution(
    'LocalSubstitution', 'LocalVar({expression})',
    lambda context, expression, description='': eval(f'context.locals.{expression}'))
PathJoinSubstitution = substitution(
    'PathJoinSubstitution', "PathJoinSubstitution('{substitutions}')",
    lambda context, substitutions: str(Path(*(perform(context, each) for each in substitutions))),
    PathBase)
PathJoinSubstitution.separator = ', '


def PathSubstitution(path):
    """Return a path that consists of a single substitution or of a list of components."""
    return PathJoinSubstitution(normalize_to_list_of_substitutions(path))


def _find_executable(context, *, name):
    path = shutil.which(perform(context, name))
    if path is None:
        raise SubstitutionFailure(f"executable '{name}' not found on the PATH")
    return path


def _command(context, command, *, on_stderr='fail'):
    command, on_stderr = perform(context, command), perform(context, on_stderr)
    if on_stderr not in ('fail', 'ignore', 'warn', 'capture'):
        raise SubstitutionFailure(
            "expected 'on_stderr' to be one of: 'fail', 'ignore', 'warn' or 'capture'")
    try:
        done = subprocess.run(
            shlex.split(command), stdout=subprocess.PIPE, text=True,
            stderr=subprocess.STDOUT if on_stderr == 'capture' else subprocess.PIPE)
    except FileNotFoundError as error:
        raise SubstitutionFailure(f'file not found: {error}') from None
    if done.returncode:
        captured = f'\nCaptured stderr output: {done.stderr}' if done.stderr else ''
        raise SubstitutionFailure(f'executed command failed. Command: {command}{captured}')
    if done.stderr and on_stderr != 'ignore':
        message = (f'executed command showed stderr output. Command: {command}\n'
                   f'Captured stderr output:\n{done.stderr}')
        if on_stderr == 'fail':
            raise SubstitutionFailure(message)
        get_logger().warning(message)
    return done.stdout


def _evaluate(context, expression, python_modules=('math',)):
    modules = [importlib.import_module(name.strip())
               for each in normalize_to_list_of_substitutions(python_modules)
               for name in each.perform(context).split(',')]
    names = dict(vars(math)) if math in modules else {}
    names.update((each.__name__, each) for each in modules)
    return str(eval(perform(context, expression), {}, names))


def _anonymous_name(context, name):
    name = perform(context, name)
    unique = f'{name}_{socket.gethostname()}_{os.getpid()}_{random.randint(0, sys.maxsize)}'
    return context.launch_configurations.setdefault(f'anon{name}', re.sub('[-.:]', '_', unique))


AnonName = substitution('AnonName', 'AnonName({name})', _anonymous_name)
FindExecutable = substitution('FindExecutable', 'FindExec({name})', _find_executable)
Command = substitution('Command', 'Command({command})', _command)
PythonExpression = substitution(
    'PythonExpression', 'PythonExpr({expression}, [{python_modules}])', _evaluate)


def _to_text(context, side):
    if isinstance(side, Substitution) or isinstance(side, (list, tuple)) and any(
            isinstance(part, Substitution) for part in side):
        return perform(context, side)
    if side is None:
        return ''
    return str(side).lower() if isinstance(side, bool) else str(side)


def _equal(context, *sides):
    left, right = (_to_text(context, side) for side in sides)
    if {left.lower(), right.lower()} <= {'true', 'false', '1', '0'}:
        return (left.lower() in ('true', '1')) == (right.lower() in ('true', '1'))
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right


def _truths(context, *values):
    try:
        return [read_typed(perform(context, each), bool) for each in values]
    except ValueError as error:
        raise SubstitutionFailure(error) from None


def _choose(context, condition, if_value='', else_value=''):
    if if_value == else_value == '':
        raise RuntimeError('One of if_value and else_value must be specified')
    return perform(context, if_value if all(_truths(context, condition)) else else_value)


def _logic(name, arguments, function):
    do = {'left right': lambda context, left, right: str(function(context, left, right)).lower(),
          'value': lambda context, value: str(function(context, value)).lower(),
          '*values': lambda context, *values: str(function(context, *values)).lower()}[arguments]
    return substitution(name, f'{name}(...)', do)


EqualsSubstitution = _logic('EqualsSubstitution', 'left right', _equal)
NotEqualsSubstitution = _logic('NotEqualsSubstitution', 'left right', lambda *a: not _equal(*a))
AndSubstitution = _logic('AndSubstitution', 'left right', lambda *a: all(_truths(*a)))
OrSubstitution = _logic('OrSubstitution', 'left right', lambda *a: any(_truths(*a)))
NotSubstitution = _logic('NotSubstitution', 'value', lambda *a: not all(_truths(*a)))
AllSubstitution = _logic('AllSubstitution', '*values', lambda *a: all(_truths(*a)))
AnySubstitution = _logic('AnySubstitution', '*values', lambda *a: any(_truths(*a)))
IfElseSubstitution = substitution(
    'IfElseSubstitution', 'IfElseSubstitution({condition}, {if_value}, {else_value})', _choose)


# ----------------------------------------------------------------------------- launch.conditions

class IfCondition:

    wanted = ('true', '1')

    def __init__(self, predicate_expression):
        self.expression = normalize_to_list_of_substitutions(predicate_expression)

    def evaluate(self, context):
        value = perform(context, self.expression).strip().lower()
        if value not in ('true', '1', 'false', '0'):
            raise ValueError(
                'invalid condition expression, expected one of [true, 1, false, 0] but got '
                f"'{value}', expanded from '{' + '.join(map(str, self.expression))}'")
        return value in self.wanted


class UnlessCondition(IfCondition):

    wanted = ('false', '0')


class LaunchConfigurationEquals:
    """A condition that is true if a launch configuration has a given value (None means unset)."""

    expected = True

    def __init__(self, launch_configuration_name, expected_value):
        self.name, self.value = launch_configuration_name, expected_value

    def evaluate(self, context):
        value = self.value if self.value is None else perform(context, self.value)
        return (context.launch_configurations.get(self.name) == value) is self.expected


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):

    expected = False
