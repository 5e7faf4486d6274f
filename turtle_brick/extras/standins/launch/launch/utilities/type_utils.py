# SPDX-License-Identifier: Apache-2.0
"""The conversion of text to the types of attributes and parameters."""

from __future__ import annotations

from textwrap import shorten
from typing import Any, get_args

from launch.launch_context import LaunchContext
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
import yaml

SCALAR_TYPES = (str, int, float, bool)


def type_name(data_type: Any) -> str:
    """Return the name of a type, such as `bool` or `list[int]`, or of all types for None."""
    if data_type is None:
        return 'a number, a truth value, text or a list of one of these types'
    return data_type.__name__ if data_type in SCALAR_TYPES else str(data_type)


def is_instance_of(value: Any, data_type: Any = None) -> bool:
    """Return whether a value has a type such as bool or list[int] (by default, any of these)."""
    items = value if isinstance(value, list) else [value]
    if len({type(item) for item in items}) > 1:
        return False
    if data_type is None:
        return all(isinstance(item, SCALAR_TYPES) for item in items)
    item_types = get_args(data_type)
    if item_types:
        return isinstance(value, list) and all(isinstance(item, item_types) for item in items)
    return isinstance(value, data_type)


def coerce_to_type(text: str, data_type: Any = None) -> Any:
    """
    Convert text to a type such as bool or list[int] (by default, to its YAML type).

    :raises ValueError: if the text cannot be converted
    """
    if data_type in (str, int, float):
        return data_type(text)
    if data_type is bool and text in ('0', '1'):
        return text == '1'
    try:
        value = yaml.safe_load(text) if text else text
    except yaml.YAMLError as error:
        raise ValueError(f"'{shorten(text, 60)}' is not valid YAML\n{error}") from None
    if not is_instance_of(value, data_type):
        raise ValueError(f"'{shorten(text, 60)}' is not {type_name(data_type)}")
    return value


def perform_typed_substitution(context: LaunchContext, value: Any, data_type: Any) -> Any:
    """Return a value of a type, or convert text with substitutions to the type."""
    if is_instance_of(value, data_type):
        return value
    text = perform_substitutions(context, normalize_to_list_of_substitutions(value))
    return coerce_to_type(text, data_type)
