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
"""The stand-in for launch_xml 3.4.3, which reads launch files in XML."""

import inspect
from pathlib import Path
import re
import shlex
from xml.etree import ElementTree

from lark import Lark, Transformer
from launch import actions, LaunchDescription, substitutions
from launch.substitutions import (IfCondition, perform, read_typed, Substitution,
                                  TextSubstitution, UnlessCondition)
import launch_ros

PARSER = Lark(Path(__file__).with_name('grammar.lark').read_text(), start='template')
SUBSTITUTIONS = {
    'anon': substitutions.AnonName, 'var': substitutions.LaunchConfiguration,
    'env': substitutions.EnvironmentVariable,
    'find-exec': substitutions.FindExecutable, 'dirname': substitutions.ThisLaunchFileDir,
    'filename': substitutions.ThisLaunchFile, 'eval': substitutions.PythonExpression,
    'command': substitutions.Command, 'equals': substitutions.EqualsSubstitution,
    'not-equals': substitutions.NotEqualsSubstitution, 'not': substitutions.NotSubstitution,
    'and': substitutions.AndSubstitution, 'or': substitutions.OrSubstitution,
    'find-pkg-share': launch_ros.FindPackageShare, 'exec-in-pkg': launch_ros.ExecutableInPackage,
    'find-pkg-prefix': launch_ros.FindPackagePrefix}
ACTIONS = {
    'let': actions.SetLaunchConfiguration, 'set_env': actions.SetEnvironmentVariable,
    'unset_env': actions.UnsetEnvironmentVariable, 'append_env': actions.AppendEnvironmentVariable,
    'log': actions.LogInfo, 'shutdown': actions.Shutdown, 'arg': actions.DeclareLaunchArgument,
    'include': actions.IncludeLaunchDescription, 'group': actions.GroupAction,
    'timer': actions.TimerAction, 'executable': actions.ExecuteProcess, 'node': launch_ros.Node,
    'push_ros_namespace': launch_ros.PushROSNamespace,
    'push-ros-namespace': launch_ros.PushROSNamespace, 'set_remap': launch_ros.SetRemap,
    'set_parameter': launch_ros.SetParameter,
    'set_parameters_from_file': launch_ros.SetParametersFromFile}
PYTHON = {  # Python names of attributes whose XML names differ
    'default': 'default_value', 'message': 'msg', 'file': 'launch_description_source',
    'pkg': 'package', 'exec': 'executable', 'args': 'arguments', 'ros_args': 'ros_arguments',
    'launch-prefix': 'prefix', 'from': 'src', 'to': 'dst'}
XML = {name: attribute for attribute, name in PYTHON.items()}
COUNTS = {(0, 0): "doesn't expect arguments", (1, 1): 'expects 1 argument',
          (1, 2): 'expects 1 or 2 arguments', (2, 2): 'expects 2 arguments'}
CALLED = {'equals': 'and', 'not-equals': 'and', 'or': 'and', 'exec-in-pkg': 'exec-in-package'}
NOT_IN_FILES = {'self', 'context', 'options', 'actions', 'choices', 'launch_arguments',
                'launch_configurations', 'additional_env', 'remappings', 'parameters'}


def arguments(function):
    """Return the function arguments that XML attributes can set, and the required arguments."""
    found = {name: each for name, each in inspect.signature(function).parameters.items()
             if name not in NOT_IN_FILES}
    return list(found), [name for name, each in found.items() if each.default is each.empty]


class InvalidFrontendLaunchFileError(Exception):
    """A file is not XML."""


def unescape(text):
    """Remove the backslashes from escape sequences."""
    return re.sub(r'\\(.)', r'\1', text)


class ToSubstitutions(Transformer):
    """Converts syntax trees to substitutions."""

    def template(self, parts):
        return [part if isinstance(part, Substitution) else TextSubstitution(text=unescape(part))
                for part in parts]

    value = template

    def substitution(self, parts):
        name, *given = parts
        if name in ('any', 'all'):  # The real parser fails in the same way.
            raise TypeError(f'{name.title()}Substitution.__init__() got an unexpected keyword '
                            "argument 'args'")
        if name not in SUBSTITUTIONS:
            raise RuntimeError(f'Unknown substitution: {name}')
        names, needed = arguments(SUBSTITUTIONS[name].do)
        if not len(needed) <= len(given) <= len(names):
            raise TypeError(
                'find package substitutions expect 1 argument' if name.startswith('find-pkg') else
                f'{CALLED.get(name, name)} substitution {COUNTS[len(needed), len(names)]}')
        return SUBSTITUTIONS[name](**dict(zip(names, given)))


def substitute(text):
    """Convert a string to a list of substitutions."""
    if '$(' not in text:
        return [TextSubstitution(text=unescape(text))]
    return ToSubstitutions().transform(PARSER.parse(text))


def split(text):
    """Split a command into words at the spaces outside substitutions."""
    words, word = [], []
    for part in substitute(text):
        if not isinstance(part, TextSubstitution):
            word.append(part)
            continue
        tokens = [[TextSubstitution(text=each)] for each in shlex.split(part.text)] or [[]]
        if part.text[:1].isspace() and tokens[0] and word:
            words.append(word)
            word = []
        words += [[*word, *tokens[0]], *tokens[1:]]
        word = [] if part.text[-1:].isspace() or not tokens[0] else words.pop()
    return [*words, *([word] if word else [])]


def on_exit(text):
    """Return the actions for an `on_exit` attribute."""
    if text == 'shutdown':
        return [actions.Shutdown()]
    raise ValueError('Attribute on_exit of Entity node expected to be shutdown but got '
                     f'`{text}`Other on_exit actions not yet supported')


READERS = {  # functions that read attributes without substitutions
    'arguments': split, 'ros_arguments': split, 'cmd': split, 'description': unescape,
    'respawn_max_retries': int, 'respawn_delay': float,
    'on_exit': on_exit,
    **dict.fromkeys(('sigterm_timeout', 'sigkill_timeout'), lambda text: str(float(text))),
    **dict.fromkeys(('shell', 'emulate_tty', 'scoped', 'forwarding', 'prepend'),
                    lambda text: read_typed(text, bool))}
TYPES = {each.__name__: each for each in (str, int, float, bool)}
TYPES.update({f'list_of_{name}': list[each] for name, each in TYPES.items()})


def attributes(element, known, needed=()):
    """Return an element's attributes as a dictionary keyed by Python name."""
    found = {PYTHON.get(name, name): text for name, text in element.attrib.items()}
    for name in needed:
        if name not in found:
            raise AttributeError(
                f"Attribute '{XML.get(name, name)}' of type '{float if name == 'period' else str}'"
                f" not found in Entity '{element.tag}'")
    unknown = {name for name in element.attrib
               if PYTHON.get(name, name) not in known or name in PYTHON.values()}
    if unknown:
        raise ValueError(f'Unexpected attribute(s) found in `{element.tag}`: {unknown}')
    return {name: READERS.get(name, substitute)(text) for name, text in found.items()}


def parameter(element):
    """Return a node parameter as a dictionary, or the path of a parameter file."""
    if 'from' in element.attrib:
        return attributes(element, ['src'])['src']
    if 'name' not in element.attrib:
        raise ValueError('param Entity should have name or from attribute')
    if ('value' in element.attrib) == bool(len(element)):
        raise RuntimeError('nested parameters and value attributes are mutually exclusive'
                           if len(element) else
                           'either a value attribute or nested params are needed')
    if element.get('type', 'str') not in TYPES:
        raise ValueError(f"Got invalid type identifier '{element.attrib['type']}'")
    given = {**attributes(element, ['name', 'value', 'type', 'value-sep']), **element.attrib}
    name = tuple(substitute(given['name']))
    text, separator = given.get('value'), given.get('value-sep')
    if text is None:
        return {name: {key: value for each in element for key, value in parameter(each).items()}}
    kind = TYPES[given['type']] if 'type' in given else None
    values = [substitute(each) for each in (text.split(separator) if separator else [text])]
    try:
        scalar = getattr(kind, '__args__', [kind])[0] if separator else kind
        values = [value if any(not isinstance(each, TextSubstitution) for each in value)
                  else read_typed(perform(None, value), scalar) for value in values]
    except ValueError:
        raise TypeError(f"Attribute 'value' of Entity 'param' expected to be of type '{kind}'."
                        f"'{text}' can not be converted to one of those types") from None
    value = values if separator else values[0]
    return {name: launch_ros.ParameterValue(
        value, value_type=str if isinstance(value, str) else kind)}


def take(elements, tag, *names):
    """Remove all elements with a given tag, and return the named attributes of each element."""
    taken = [[attributes(each, names, names)[name] for name in names] for each in elements
             if each.tag == tag]
    elements[:] = [each for each in elements if each.tag != tag]
    return taken


def nested_options(element, inner):
    """Remove the nested elements that an action supports, and return them as its arguments."""
    if element.tag == 'arg':
        choices = [perform(None, value) for value, in take(inner, 'choice', 'value')]
        return {'name': unescape(element.attrib['name']), 'choices': choices or None}
    if element.tag == 'include':
        return {'launch_arguments': take(inner, 'arg', 'name', 'value')}
    options = {}
    if element.tag == 'group':
        options['launch_configurations'] = {
            tuple(name): value for name, value in take(inner, 'keep', 'name', 'value')}
    if element.tag in ('executable', 'node'):
        options['additional_env'] = {
            tuple(name): value for name, value in take(inner, 'env', 'name', 'value')}
    if element.tag == 'node':
        options['remappings'] = take(inner, 'remap', 'src', 'dst')
        options['parameters'] = [parameter(each) for each in inner if each.tag == 'param']
        inner[:] = [each for each in inner if each.tag != 'param']
    if element.tag in ('group', 'timer'):
        options['actions'] = [action(each) for each in inner]
        inner.clear()
    return options


def action(element):
    """Convert an XML element to an action."""
    if element.tag not in ACTIONS:
        raise RuntimeError(f'Unrecognized entity of the type: {element.tag}')
    kind, options, inner = ACTIONS[element.tag], {}, list(element)
    for name, condition in (('if', IfCondition), ('unless', UnlessCondition)):
        if name in element.attrib:
            options['condition'] = condition(substitute(element.attrib.pop(name)))
    known, needed = arguments(kind.do)
    if element.tag == 'node':
        more, needed = arguments(kind.__init__)
        known += more
    options.update(attributes(element, known, needed))
    options.update(nested_options(element, inner))
    if inner:
        tags = {each.tag for each in inner}
        raise ValueError(f'Unexpected nested tag(s) found in `{element.tag}`: {tags}')
    return kind(**options)


def parse(path):
    """Read a launch description from an XML file."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise InvalidFrontendLaunchFileError(
            'Caught multiple exceptions when trying to load file of format [xml]:\n'
            f' - ParseError: {error}') from None
    if root.tag != 'launch':
        raise RuntimeError("Expected 'launch' as root tag")
    return LaunchDescription([action(each) for each in root])
