# SPDX-License-Identifier: Apache-2.0
"""Functions that several actions and substitutions use."""

from __future__ import annotations

from collections.abc import Iterable
import os
from typing import Any

from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.missing import missing_name
from launch.some_entities_type import SomeEntitiesType
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import Substitution

__all__ = ['normalize_to_list_of_entities', 'normalize_to_list_of_substitutions',
           'perform_substitutions']
__getattr__ = missing_name('launch')


def normalize_to_list_of_entities(entities: SomeEntitiesType) -> list[LaunchDescriptionEntity]:
    """Return a list of one or more entities."""
    if isinstance(entities, LaunchDescriptionEntity):
        return [entities]
    return list(entities)


def normalize_to_list_of_substitutions(values: SomeSubstitutionsType) -> list[Substitution]:
    """
    Return a list of substitutions.

    :raises TypeError: if a value is not a string, a path or a substitution
    """
    if isinstance(values, (str, os.PathLike, Substitution)):
        return [_normalize(values)]
    if isinstance(values, Iterable):
        return [_normalize(value) for value in values]
    return [_normalize(values)]


def _normalize(value: Any) -> Substitution:
    # The module text_substitution imports this one.
    from launch.substitutions.text_substitution import TextSubstitution
    if isinstance(value, Substitution):
        return value
    if isinstance(value, (str, os.PathLike)):
        return TextSubstitution(text=os.fspath(value))
    raise TypeError(f'A string or a substitution is expected, but {value!r} is of type '
                    f'{type(value).__name__}')


def perform_substitutions(context: LaunchContext, subs: Iterable[Substitution]) -> str:
    """Return the joined texts of substitutions."""
    return ''.join(context.perform_substitution(sub) for sub in subs)
