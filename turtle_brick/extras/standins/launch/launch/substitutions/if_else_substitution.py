# SPDX-License-Identifier: Apache-2.0
"""The substitution IfElseSubstitution."""

from __future__ import annotations

from collections.abc import Sequence

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.substitutions.boolean_substitution import evaluate_boolean
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_substitution('if', least=2, most=3)
class IfElseSubstitution(Substitution):
    """One of two texts, depending on a condition."""

    def __init__(self, condition: SomeSubstitutionsType, if_value: SomeSubstitutionsType = '',
                 else_value: SomeSubstitutionsType = '') -> None:
        if if_value == else_value == '':
            raise RuntimeError('IfElseSubstitution requires if_value or else_value')
        self.condition = normalize_to_list_of_substitutions(condition)
        self.if_value = normalize_to_list_of_substitutions(if_value)
        self.else_value = normalize_to_list_of_substitutions(else_value)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        return cls, dict(zip(('condition', 'if_value', 'else_value'), data))

    def describe(self) -> str:
        parts = (self.condition, self.if_value, self.else_value)
        return f'IfElseSubstitution({", ".join(map(describe, parts))})'

    def perform(self, context: LaunchContext) -> str:
        is_true = evaluate_boolean(context, self.condition)
        return perform_substitutions(context, self.if_value if is_true else self.else_value)
