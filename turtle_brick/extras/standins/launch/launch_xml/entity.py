# SPDX-License-Identifier: Apache-2.0
"""The elements of XML launch files."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any
from xml.etree import ElementTree

from launch.frontend import Entity as BaseEntity


class Entity(BaseEntity):
    """An element of an XML launch file."""

    def __init__(self, xml_element: ElementTree.Element) -> None:
        super().__init__(xml_element.tag)
        self.xml_element = xml_element
        text = (xml_element.text or '').strip()
        if text and not xml_element.attrib and not len(xml_element):
            raise TypeError(f"'{self.type_name}' contains only the text '{text}', but must have "
                            'attributes or nested elements')

    @property
    def children(self) -> list[Entity]:
        self.known_names.update(element.tag for element in self.xml_element)
        return [Entity(element) for element in self.xml_element]

    def names(self) -> Collection[str]:
        return {*self.xml_element.attrib, *(element.tag for element in self.xml_element)}

    def find_value(self, name: str) -> Any:
        return self.xml_element.get(name)

    def find_entities(self, name: str) -> list[Entity] | None:
        return [Entity(element) for element in self.xml_element.findall(name)] or None
