# SPDX-License-Identifier: Apache-2.0
"""The substitution EqualsSubstitution."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.substitution import describe, Parsed, Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

BOOLEANS = {'true': True, '1': True, 'false': False, '0': False}


@expose_substitution('equals', least=2, most=2)
class EqualsSubstitution(Substitution):
    """The text `true` if two values are equal as booleans, numbers or text."""

    def __init__(self, left: Any, right: Any) -> None:
        self.left = _normalize(left)
        self.right = _normalize(right)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        left, right = data
        return cls, {'left': left, 'right': right}

    def describe(self) -> str:
        return f'{type(self).__name__}({describe(self.left)}, {describe(self.right)})'

    def perform(self, context: LaunchContext) -> str:
        return str(self.is_equal(context)).lower()

    def is_equal(self, context: LaunchContext) -> bool:
        """Return whether the values are equal."""
        left = perform_substitutions(context, self.left)
        right = perform_substitutions(context, self.right)
        if left.lower() in BOOLEANS and right.lower() in BOOLEANS:
            return BOOLEANS[left.lower()] == BOOLEANS[right.lower()]
        try:
            return math.isclose(float(left), float(right))
        except ValueError:
            return left == right


def _normalize(value: Any) -> list[Substitution]:
    """Convert any value, such as a number, to a list of substitutions."""
    if isinstance(value, Substitution):
        return [value]
    if isinstance(value, (list, tuple)) and any(isinstance(part, Substitution) for part in value):
        return normalize_to_list_of_substitutions(value)
    return normalize_to_list_of_substitutions('' if value is None else str(value))
