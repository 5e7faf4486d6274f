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
"""The stand-in for launch_ros 0.26.12: nodes with parameters, remappings and namespaces."""

from functools import partial
import os
import shutil
from tempfile import NamedTemporaryFile

import ament_index_python as index
from launch import frontend
from launch.actions import action, ExecuteProcess, TimerAction
from launch.frontend import attributes, substitute, take, TYPES
from launch.substitutions import (describe, get_logger, is_typed, missing_name, PathBase, perform,
                                  read_typed, Substitution, substitution, SubstitutionFailure,
                                  TextSubstitution)
import yaml

__getattr__ = missing_name('launch_ros')


def _find_package(find, package):
    try:
        return find(package)
    except index.PackageNotFoundError:
        if package not in index.get_resources('absent_packages'):
            raise
        reason, _ = index.get_resource('absent_packages', package)
        raise index.PackageNotFoundError(reason) from None


def _find_executable(context, executable, package):
    executable, package = perform(context, executable), perform(context, package)
    directory = os.path.join(FindPackagePrefix.find(package), 'lib', package)
    path = shutil.which(executable, path=directory)
    if path is None:
        raise SubstitutionFailure(
            f"executable '{executable}' not found on the libexec directory '{directory}' ")
    return path


class FindPackage(PathBase):
    """The base class of substitutions that return a package directory."""

    def do(self, context, package):
        return self.find(perform(context, package))

    def describe(self):
        return f'{type(self).__name__}(pkg={describe(self.package)})'


class FindPackagePrefix(FindPackage):

    find = staticmethod(partial(_find_package, index.get_package_prefix))


class FindPackageShare(FindPackage):

    find = staticmethod(partial(_find_package, index.get_package_share_directory))


ExecutableInPackage = substitution(
    'ExecutableInPackage', 'ExecInPkg(pkg={package}, exec={executable})', _find_executable)


class ParameterValue:
    """A parameter value. Strings are converted to `value_type`."""

    def __init__(self, value, *, value_type=None):
        self.value = [value] if isinstance(value, Substitution) else value
        self.value_type = value_type

    def evaluate(self, context):
        parts = self.value if isinstance(self.value, list) else [self.value]
        if isinstance(self.value, str) or any(isinstance(part, Substitution) for part in parts):
            return read_typed(perform(context, self.value), self.value_type)
        if isinstance(self.value, list):
            return [read_typed(perform(context, part)) if isinstance(part, list) else part
                    for part in self.value]
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
        with open(path, encoding='utf-8') as source, NamedTemporaryFile(
                'w', encoding='utf-8', prefix='launch_params_', delete=False) as file:
            file.write(perform(context, substitute(source.read())))
        return file.name


def evaluate(context, name, value):
    """Return a parameter value with all substitutions expanded."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if value is None:
        raise TypeError('Unexpected type for parameter value None')
    if not isinstance(value, (list, tuple, Substitution)):
        return value
    parts = [value] if isinstance(value, Substitution) else value
    if any(isinstance(part, Substitution) for part in parts):
        try:
            read = read_typed(perform(context, value))
        except ValueError:
            raise TypeError(
                f'Unable to parse the value of parameter {name} as yaml. If the parameter is '
                'meant to be a string, try wrapping it in launch_ros.parameter_descriptions.'
                'ParameterValue(value, value_type=str)') from None
        return tuple(read) if isinstance(read, list) else read
    values = [read_typed(perform(context, part)) if isinstance(part, (list, tuple)) else part
              for part in parts]
    kinds = set(map(type, values))
    if kinds == {int, float}:
        values = list(map(float, values))
    elif len(kinds) != 1 or not kinds <= {bool, int, float, str}:
        raise TypeError('Expected a non-empty sequence, with items of uniform type. Allowed '
                        'sequence item types are bool, int, float, str. Got inconsistent input '
                        f'for "{name}"')
    return tuple(values)


def evaluate_dict(context, parameters, prefix=''):
    """Return nested parameters as a flat dictionary keyed by full parameter name."""
    found = {}
    for name, value in parameters.items():
        name = prefix + perform(context, name)
        found.update(evaluate_dict(context, value, f'{name}.') if isinstance(value, dict)
                     else {name: evaluate(context, name, value)})
    return found


def join_namespaces(base, namespace):
    """Append a relative namespace to a base namespace. An absolute namespace replaces the base."""
    from rclpy.validate_namespace import validate_namespace
    if base is None or namespace and namespace.startswith('/'):
        base = ''
    joined = f'{base.rstrip("/")}/{(namespace or "").lstrip("/")}'.rstrip('/') or '/'
    validate_namespace(joined)
    return joined


def _collect(kind, context, *values):
    # As in ROS, the end of a scoped group does not undo changes to an existing list.
    context.launch_configurations.setdefault(kind, []).extend(values)


SetParameter = action('SetParameter', lambda context, name, value: _collect(
    'global_params', context, *evaluate_dict(context, {perform(context, name): value}).items()))
SetParametersFromFile = action('SetParametersFromFile', lambda context, filename: _collect(
    'global_params', context, perform(context, filename)))
SetRemap = action('SetRemap', lambda context, src, dst: _collect(
    'ros_remaps', context, (perform(context, src), perform(context, dst))))
PushROSNamespace = PushRosNamespace = action(
    'PushROSNamespace', lambda context, namespace: context.launch_configurations.update(
        ros_namespace=join_namespaces(context.launch_configurations.get('ros_namespace'),
                                      perform(context, namespace))))
SetUseSimTime = action('SetUseSimTime', lambda context, value: None)  # for launch's own node only
ROSTimer = RosTimer = type('RosTimer', (TimerAction,), {})


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
        if not isinstance(self.parameters, list):
            raise TypeError("'Node' expected 'parameters' to be one of [<class 'list'>], but got "
                            f"'{parameters}' of type '{type(parameters)}'")
        for each in self.remappings:
            if not isinstance(each, tuple):
                raise TypeError("Expected 'remap_rule' to be one of [<class 'tuple'>], but got "
                                f"'{each}' of type '{type(each)}'")
            if len(each) != 2:
                raise TypeError(
                    f'remap_rule must be a tuple of length 2, got length {len(each)}')

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
                with NamedTemporaryFile('w', encoding='utf-8', prefix='launch_params_',
                                        delete=False) as file:
                    key = f'{namespace.rstrip("/")}/{name}' if name and namespace else '/**'
                    yaml.dump({key: {'ros__parameters': evaluate_dict(context, each)}}, file,
                              default_flow_style=False)
                path = file.name
            else:
                file = each if isinstance(each, ParameterFile) else ParameterFile(each)
                path = file.evaluate(context)
            if os.path.isfile(path):
                self.cmd += ['--params-file', path]
            else:
                logger.warning(f'Parameter file path is not a file: {path}')
        for source, target in [*settings.get('ros_remaps', []), *self.remappings]:
            self.cmd += ['-r', f'{perform(context, source)}:={perform(context, target)}']
        return super().execute(context)


def parameter(element):
    """Convert a `param` element to a dictionary of parameters or to a ParameterFile."""
    if 'from' in element.attrib:
        given = attributes(element, ['src', 'allow_substs'])
        return ParameterFile(given['src'], allow_substs=given.get('allow_substs', False))
    if 'name' not in element.attrib:
        raise ValueError('param Entity should have name or from attribute')
    if element.get('type', 'str') not in TYPES:
        raise ValueError(f"Got invalid type identifier '{element.attrib['type']}'")
    has_value, value = 'value' in element.attrib, element.attrib.pop('value', None)
    name = tuple(attributes(element, ['name', 'type', 'value', 'value-sep'])['name'])
    if has_value == bool(len(element)):
        raise RuntimeError('nested parameters and value attributes are mutually exclusive' if
                           has_value else 'either a value attribute or nested params are needed')
    if not has_value:
        return {name: {key: value for each in element for key, value in parameter(each).items()}}
    kind = TYPES[element.attrib['type']] if 'type' in element.attrib else None
    wrong = f"Attribute 'value' of Entity 'param' expected to be of type '{kind}'"
    typed = hasattr(element, 'typed')
    if typed and '$(' not in str(value) and not is_typed(value, kind):
        raise TypeError(f"{wrong}, got '{value}' of type '{type(value)}'")
    if 'value-sep' in element.attrib:
        value = value.split(element.attrib['value-sep'])
    try:
        if isinstance(value, list):
            scalar = getattr(kind, '__args__', [kind])[0]
            value = [parameter_value(each, scalar, typed) for each in value]
        else:
            value = parameter_value(value, kind, typed)
    except ValueError:
        raise TypeError(f"{wrong}.'{value}' can not be converted to one of those types") from None
    return {name: ParameterValue(value, value_type=str if isinstance(value, str) else kind)}


def parameter_value(value, kind, is_converted):
    """Convert a parameter value to the type `kind` if it does not contain substitutions."""
    parts = substitute(value) if isinstance(value, str) else ()
    if not all(isinstance(part, TextSubstitution) for part in parts):
        return parts
    if isinstance(value, str):
        value = perform(None, parts)
    return value if is_converted else read_typed(value, kind)


def node_options(element, inner):
    """Convert the elements nested in a `node` element to arguments of Node."""
    options = {'parameters': [parameter(each) for each in inner if each.tag == 'param']}
    inner[:] = [each for each in inner if each.tag != 'param']
    remappings = map(tuple, take(inner, 'remap', 'src', 'dst'))
    return {**frontend.NESTED['executable'](element, inner), **options,
            'remappings': list(remappings)}


frontend.NESTED.update(node=node_options, ros_timer=frontend.NESTED['timer'])
frontend.SUBSTITUTIONS.update({
    'exec-in-pkg': ExecutableInPackage, 'find-pkg-prefix': FindPackagePrefix,
    'find-pkg-share': FindPackageShare})
frontend.ACTIONS.update({
    'node': Node, 'push-ros-namespace': PushROSNamespace, 'push_ros_namespace': PushROSNamespace,
    'ros_timer': ROSTimer, 'set_parameter': SetParameter,
    'set_parameters_from_file': SetParametersFromFile, 'set_remap': SetRemap,
    'set_use_sim_time': SetUseSimTime})
