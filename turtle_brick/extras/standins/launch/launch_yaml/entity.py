# SPDX-License-Identifier: Apache-2.0
"""The elements of YAML launch files."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from launch.frontend import Entity as BaseEntity


class Entity(BaseEntity):
    """An element of a YAML launch file: a dictionary of attributes, or a list of entities."""

    has_typed_values = True

    def __init__(self, element: Any, type_name: str) -> None:
        super().__init__(type_name)
        self.element = {} if element is None else element
        if not isinstance(self.element, (dict, list)):
            raise TypeError(f"'{type_name}' contains only {element!r}, but must have attributes "
                            'or nested entities')

    @property
    def children(self) -> list[Entity]:
        self.known_names.add('children')
        items = self.element
        if isinstance(items, dict):
            items = items.get('children')
        if not isinstance(items, list):
            raise ValueError(f"'{self.type_name}' must contain a list of entities, or have the "
                             "attribute 'children' with such a list. Is there a dash in front of "
                             'each entity?')
        for item in items:
            if not isinstance(item, dict) or len(item) != 1:
                raise ValueError(f"An entity in '{self.type_name}' must consist of one name and "
                                 f'its attributes, but is {item}. Are the attributes indented '
                                 'further than the name?')
        return [Entity(content, name) for item in items for name, content in item.items()]

    def names(self) -> Collection[str]:
        return self.element if isinstance(self.element, dict) else ()

    def find_value(self, name: str) -> Any:
        return self.element.get(name) if isinstance(self.element, dict) else None

    def find_entities(self, name: str) -> list[Entity] | None:
        items = self.find_value(name)
        if items is None:
            return None
        if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
            raise TypeError(f"Attribute '{name}' of '{self.type_name}' is {items!r}, but must be "
                            'a list of dictionaries')
        return [Entity(item, name) for item in items]
