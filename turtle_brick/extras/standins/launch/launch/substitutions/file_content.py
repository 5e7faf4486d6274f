# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
