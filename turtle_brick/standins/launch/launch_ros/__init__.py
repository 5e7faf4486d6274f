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
"""The stand-in for launch_ros 0.26.6: nodes, their parameters, remappings and namespaces."""

import os
from pathlib import Path
import shutil
from tempfile import NamedTemporaryFile

from ament_index_python.packages import get_package_prefix, get_package_share_directory
from launch.actions import action, ExecuteProcess
from launch.substitutions import (get_logger, missing_name, perform, read_typed, Substitution,
                                  substitution, SubstitutionFailure)
import yaml

__getattr__ = missing_name('launch_ros')


def _find_executable(context, executable, package):
    executable, package = perform(context, executable), perform(context, package)
    directory = os.path.join(get_package_prefix(package), 'lib', package)
    path = shutil.which(executable, path=directory)
    if path is None:
        raise SubstitutionFailure(
            f"executable '{executable}' not found on the libexec directory '{directory}' ")
    return path


FindPackagePrefix = substitution(
    'FindPackagePrefix', 'FindPackagePrefix(pkg={package})',
    lambda context, package: get_package_prefix(perform(context, package)))
FindPackageShare = substitution(
    'FindPackageShare', 'FindPackageShare(pkg={package})',
    lambda context, package: get_package_share_directory(perform(context, package)))
ExecutableInPackage = substitution(
    'ExecutableInPackage', 'ExecInPkg(pkg={package}, exec={executable})', _find_executable)


class ParameterValue:
    """A parameter value. A string is converted to the type `value_type`."""

    def __init__(self, value, *, value_type=None):
        self.value = [value] if isinstance(value, Substitution) else value
        self.value_type = value_type

    def evaluate(self, context):
        parts = self.value if isinstance(self.value, list) else [self.value]
        if isinstance(self.value, str) or any(isinstance(part, Substitution) for part in parts):
            return read_typed(perform(context, self.value), self.value_type)
        return self.value


class ParameterFile:
    """A parameter file, which may contain substitutions if `allow_substs` is true."""

    def __init__(self, param_file, *, allow_substs=False):
        self.param_file, self.allow_substs = param_file, allow_substs

    def evaluate(self, context):
        """Return the path of the file, or of a copy in which all substitutions are expanded."""
        path, allowed = perform(context, self.param_file), self.allow_substs
        if not (allowed if isinstance(allowed, bool) else read_typed(
                perform(context, allowed), bool)):
            return path
        from launch_xml import substitute
        with NamedTemporaryFile('w', prefix='launch_params_', delete=False) as file:
            file.write(perform(context, substitute(Path(path).read_text())))
        return file.name


def evaluate(context, value):
    """Return a parameter value in which all substitutions are expanded."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if not isinstance(value, (list, tuple, Substitution)):
        return value
    parts = [value] if isinstance(value, Substitution) else value
    if any(isinstance(part, Substitution) for part in parts):
        read = read_typed(perform(context, value))
        return tuple(read) if isinstance(read, list) else read
    values = [read_typed(perform(context, part)) if isinstance(part, (list, tuple)) else part
              for part in parts]
    kinds = set(map(type, values))
    if kinds == {int, float}:
        values = list(map(float, values))
    elif len(kinds) != 1 or not kinds <= {bool, int, float, str}:
        raise TypeError('Expected a non-empty sequence, with items of uniform type. Allowed '
                        f'sequence item types are bool, int, float, str. Got {value}')
    return tuple(values)


def evaluate_dict(context, parameters, prefix=''):
    """Return nested parameters as a flat dictionary keyed by full parameter name."""
    found = {}
    for name, value in parameters.items():
        name = prefix + perform(context, name)
        found.update(evaluate_dict(context, value, f'{name}.') if isinstance(value, dict)
                     else {name: evaluate(context, value)})
    return found


def join_namespaces(base, namespace):
    """Join two optional namespaces. An absolute namespace replaces the base."""
    from rclpy.validate_namespace import validate_namespace
    if base is None or namespace and namespace.startswith('/'):
        base = ''
    joined = f'{base.rstrip("/")}/{(namespace or "").lstrip("/")}'.rstrip('/') or '/'
    validate_namespace(joined)
    return joined


def _collect(kind, context, *values):
    # As in the real launch_ros, leaving a group does not undo additions to an existing list.
    context.launch_configurations.setdefault(kind, []).extend(values)


SetParameter = action('SetParameter', lambda context, name, value: _collect(
    'global_params', context, (perform(context, name), evaluate(context, value))))
SetParametersFromFile = action('SetParametersFromFile', lambda context, filename: _collect(
    'global_params', context, perform(context, filename)))
SetRemap = action('SetRemap', lambda context, src, dst: _collect(
    'ros_remaps', context, (perform(context, src), perform(context, dst))))
PushROSNamespace = PushRosNamespace = action(
    'PushROSNamespace', lambda context, namespace: context.launch_configurations.update(
        ros_namespace=join_namespaces(context.launch_configurations.get('ros_namespace'),
                                      perform(context, namespace))))


class Node(ExecuteProcess):

    def __init__(self, *, executable, package=None, name=None, namespace=None, exec_name=None,
                 parameters=None, remappings=None, ros_arguments=None, arguments=None, **options):
        program = executable if package is None else ExecutableInPackage(executable, package)
        super().__init__(name=exec_name, **options, cmd=[
            program, *(arguments or []),
            *([] if ros_arguments is None else ['--ros-args', *ros_arguments]), '--ros-args'])
        self.node_package, self.node_executable = package, executable
        self.names = name, namespace
        self.parameters, self.remappings = parameters or [], remappings or []

    def execute(self, context):
        logger, settings = get_logger('launch_ros.actions.node'), context.launch_configurations
        try:
            name, namespace = (each and perform(context, each) for each in self.names)
            if name is not None:
                from rclpy.validate_node_name import validate_node_name
                validate_node_name(name)
                self.cmd += ['-r', f'__node:={name}']
            if namespace is not None or 'ros_namespace' in settings:
                namespace = join_namespaces(settings.get('ros_namespace'), namespace)
                self.cmd += ['-r', f'__ns:={namespace}']
        except Exception:
            logger.error(
                'Error while expanding or validating node name or namespace for '
                f"'package={self.node_package}, executable={self.node_executable}, "
                f"name={self.names[0]}, namespace={self.names[1]}':")
            raise
        for each in settings.get('global_params', []):
            self.cmd += (['-p', f'{each[0]}:={each[1]}'] if isinstance(each, tuple)
                         else ['--params-file', os.path.abspath(each)])
        for each in self.parameters:
            if isinstance(each, dict):
                with NamedTemporaryFile('w', prefix='launch_params_', delete=False) as file:
                    key = f'{namespace.rstrip("/")}/{name}' if name and namespace else '/**'
                    yaml.dump({key: {'ros__parameters': evaluate_dict(context, each)}}, file,
                              default_flow_style=False)
                path = file.name
            elif isinstance(each, ParameterFile):
                path = each.evaluate(context)
            else:
                path = perform(context, each)
            if os.path.isfile(path):
                self.cmd += ['--params-file', path]
            else:
                logger.warning(f'Parameter file path is not a file: {path}')
        for source, target in [*settings.get('ros_remaps', []), *self.remappings]:
            self.cmd += ['-r', f'{perform(context, source)}:={perform(context, target)}']
        return super().execute(context)
