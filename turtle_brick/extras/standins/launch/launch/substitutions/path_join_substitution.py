# SPDX-License-Identifier: Apache-2.0
"""The substitutions PathJoinSubstitution and PathSubstitution."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


class PathSubstitutionBase(Substitution):
    """The base class of paths to which the operator `/` appends a component."""

    def __truediv__(self, component: SomeSubstitutionsType) -> PathJoinSubstitution:
        return PathJoinSubstitution([self, component])


class PathJoinSubstitution(PathSubstitutionBase):
    """A path that consists of several components."""

    def __init__(self, substitutions: Iterable[SomeSubstitutionsType]) -> None:
        self.substitutions = [normalize_to_list_of_substitutions(component)
                              for component in substitutions]

    def __truediv__(self, component: SomeSubstitutionsType) -> PathJoinSubstitution:
        return PathJoinSubstitution([*self.substitutions, component])

    def describe(self) -> str:
        return f"PathJoinSubstitution('{', '.join(map(describe, self.substitutions))}')"

    def perform(self, context: LaunchContext) -> str:
        return str(Path(*(perform_substitutions(context, component)
                          for component in self.substitutions)))


class PathSubstitution(PathJoinSubstitution):
    """A path that consists of a single substitution or of a list of components."""

    def __init__(self, path: SomeSubstitutionsType) -> None:
        super().__init__(normalize_to_list_of_substitutions(path))
