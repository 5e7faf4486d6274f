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
                'launch_configurations', 'env', 'additional_env', 'remappings', 'parameters'}


def arguments(function):
    """Return the arguments of a function that launch files can set, and the required ones."""
    found = {name: each for name, each in inspect.signature(function).parameters.items()
             if name not in NOT_IN_FILES}
    return list(found), [name for name, each in found.items() if each.default is each.empty]


def supported(names):
    return f'The stand-in for launch supports {", ".join(sorted(names))}'


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
            raise RuntimeError(f'Unknown substitution: {name}. {supported(SUBSTITUTIONS)}')
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
    'on_exit': on_exit}


def read(element, name):
    """Convert an attribute value to an action argument."""
    value, kind, argument = element.attrib[name], KINDS.get(name, str), PYTHON.get(name, name)
    wrong = f"Attribute '{name}' of Entity '{element.tag}' expected to be of type '{kind}'"
    if not isinstance(value, (kind, str)):
        raise TypeError(f"{wrong}, got '{type(value)}'")
    if argument in READERS:
        return READERS[argument](value)
    if not isinstance(value, str):
        return value
    if kind is str or name in NAMES['substituted'] and '$(' in value:
        return substitute(value)
    try:
        return read_typed(value, kind)
    except ValueError:
        raise TypeError(f"{wrong}.'{value}' can not be converted to one of those types") from None


def attributes(element, known, needed=()):
    """Return an element's attributes as a dictionary keyed by Python argument name."""
    names = {name: PYTHON.get(name, name) for name in element.attrib}
    for name in needed:
        if XML.get(name, name) not in names:
            raise AttributeError(
                f"Attribute '{XML.get(name, name)}' of type '{KINDS.get(name, str)}' not found in "
                f"Entity '{element.tag}'")
    unknown = {name for name in names if names[name] not in known or name in XML}
    if unknown:
        raise ValueError(f'Unexpected attribute(s) found in `{element.tag}`: {unknown}. '
                         f'{supported(XML.get(name, name) for name in known)}')
    return {names[name]: read(element, name) for name in names}


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
    'include': lambda element, inner: {'launch_arguments': [
        *take(inner, 'arg', 'name', 'value'), *take(inner, 'let', 'name', 'value')]},
    'reset': lambda element, inner: {'launch_configurations': take_pairs(inner, 'keep')},
    'timer': lambda element, inner: {'actions': take_all(inner)}}


def action(element):
    """Convert an XML or YAML element to an action."""
    if element.tag not in ACTIONS:
        raise RuntimeError(
            f'Unrecognized entity of the type: {element.tag}. {supported(ACTIONS)}')
    check_text(element)
    kind, options, inner = ACTIONS[element.tag], {}, list(element)
    known, needed = arguments(kind.do)
    if element.tag == 'node':
        more, needed = arguments(kind.__init__)
        known = {*known, *more} - {'cmd'}
    options.update(attributes(element, {*known, 'if', 'unless'}, needed))
    if 'if' in options and 'unless' in options:
        raise RuntimeError("if and unless conditions can't be used simultaneously")
    for name, condition in (('if', IfCondition), ('unless', UnlessCondition)):
        if name in options:
            options['condition'] = condition(options.pop(name))
    if element.tag in NESTED:
        options.update(NESTED[element.tag](element, inner))
    if inner:
        tags = {each.tag for each in inner}
        raise ValueError(f'Unexpected nested tag(s) found in `{element.tag}`: {tags}')
    return kind(**options)


def check_text(element):
    """Raise a TypeError if an element contains only text."""
    text = str(element.text or '').strip()
    if text and not (element.attrib or len(element)):
        raise TypeError(f"Entity '{element.tag}' expected to have attributes or nested entities, "
                        f"got '{text}'")


def describe(root):
    """Convert the root element of a launch file to a launch description."""
    if root.tag != 'launch':
        raise RuntimeError("Expected 'launch' as root tag")
    check_text(root)
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
    if tag in NAMES['with_children']:
        content = {'children': content} if isinstance(content, list) else content
        if not isinstance(content, dict) or not isinstance(content.get('children'), list):
            raise ValueError(
                f'Expected entity `{tag}` to have children entities. That can be a list of '
                'subentities or a dictionary with a `children` list element. Did you forget a '
                'dash before an entity?')
        element.extend([yaml_element(*subentity(tag, each))
                        for each in content.pop('children')])
    for name, value in content.items() if isinstance(content, dict) else ():
        if isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
            element.extend([yaml_element(name, each) for each in value])
        elif name in NAMES['lists']:
            raise TypeError(f"Attribute '{name}' of Entity '{tag}' expected to be a list of "
                            f"dictionaries, got '{value}'")
        else:
            element.attrib[name] = value
    if not isinstance(content, dict):
        element.text = content
    return element


def subentity(tag, item):
    """Return the type and the content of an entity in the list of an entity with a given tag."""
    if not isinstance(item, dict) or len(item) != 1:
        raise RuntimeError('Subentities must be a dictionary with only one key, which is the '
                           f"entity type, but `{tag}` contains '{item}'. Are the attributes "
                           'indented further than the entity type?')
    return next(iter(item.items()))


def parse_yaml(path):
    """Read a launch description from a YAML file."""
    with open(path, encoding='utf-8') as file:
        tree = yaml.safe_load(file)
    if not isinstance(tree, dict) or len(tree) != 1:
        raise RuntimeError("Expected only one root, which is 'launch'")
    return describe(yaml_element(*next(iter(tree.items()))))
