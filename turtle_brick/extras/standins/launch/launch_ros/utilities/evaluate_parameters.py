# SPDX-License-Identifier: Apache-2.0
"""The evaluation of parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from launch.launch_context import LaunchContext
from launch.substitution import Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import coerce_to_type
from launch_ros.parameter_descriptions import ParameterValue

ITEM_TYPES = ({bool}, {int}, {float}, {str})
"""Types that all items of a list may have."""


def evaluate_parameter_dict(context: LaunchContext, parameters: Mapping[Any, Any],
                            prefix: str = '') -> dict[str, Any]:
    """Return nested parameters as a flat dictionary keyed by full parameter name."""
    flat: dict[str, Any] = {}
    for key, value in parameters.items():
        name = prefix + perform_substitutions(context, normalize_to_list_of_substitutions(key))
        if isinstance(value, Mapping):
            flat.update(evaluate_parameter_dict(context, value, f'{name}.'))
        else:
            flat[name] = _evaluate_value(context, name, value)
    return flat


def _evaluate_value(context: LaunchContext, name: str, value: Any) -> Any:
    """Return a parameter value with all substitutions expanded."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if value is None:
        raise TypeError(f"Parameter '{name}' is None, but must have a value")
    if isinstance(value, Substitution):
        return _evaluate_text(context, name, [value])
    if not isinstance(value, (list, tuple)):
        return value
    if any(isinstance(item, Substitution) for item in value):
        return _evaluate_text(context, name, value)
    return _evaluate_list(context, name, value)


def _evaluate_text(context: LaunchContext, name: str, value: Any) -> Any:
    """Return the YAML value of text with substitutions."""
    text = perform_substitutions(context, normalize_to_list_of_substitutions(value))
    try:
        result = coerce_to_type(text)
    except ValueError as error:
        raise TypeError(f"Parameter '{name}' is not a valid YAML value: {error}. If it is text, "
                        'use launch_ros.parameter_descriptions.ParameterValue(value, '
                        'value_type=str)') from None
    return tuple(result) if isinstance(result, list) else result


def _evaluate_list(context: LaunchContext, name: str, value: Any) -> tuple[Any, ...]:
    """Return a list of values as a tuple. An item that is a list is text with substitutions."""
    items = []
    for item in value:
        if isinstance(item, (list, tuple)):
            item = coerce_to_type(
                perform_substitutions(context, normalize_to_list_of_substitutions(item)))
        items.append(item)
    item_types = {type(item) for item in items}
    if item_types == {int, float}:
        return tuple(float(item) for item in items)
    if item_types not in ITEM_TYPES:
        raise TypeError(f"Parameter '{name}' is {value}, but all items of a list must have the "
                        'same type: bool, int, float or str')
    return tuple(items)
