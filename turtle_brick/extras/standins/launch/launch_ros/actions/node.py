# SPDX-License-Identifier: Apache-2.0
"""The action Node."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import os
from tempfile import NamedTemporaryFile
from typing import Any, get_args, List

from launch import Action, LaunchContext, SomeSubstitutionsType, Substitution
from launch.actions import ExecuteProcess
from launch.frontend import Entity, expose_action, Parser
from launch.logging import get_logger
from launch.substitutions import TextSubstitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import coerce_to_type, is_instance_of
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.parameters_type import SomeParameters
from launch_ros.remap_rule_type import SomeRemapRules
from launch_ros.substitutions import ExecutableInPackage
from launch_ros.utilities import (
    evaluate_parameter_dict, normalize_remap_rules, prefix_namespace)
import yaml

PARAMETER_TYPES: dict[str, Any] = {
    'str': str, 'int': int, 'float': float, 'bool': bool, 'list_of_str': list[str],
    'list_of_int': list[int], 'list_of_float': list[float], 'list_of_bool': list[bool]}
"""Types of parameters, keyed by the value of the attribute `type`."""


@expose_action('node')
class Node(ExecuteProcess):
    """
    Starts a node.

    In Python: Node(package='turtlesim', executable='turtlesim_node', namespace='alice',
                    parameters=[{'holonomic': True}], remappings=[('turtle1/pose', 'pose')])
    In XML: <node pkg="turtlesim" exec="turtlesim_node" namespace="alice">
              <param name="holonomic" value="true"/><remap from="turtle1/pose" to="pose"/></node>
    """

    def __init__(self, *, executable: SomeSubstitutionsType,
                 package: SomeSubstitutionsType | None = None,
                 name: SomeSubstitutionsType | None = None,
                 namespace: SomeSubstitutionsType | None = None,
                 exec_name: SomeSubstitutionsType | None = None,
                 parameters: SomeParameters | None = None,
                 remappings: SomeRemapRules | None = None,
                 ros_arguments: Iterable[SomeSubstitutionsType] | None = None,
                 arguments: Iterable[SomeSubstitutionsType] | None = None,
                 **kwargs: Any) -> None:
        program = executable if package is None else [ExecutableInPackage(executable, package)]
        ros_words = [] if ros_arguments is None else ['--ros-args', *ros_arguments]
        super().__init__(
            cmd=[program, *(arguments or ()), *ros_words, '--ros-args'], name=exec_name, **kwargs)
        if not isinstance(parameters or [], list):
            raise TypeError(f'parameters of Node is {parameters!r}, but must be a list')
        self.node_package = package
        self.node_executable = executable
        self.node_name = None if name is None else normalize_to_list_of_substitutions(name)
        self.node_namespace = (
            None if namespace is None else normalize_to_list_of_substitutions(namespace))
        self.parameters = parameters or []
        self.remappings = normalize_remap_rules(remappings or ())

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super(ExecuteProcess, cls).parse(entity, parser)
        arguments['executable'] = parser.parse_substitution(entity.get_attr('exec'))
        for argument, name in (('package', 'pkg'), ('name', 'name'), ('namespace', 'namespace'),
                               ('exec_name', 'exec_name')):
            value = entity.get_attr(name, optional=True)
            if value is not None:
                arguments[argument] = parser.parse_substitution(value)
        for argument, name in (('arguments', 'args'), ('ros_arguments', 'ros_args')):
            value = entity.get_attr(name, optional=True)
            if value is not None:
                arguments[argument] = cls.parse_cmdline(value, parser)
        arguments.update(cls.parse_options(entity, parser))
        arguments['parameters'] = [
            cls.parse_parameter(parameter, parser)
            for parameter in entity.get_attr('param', data_type=List[Entity], optional=True) or []]
        arguments['remappings'] = parser.parse_pairs(entity, 'remap', 'from', 'to')
        return cls, arguments

    @classmethod
    def parse_parameter(cls, entity: Entity, parser: Parser) -> ParameterFile | dict[Any, Any]:
        """Convert a `param` entity to a parameter file or to a dictionary of parameters."""
        path = entity.get_attr('from', optional=True)
        if path is not None:
            allow_substs = entity.get_attr('allow_substs', data_type=bool, optional=True)
            entity.assert_entity_completely_parsed()
            return ParameterFile(parser.parse_substitution(path),
                                 allow_substs=allow_substs or False)
        name = tuple(parser.parse_substitution(entity.get_attr('name')))
        nested = entity.get_attr('param', data_type=List[Entity], optional=True)
        value_type = entity.get_attr('type', optional=True)
        separator = entity.get_attr('value-sep', optional=True)
        has_value = 'value' in entity.names()
        entity.known_names.add('value')
        entity.assert_entity_completely_parsed()
        if has_value == (nested is not None):
            raise RuntimeError("'param' must have either the attribute 'value' or nested "
                               "'param' entities")
        if value_type is not None and value_type not in PARAMETER_TYPES:
            raise ValueError(f"Attribute 'type' of 'param' is '{value_type}', but must be "
                             f'{", ".join(PARAMETER_TYPES)}')
        if nested is not None:
            inner: dict[Any, Any] = {}
            for parameter in nested:
                inner.update(cls.parse_parameter(parameter, parser))  # type: ignore[arg-type]
            return {name: inner}
        data_type = PARAMETER_TYPES.get(value_type or '')
        return {name: cls.parse_value(entity, parser, data_type, separator)}

    @classmethod
    def parse_value(cls, entity: Entity, parser: Parser, data_type: Any,
                    separator: str | None) -> ParameterValue:
        """Convert the attribute `value` of a `param` entity to a parameter value."""
        given = value = entity.find_value('value')
        if entity.has_typed_values and '$(' not in str(value) and not is_instance_of(
                value, data_type):
            raise entity.wrong_type('value', value, data_type)
        if separator is not None:
            value = value.split(separator)
        item_type = get_args(data_type)[0] if get_args(data_type) else data_type
        try:
            if isinstance(value, list):
                value = [cls.parse_text(item, entity, parser, item_type) for item in value]
            else:
                value = cls.parse_text(value, entity, parser, data_type)
        except ValueError:
            raise entity.wrong_type('value', given, data_type) from None
        return ParameterValue(value, value_type=str if isinstance(value, str) else data_type)

    @classmethod
    def parse_text(cls, value: Any, entity: Entity, parser: Parser, data_type: Any) -> Any:
        """Convert text to substitutions or, if it contains none, to a type."""
        if not isinstance(value, str):
            return value
        parts: list[Substitution] = parser.parse_substitution(value)
        text = ''.join(part.text for part in parts if isinstance(part, TextSubstitution))
        if not all(isinstance(part, TextSubstitution) for part in parts):
            return parts
        return text if entity.has_typed_values else coerce_to_type(text, data_type)

    def execute(self, context: LaunchContext) -> None:
        """Add the ROS arguments to the command, and schedule the start of the process."""
        name, namespace = self._expand_names(context)
        words: list[str] = []
        if name is not None:
            words += ['-r', f'__node:={name}']
        if namespace is not None:
            words += ['-r', f'__ns:={namespace}']
        for parameter in context.launch_configurations.get('global_params', []):
            if isinstance(parameter, tuple):
                words += ['-p', f'{parameter[0]}:={parameter[1]}']
            else:
                words += ['--params-file', os.path.abspath(parameter)]
        for path in self._parameter_files(context, name, namespace):
            if os.path.isfile(path):
                words += ['--params-file', path]
            else:
                get_logger('launch_ros.actions.node').warning(
                    f'Parameter file path is not a file: {path}')
        for source, target in context.launch_configurations.get('ros_remaps', []):
            words += ['-r', f'{source}:={target}']
        for source, target in self.remappings:
            words += ['-r', f'{perform_substitutions(context, source)}:='
                            f'{perform_substitutions(context, target)}']
        self.cmd.extend(normalize_to_list_of_substitutions(word) for word in words)
        super().execute(context)

    def _expand_names(self, context: LaunchContext) -> tuple[str | None, str | None]:
        """Return the name and the namespace of the node if they are given."""
        name = namespace = None
        pushed = context.launch_configurations.get('ros_namespace')
        try:
            if self.node_name is not None:
                from rclpy.validate_node_name import validate_node_name  # This import is slow.

                name = perform_substitutions(context, self.node_name)
                validate_node_name(name)
            if self.node_namespace is not None:
                namespace = perform_substitutions(context, self.node_namespace)
            if self.node_namespace is not None or pushed is not None:
                namespace = prefix_namespace(pushed, namespace)
        except Exception:
            get_logger('launch_ros.actions.node').error(
                f"The name or namespace of the node '{self.node_executable}' of the package "
                f"'{self.node_package}' is not valid")
            raise
        return name, namespace

    def _parameter_files(self, context: LaunchContext, name: str | None,
                         namespace: str | None) -> list[str]:
        """Return the paths of all parameter files. Dictionaries are written to new files."""
        paths = []
        for parameters in self.parameters:
            if isinstance(parameters, Mapping):
                paths.append(self._write_parameters(context, parameters, name, namespace))
            elif isinstance(parameters, ParameterFile):
                paths.append(parameters.evaluate(context))
            else:
                paths.append(ParameterFile(parameters).evaluate(context))
        return paths

    def _write_parameters(self, context: LaunchContext, parameters: Mapping[Any, Any],
                          name: str | None, namespace: str | None) -> str:
        """Write a dictionary of parameters to a new file, and return its path."""
        node = f'{namespace.rstrip("/")}/{name}' if name and namespace else '/**'
        content = {node: {'ros__parameters': evaluate_parameter_dict(context, parameters)}}
        with NamedTemporaryFile('w', encoding='utf-8', prefix='launch_params_',
                                delete=False) as file:
            yaml.dump(content, file, default_flow_style=False)
        return file.name
