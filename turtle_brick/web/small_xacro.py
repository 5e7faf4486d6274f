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

Only properties, macros, blocks and expressions are supported.
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
    """Return the URDF for the content of a xacro file and the values in config/turtle.yaml."""
    xacro = SimpleNamespace(
        arg=str, load_yaml=lambda path: {'/**': {'ros__parameters': parameters}})
    robot = fromstring(text)
    robot[:] = list(_expand_children(robot, {'math': math, 'xacro': xacro}))
    return tostring(robot, encoding='unicode')


def _expand_children(parent: Element, scope: dict[str, Any]) -> Iterator[Element]:
    """Yield the expanded children of an element, and add its properties to the scope."""
    for child in parent:
        attributes = {key: _evaluate(value, scope) for key, value in child.items()}
        name = attributes.get('name', '')
        if not child.tag.startswith(PREFIX):
            element = Element(child.tag, {key: str(value) for key, value in attributes.items()})
            element.extend(list(_expand_children(child, scope)))
            yield element
        elif child.tag == f'{PREFIX}property':
            scope[name] = attributes['value']
        elif child.tag == f'{PREFIX}macro':
            scope[f'{PREFIX}{name}'] = child
        elif child.tag == f'{PREFIX}insert_block':
            yield from scope[f'*{name}']
        elif child.tag in scope:
            macro, arguments = scope[child.tag], {}
            for key, default in re.findall(r"(\*?\w+)(?::='(.*?)')?", macro.attrib['params']):
                arguments[key] = (list(_expand_children(child, scope)) if key[0] == '*'
                                  else attributes.get(key, default))
            yield from _expand_children(macro, {**scope, **arguments})


def _evaluate(text: str, scope: dict[str, Any]) -> Any:
    """Evaluate the expressions in a text, and return a number if possible."""
    if whole := re.fullmatch(r'\${([^{}]*)}', text):
        return eval(whole[1], scope)
    value = re.sub(r'\${(.*?)}', lambda match: str(eval(match[1], scope)), text)
    return json.loads(value) if re.fullmatch(r'-?\d+(\.\d+)?', value) else value
