# SPDX-License-Identifier: Apache-2.0
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
