# SPDX-License-Identifier: Apache-2.0
"""The evaluation of the expression of a condition."""

from __future__ import annotations

from collections.abc import Iterable

from launch.conditions.invalid_condition_expression_error import InvalidConditionExpressionError
from launch.launch_context import LaunchContext
from launch.substitution import Substitution
from launch.utilities import perform_substitutions

TRUE = ('true', '1')
FALSE = ('false', '0')


def evaluate_condition_expression(
        context: LaunchContext, expression: Iterable[Substitution]) -> bool:
    """
    Return whether an expression is true.

    :raises InvalidConditionExpressionError: if the expression is not true, false, 1 or 0
    """
    parts = list(expression)
    value = perform_substitutions(context, parts).strip().lower()
    if value not in TRUE + FALSE:
        text = ' + '.join(part.describe() for part in parts)
        raise InvalidConditionExpressionError(
            f"The condition {text} is '{value}', but must be one of {', '.join(TRUE + FALSE)}")
    return value in TRUE
