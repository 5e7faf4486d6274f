# SPDX-License-Identifier: Apache-2.0
"""The substitution FileContent."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_substitution('file-content', least=1, most=1)
class FileContent(Substitution):
    """The text in a file."""

    def __init__(self, path: SomeSubstitutionsType) -> None:
        self.path = normalize_to_list_of_substitutions(path)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        (path,) = data
        return cls, {'path': path}

    def describe(self) -> str:
        return f'FileContent({describe(self.path)})'

    def perform(self, context: LaunchContext) -> str:
        return Path(perform_substitutions(context, self.path)).read_text(encoding='utf-8')
