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
Read XML following the rules of tinyxml2, the XML parser that urdfdom uses.

Unlike Python's parser, tinyxml2 keeps line breaks and tabs in attributes, accepts undeclared
namespace prefixes, and does not expand entities that the document defines.
"""

from html import unescape
import re
from xml.etree.ElementTree import Element, SubElement

NAME = r'[A-Za-z_:\x80-\U0010ffff][\w.:\x80-\U0010ffff-]*(?![\w.:\x80-\U0010ffff-])'
ATTRIBUTE = re.compile(rf"""\s*({NAME})\s*=\s*(?:"([^"]*)"|'([^']*)')""", re.ASCII)
NODE = re.compile(rf"""\s*(?:
    (?P<declaration><\?.*?\?>) | <!--.*?--> | <!\[CDATA\[.*?\]\]> | <!(?!--|\[CDATA\[)[^>]*>
    | <\s*(?P<end>/)?(?P<name>{NAME})(?P<attributes>(?:{ATTRIBUTE.pattern})*)\s*
      (?(end)|(?P<empty>/)?)>
    | [^<\s][^<]*(?=<)
    )""", re.ASCII | re.DOTALL | re.VERBOSE)
"""Matches an XML declaration, comment, CDATA section, document type, tag, or text before a tag."""

REFERENCE = re.compile(r'&(#\d{1,6}|#x[\da-fA-F]{1,5}|quot|amp|apos|lt|gt);')


def parse_xml(text: str) -> Element:
    """Return an element that contains the top-level elements in an XML document."""
    text, position, may_declare = text.strip().removeprefix('\ufeff'), 0, True
    open_elements = [Element('document')]
    while position < len(text):
        node, element = NODE.match(text, position), open_elements[-1]
        if node is None or node['declaration'] and not may_declare:
            raise ValueError(f'invalid XML in <{element.tag}>: {text[position:position + 60]!r}')
        position = node.end()
        may_declare = may_declare and node['declaration'] is not None
        if node['end']:
            if len(open_elements) == 1:
                break  # tinyxml2 ignores everything after an unexpected end tag.
            if open_elements.pop().tag != node['name']:
                raise ValueError(f'invalid XML: <{element.tag}> ends with </{node["name"]}>')
        elif node['name']:
            pairs = [(name, REFERENCE.sub(lambda found: unescape(found[0]), one or two))
                     for name, one, two in ATTRIBUTE.findall(node['attributes'])]
            if len(dict(pairs)) < len(pairs):
                raise ValueError(f'invalid XML: <{node["name"]}> repeats an attribute')
            element = SubElement(element, node['name'], dict(pairs))
            if not node['empty']:
                open_elements.append(element)
    if len(open_elements) > 1:
        raise ValueError(f'invalid XML: <{open_elements[-1].tag}> has no end tag')
    return open_elements[0]
