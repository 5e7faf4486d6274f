# SPDX-License-Identifier: Apache-2.0
"""The base class of the elements of XML and YAML launch files."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, List

from launch.utilities.type_utils import coerce_to_type, is_instance_of, type_name


class Entity:
    """
    An element of a launch file, which describes an action.

    An entity records the names that an action asks for. Any other name is a mistake.
    """

    has_typed_values = False
    """Whether the values of attributes have types, as in YAML. Otherwise, they are text."""

    def __init__(self, type_name: str) -> None:
        self.type_name = type_name
        self.known_names: set[str] = set()

    @property
    def children(self) -> list[Any]:
        """Return the nested entities."""
        raise NotImplementedError

    def names(self) -> Collection[str]:
        """Return the names of all attributes and nested entities."""
        raise NotImplementedError

    def find_value(self, name: str) -> Any:
        """Return the value of an attribute, or None if there is no such attribute."""
        raise NotImplementedError

    def find_entities(self, name: str) -> list[Any] | None:
        """Return the nested entities with a name, or None if there are none."""
        raise NotImplementedError

    def get_attr(self, name: str, *, data_type: Any = str, optional: bool = False,
                 can_be_str: bool = False) -> Any:
        """
        Return the value of an attribute, or a list of nested entities.

        :param data_type: type of the value, or List[Entity]
        :param optional: whether None is returned if the attribute is missing
        :param can_be_str: whether text with substitutions is also accepted
        :raises AttributeError: if a required attribute is missing
        :raises TypeError: if the value does not have the type
        """
        self.known_names.add(name)
        is_nested = data_type in (List[Entity], list[Entity])
        value = self.find_entities(name) if is_nested else self.find_value(name)
        if value is None:
            if optional:
                return None
            raise AttributeError(f"'{self.type_name}' requires the attribute '{name}'")
        if is_nested or is_instance_of(value, data_type):
            return value
        if isinstance(value, str):
            if can_be_str and '$(' in value:
                return value
            try:
                return coerce_to_type(value, data_type)
            except ValueError:
                pass
        raise self.wrong_type(name, value, data_type)

    def wrong_type(self, name: str, value: Any, data_type: Any) -> TypeError:
        """Return the error for an attribute whose value does not have a type."""
        return TypeError(f"Attribute '{name}' of '{self.type_name}' is {value!r} of type "
                         f'{type(value).__name__}, but must be {type_name(data_type)}')

    def assert_entity_completely_parsed(self) -> None:
        """
        Check that the action has asked for all attributes and nested entities.

        :raises ValueError: if the entity has other attributes or nested entities
        """
        unknown = sorted(set(self.names()) - self.known_names)
        if unknown:
            raise ValueError(
                f"'{self.type_name}' does not support {', '.join(map(repr, unknown))}. The "
                f'stand-in for launch supports {", ".join(sorted(self.known_names))}')
