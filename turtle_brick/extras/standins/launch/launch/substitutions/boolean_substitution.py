# SPDX-License-Identifier: Apache-2.0
"""The substitutions for boolean values, such as AndSubstitution."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
import sys

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.substitutions.substitution_failure import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import coerce_to_type


def evaluate_boolean(context: LaunchContext, expression: list[Substitution]) -> bool:
    """
    Return whether an expression is true.

    :raises SubstitutionFailure: if the expression is neither true nor false
    """
    try:
        value = coerce_to_type(perform_substitutions(context, expression), bool)
    except ValueError as error:
        raise SubstitutionFailure(error) from None
    return bool(value)


def to_text(value: bool) -> str:
    """Return the text `true` or `false`."""
    return str(value).lower()


@expose_substitution('not', least=1, most=1)
class NotSubstitution(Substitution):
    """The text `true` if a value is false."""

    def __init__(self, value: SomeSubstitutionsType) -> None:
        self.value = normalize_to_list_of_substitutions(value)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        (value,) = data
        return cls, {'value': value}

    def describe(self) -> str:
        return f'NotSubstitution({describe(self.value)})'

    def perform(self, context: LaunchContext) -> str:
        return to_text(not evaluate_boolean(context, self.value))


class _TwoValues(Substitution):
    """The base class of substitutions that combine two values."""

    def __init__(self, left: SomeSubstitutionsType, right: SomeSubstitutionsType) -> None:
        self.left = normalize_to_list_of_substitutions(left)
        self.right = normalize_to_list_of_substitutions(right)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        left, right = data
        return cls, {'left': left, 'right': right}

    def describe(self) -> str:
        return f'{type(self).__name__}({describe(self.left)}, {describe(self.right)})'


@expose_substitution('and', least=2, most=2)
class AndSubstitution(_TwoValues):
    """The text `true` if both values are true."""

    def perform(self, context: LaunchContext) -> str:
        values = [evaluate_boolean(context, side) for side in (self.left, self.right)]
        return to_text(all(values))


@expose_substitution('or', least=2, most=2)
class OrSubstitution(_TwoValues):
    """The text `true` if at least one of two values is true."""

    def perform(self, context: LaunchContext) -> str:
        values = [evaluate_boolean(context, side) for side in (self.left, self.right)]
        return to_text(any(values))


class _AnyNumberOfValues(Substitution):
    """The base class of substitutions that combine any number of values."""

    def __init__(self, *values: SomeSubstitutionsType) -> None:
        self.values = [normalize_to_list_of_substitutions(value) for value in values]

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        return partial(cls, *data), {}

    def describe(self) -> str:
        return f'{type(self).__name__}({", ".join(map(describe, self.values))})'


@expose_substitution('all', least=1, most=sys.maxsize)
class AllSubstitution(_AnyNumberOfValues):
    """The text `true` if all values are true."""

    def perform(self, context: LaunchContext) -> str:
        values = [evaluate_boolean(context, value) for value in self.values]
        return to_text(all(values))


@expose_substitution('any', least=1, most=sys.maxsize)
class AnySubstitution(_AnyNumberOfValues):
    """The text `true` if at least one value is true."""

    def perform(self, context: LaunchContext) -> str:
        values = [evaluate_boolean(context, value) for value in self.values]
        return to_text(any(values))
