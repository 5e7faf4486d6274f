# SPDX-License-Identifier: Apache-2.0
"""Parameter values and parameter files."""

from __future__ import annotations

from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from launch.frontend.parse_substitution import parse_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import coerce_to_type, perform_typed_substitution


class ParameterValue:
    """A parameter value. Text is converted to `value_type`, or to its YAML type."""

    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value = value
        self.value_type = value_type

    def evaluate(self, context: LaunchContext) -> Any:
        """Return the value with all substitutions expanded."""
        value = self.value
        if isinstance(value, (str, Substitution)):
            return self._convert(context, value, self.value_type)
        if not isinstance(value, list):
            return value
        if any(isinstance(item, Substitution) for item in value):
            return self._convert(context, value, self.value_type)
        # An item that is a list is text with substitutions.
        return [self._convert(context, item, None) if isinstance(item, list) else item
                for item in value]

    def _convert(self, context: LaunchContext, value: SomeSubstitutionsType,
                 value_type: Any) -> Any:
        text = perform_substitutions(context, normalize_to_list_of_substitutions(value))
        return coerce_to_type(text, value_type)


class ParameterFile:
    """A parameter file, which may contain substitutions if `allow_substs` is true."""

    def __init__(self, param_file: SomeSubstitutionsType, *,
                 allow_substs: bool | SomeSubstitutionsType = False) -> None:
        self.param_file = normalize_to_list_of_substitutions(param_file)
        self.allow_substs = allow_substs

    def evaluate(self, context: LaunchContext) -> str:
        """Return the path of the file, or of a copy in which all substitutions are expanded."""
        path = perform_substitutions(context, self.param_file)
        if not perform_typed_substitution(context, self.allow_substs, bool):
            return path
        text = Path(path).read_text(encoding='utf-8')
        with NamedTemporaryFile('w', encoding='utf-8', prefix='launch_params_',
                                delete=False) as file:
            file.write(perform_substitutions(context, parse_substitution(text)))
        return file.name
