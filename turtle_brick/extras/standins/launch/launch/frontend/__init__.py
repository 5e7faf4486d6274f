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
"""The stand-in for launch.frontend, launch_xml and launch_yaml, which read launch files."""

import inspect
from pathlib import Path
import re
import shlex
from xml.etree import ElementTree

from lark import Lark, Transformer
from launch import actions, extensions, LaunchDescription, substitutions
from launch.substitutions import (IfCondition, missing_name, perform, read_typed, Substitution,
                                  TextSubstitution, UnlessCondition)
import yaml

__getattr__ = missing_name('launch')
PARSER = Lark.open('grammar.lark', __file__, start='template')
TYPES = {each.__name__: each for each in (str, int, float, bool)}
TYPES.update({f'list_of_{name}': list[each] for name, each in TYPES.items()})
NAMES = yaml.safe_load(Path(__file__).with_name('names.yaml').read_text(encoding='utf-8'))
SUBSTITUTIONS = {name: getattr(substitutions, each)
                 for name, each in NAMES['substitutions'].items()}
ACTIONS = {name: getattr(actions, each) for name, each in NAMES['actions'].items()}
PYTHON, CALLED = NAMES['attributes'], NAMES['called']
XML = {name: attribute for attribute, name in PYTHON.items()}
KINDS = {name: TYPES[kind] for kind, names in NAMES['types'].items() for name in names}
COUNTS = {(0, 0): "doesn't expect arguments", (1, 1): 'expects 1 argument',
          (1, 2): 'expects 1 or 2 arguments', (2, 2): 'expects 2 arguments',
          (1, 3): 'expects from 2 or 3 arguments'}
NOT_IN_FILES = {'self', 'context', 'options', 'actions', 'choices', 'launch_arguments',
                'launch_configurations', 'additional_env', 'remappings', 'parameters'}


def arguments(function):
    """Return the arguments of a function that launch files can set, and the required ones."""
    found = {name: each for name, each in inspect.signature(function).parameters.items()
             if name not in NOT_IN_FILES}
    return list(found), [name for name, each in found.items() if each.default is each.empty]


def unescape(text):
    return re.sub(r'\\(.)', r'\1', text)


class ToSubstitutions(Transformer):
    """Converts syntax trees to substitutions."""

    def template(self, parts):
        return [part if isinstance(part, Substitution) else TextSubstitution(text=unescape(part))
                for part in parts]

    value = template

    def substitution(self, parts):
        name, *given = parts
        if name not in SUBSTITUTIONS:
            raise RuntimeError(f'Unknown substitution: {name}')
        if name in ('any', 'all'):
            return SUBSTITUTIONS[name](*given)
        names, needed = arguments(SUBSTITUTIONS[name].do)
        if not len(needed) <= len(given) <= len(names):
            raise TypeError(
                'find package substitutions expect 1 argument' if name.startswith('find-pkg') else
                f'{CALLED.get(name, name)} substitution {COUNTS[len(needed), len(names)]}')
        return SUBSTITUTIONS[name](**dict(zip(names, given)))


def substitute(text):
    """Convert a string from a launch file, such as '$(var name)', to a list of substitutions."""
    if '$(' not in text:
        return [TextSubstitution(text=unescape(text))]
    return ToSubstitutions().transform(PARSER.parse(text))


def split(text):
    """Split a command into words without splitting substitutions."""
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
    if text == 'shutdown':
        return [actions.Shutdown()]
    raise ValueError('Attribute on_exit of Entity node expected to be shutdown but got '
                     f'`{text}`Other on_exit actions not yet supported')


READERS = {  # functions that convert values with a special syntax, keyed by attribute name
    'arguments': split, 'ros_arguments': split, 'cmd': split, 'description': unescape,
    'on_exit': on_exit, **dict.fromkeys(('sigterm_timeout', 'sigkill_timeout'),
                                        lambda value: str(float(value)))}


def read(name, value):
    """Convert an attribute value to an action argument."""
    if name in READERS:
        return READERS[name](value)
    if isinstance(value, str) and (name not in KINDS or name == 'period'):
        return substitute(value)
    return read_typed(value, KINDS[name]) if isinstance(value, str) else value


def attributes(element, known, needed=()):
    """Return an element's attributes as a dictionary keyed by Python argument name."""
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
    for name, value in found.items():
        kind = KINDS.get(name, str)
        if not isinstance(value, (kind, str)):
            raise TypeError(f"Attribute '{XML.get(name, name)}' of Entity '{element.tag}' expected"
                            f" to be of type '{kind}', got '{type(value)}'")
    return {name: read(name, value) for name, value in found.items()}


def take(elements, tag, *names):
    """Remove all elements with a given tag from a list and return their attribute values."""
    taken = [[attributes(each, names, names)[name] for name in names] for each in elements
             if each.tag == tag]
    elements[:] = [each for each in elements if each.tag != tag]
    return taken


def take_all(elements):
    taken = [action(each) for each in elements]
    elements.clear()
    return taken


def take_pairs(elements, tag):
    """Remove all elements with a given tag from a list and return their values keyed by name."""
    return {tuple(name): value for name, value in take(elements, tag, 'name', 'value')}


NESTED = {  # functions that convert nested elements to action arguments (launch_ros adds more)
    'arg': lambda element, inner: {
        'name': unescape(element.attrib['name']),
        'choices': [perform(None, value) for value, in take(inner, 'choice', 'value')] or None},
    'executable': lambda element, inner: {'additional_env': take_pairs(inner, 'env')},
    'group': lambda element, inner: {'launch_configurations': take_pairs(inner, 'keep'),
                                     'actions': take_all(inner)},
    'include': lambda element, inner: {'launch_arguments': take(inner, 'arg', 'name', 'value')},
    'reset': lambda element, inner: {'launch_configurations': take_pairs(inner, 'keep')},
    'timer': lambda element, inner: {'actions': take_all(inner)}}


def action(element):
    """Convert an XML or YAML element to an action."""
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
    if element.tag in NESTED:
        options.update(NESTED[element.tag](element, inner))
    if inner:
        tags = {each.tag for each in inner}
        raise ValueError(f'Unexpected nested tag(s) found in `{element.tag}`: {tags}')
    return kind(**options)


def describe(root):
    """Convert the root element of a launch file to a launch description."""
    if root.tag != 'launch':
        raise RuntimeError("Expected 'launch' as root tag")
    for extension in extensions('launch.frontend.launch_extension').values():
        extension.load()
    return LaunchDescription([action(each) for each in root])


class InvalidFrontendLaunchFileError(Exception):
    """Raised when a file is not valid XML."""


def parse_xml(path):
    """Read a launch description from an XML file."""
    try:
        return describe(ElementTree.parse(path).getroot())
    except ElementTree.ParseError as error:
        raise InvalidFrontendLaunchFileError(
            'Caught multiple exceptions when trying to load file of format [xml]:\n'
            f' - ParseError: {error}') from None


class YAMLElement(ElementTree.Element):
    """An element whose attribute values keep their YAML types."""

    typed = True


def yaml_element(tag, content):
    """Convert YAML content to an element with a given tag."""
    element = YAMLElement(tag)
    content = content if isinstance(content, dict) else {'children': content or ()}
    for name, value in content.items():
        if name == 'children':
            element.extend(yaml_element(*item) for each in value for item in each.items())
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            element.extend(yaml_element(name, each) for each in value)
        else:
            element.attrib[name] = value
    return element


def parse_yaml(path):
    """Read a launch description from a YAML file."""
    with open(path, encoding='utf-8') as file:
        (root,) = yaml.safe_load(file).items()
    return describe(yaml_element(*root))
