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
"""The substitution PythonExpression."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
import math
from typing import Any

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_substitution('eval', least=1, most=2)
class PythonExpression(Substitution):
    """The value of a Python expression, which may use the given modules."""

    def __init__(self, expression: SomeSubstitutionsType,
                 python_modules: SomeSubstitutionsType = ('math',)) -> None:
        self.expression = normalize_to_list_of_substitutions(expression)
        self.python_modules = normalize_to_list_of_substitutions(python_modules)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        expression, *modules = data
        return cls, {'expression': expression, **(
            {'python_modules': modules[0]} if modules else {})}

    def describe(self) -> str:
        return f'PythonExpr({describe(self.expression)}, [{describe(self.python_modules)}])'

    def perform(self, context: LaunchContext) -> str:
        names: dict[str, Any] = {}
        for part in self.python_modules:
            for name in context.perform_substitution(part).split(','):
                names[name.strip()] = importlib.import_module(name.strip())
        if 'math' in names:
            names = {**vars(math), **names}
        return str(eval(perform_substitutions(context, self.expression), {}, names))
