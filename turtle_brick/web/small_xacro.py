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

"""
Expand urdf/turtle.urdf.xacro where xacro is not available.

Only the features in this file are supported: properties, macros, blocks and expressions. A test
compares the result with xacro.
"""

from collections.abc import Iterator, Mapping
import json
import math
import re
from types import SimpleNamespace
from typing import Any
from xml.etree.ElementTree import Element, fromstring, tostring

PREFIX = '{http://www.ros.org/wiki/xacro}'
"""Namespace of the xacro tags."""


def expand(text: str, parameters: Mapping[str, Any]) -> str:
    """
    Return the URDF for a xacro file.

    :param text: content of the xacro file
    :param parameters: values for config/turtle.yaml
    """
    root = fromstring(text)
    robot = Element(root.tag, root.attrib)
    xacro = SimpleNamespace(
        arg=str, load_yaml=lambda path: {'/**': {'ros__parameters': parameters}})
    robot.extend(list(_expand_children(root, {'math': math, 'xacro': xacro}, {})))
    return tostring(robot, encoding='unicode')


def _expand_children(parent: Element, scope: dict[str, Any], macros: dict[str, Element]
                     ) -> Iterator[Element]:
    """Yield the elements for the children of an element."""
    for child in parent:
        name = child.tag.removeprefix(PREFIX)
        if name == child.tag:
            element = Element(name, {key: str(_evaluate(value, scope))
                                     for key, value in child.items()})
            element.extend(list(_expand_children(child, scope, macros)))
            yield element
        elif name == 'property':
            scope[child.attrib['name']] = _evaluate(child.attrib['value'], scope)
        elif name == 'macro':
            macros[child.attrib['name']] = child
        elif name == 'insert_block':
            yield from scope['*' + child.attrib['name']]
        elif name != 'arg':
            macro, arguments = macros[name], {}
            for key, default in re.findall(r"(\*?\w+)(?::='(.*?)')?", macro.attrib['params']):
                arguments[key] = (list(_expand_children(child, scope, macros)) if key[0] == '*'
                                  else _evaluate(child.get(key, default), scope))
            yield from _expand_children(macro, {**scope, **arguments}, macros)


def _evaluate(text: str, scope: dict[str, Any]) -> Any:
    """Return the value of a text with expressions, which is a number if possible."""
    if whole := re.fullmatch(r'\${([^{}]*)}', text):
        return eval(whole[1], scope)
    value = re.sub(r'\${(.*?)}', lambda match: str(eval(match[1], scope)), text)
    return json.loads(value) if re.fullmatch(r'-?\d+(\.\d+)?', value) else value
