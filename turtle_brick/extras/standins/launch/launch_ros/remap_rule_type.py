# SPDX-License-Identifier: Apache-2.0
"""The types of remapping rules."""

from __future__ import annotations

from collections.abc import Iterable

from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import Substitution

SomeRemapRule = tuple[SomeSubstitutionsType, SomeSubstitutionsType]
"""A name and the name that replaces it."""

SomeRemapRules = Iterable[SomeRemapRule]
RemapRule = tuple[list[Substitution], list[Substitution]]
