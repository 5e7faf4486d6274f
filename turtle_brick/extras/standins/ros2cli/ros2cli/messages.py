# SPDX-License-Identifier: Apache-2.0
"""The conversion of messages from and to YAML."""

from __future__ import annotations

import argparse
from array import array
from importlib import import_module
import re
import sys
from typing import Any

import numpy
import yaml

Stamps = list[tuple[Any, str]]
"""Messages and names of their time fields that are set when a message is published."""


def get_interface(name: str, kind: str, problem: str) -> Any:
    """
    Return the Python class of a ROS type. `std_msgs/String` means `std_msgs/msg/String`.

    :param kind: msg, srv or action
    :param problem: message of the error
    :raises RuntimeError: if there is no such type
    """
    try:
        package, *middle, own_name = name.split('/')
        interface = getattr(import_module('.'.join([package, *(middle or [kind])])), own_name)
    except (AttributeError, ImportError, TypeError, ValueError):
        raise RuntimeError(problem) from None
    if kind == 'msg' and not hasattr(interface, 'SLOT_TYPES'):
        raise RuntimeError(problem)
    return interface


def read_values(args: argparse.Namespace) -> Any:
    """Return the values from the command line or from stdin."""
    return yaml.safe_load(sys.stdin.read() if args.stdin else args.values)


def make_message(message_class: Any, values: Any, stamps: Stamps | None = None) -> Any:
    """
    Return a message with the given field values.

    :param stamps: list to which time fields with the value 'now' or 'auto' are added
    :raises RuntimeError: if a value does not fit
    """
    message = message_class()
    try:
        _set_fields(message, values, stamps)
    except Exception as error:  # noqa: B902 -- a message can raise any exception
        raise RuntimeError(f'Failed to populate field: {error}') from None
    return message


def _set_fields(message: Any, values: Any, stamps: Stamps | None) -> None:
    if not isinstance(values, dict):
        raise TypeError(f"Value '{values}' is expected to be a dictionary but is a "
                        f'{type(values).__name__}')
    for name, value in values.items():
        field = getattr(message, name)
        item_type = re.search(r'\w+/\w+', message.get_fields_and_field_types()[name])
        if stamps is not None and type(field).__name__ == 'Header' and value == 'auto':
            stamps.append((field, 'stamp'))
        elif stamps is not None and type(field).__name__ == 'Time' and value == 'now':
            stamps.append((message, name))
        elif hasattr(field, 'SLOT_TYPES'):
            _set_fields(field, value, stamps)
        elif isinstance(field, array):
            setattr(message, name, array(field.typecode, value))
        elif isinstance(field, numpy.ndarray):
            setattr(message, name, numpy.array(value, dtype=field.dtype))
        elif item_type:
            item_class = get_interface(item_type[0], 'msg', item_type[0])
            items = []
            for item_values in value:
                items.append(item_class())
                _set_fields(items[-1], item_values, stamps)
            setattr(message, name, items)
        else:
            setattr(message, name, type(field)(value))


class Fields(dict[str, Any]):
    """Message fields, which yaml.dump() writes in block style and in their original order."""


def _represent_fields(dumper: yaml.Dumper, fields: Fields) -> yaml.Node:
    return dumper.represent_mapping('tag:yaml.org,2002:map', fields.items(), flow_style=False)


yaml.add_representer(Fields, _represent_fields)


def to_yaml(value: Any, length: int = sys.maxsize, no_arrays: bool = False,
            field_type: str | None = None) -> Any:
    """
    Convert a message or a field to objects for yaml.dump().

    :param length: number of characters or items after which a value is shortened
    :param no_arrays: whether the type of an array replaces its items
    :param field_type: ROS type of the field
    """
    if hasattr(value, 'SLOT_TYPES'):
        return Fields((name, to_yaml(getattr(value, name), length, no_arrays, field_type))
                      for name, field_type in value.get_fields_and_field_types().items())
    if isinstance(value, bytes):
        value = value.decode('latin-1')
    if isinstance(value, str):
        return value if len(value) <= length else f'{value[:length]}...'
    if hasattr(value, 'tolist'):
        value = value.tolist()
    if not isinstance(value, list):
        return value
    if no_arrays and field_type:
        return _describe_array(field_type, len(value))
    items = [to_yaml(item, length, no_arrays) for item in value[:length]]
    return items if len(value) <= length else [*items, '...']


def _describe_array(field_type: str, length: int) -> str:
    """Return the text that replaces the items of an array."""
    item, _, bound = field_type.replace('/', '/msg/').rstrip('>').partition(', ')
    if '<' not in item:
        return f'<array type: {item}>'
    bound = f'[{bound}]' if bound else ''
    return f'<{item.replace("<", " type: ")}{bound}, length: {length}>'


def to_csv(value: Any) -> str:
    """Convert the result of to_yaml() to a string of comma-separated values."""
    if isinstance(value, dict):
        return ','.join(map(to_csv, value.values()))
    if isinstance(value, list):
        return ','.join(map(to_csv, value))
    return str(value)
