# SPDX-License-Identifier: Apache-2.0
"""The substitution FindExecutable."""

from __future__ import annotations

from collections.abc import Sequence
import shutil

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.substitutions.substitution_failure import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_substitution('find-exec', least=1, most=1)
class FindExecutable(Substitution):
    """The path of a program on the PATH."""

    def __init__(self, *, name: SomeSubstitutionsType) -> None:
        self.name = normalize_to_list_of_substitutions(name)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        (name,) = data
        return cls, {'name': name}

    def describe(self) -> str:
        return f'FindExec({describe(self.name)})'

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.name)
        path = shutil.which(name)
        if path is None:
            raise SubstitutionFailure(f"executable '{name}' not found on the PATH")
        return path
