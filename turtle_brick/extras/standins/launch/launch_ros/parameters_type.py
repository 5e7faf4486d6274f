# SPDX-License-Identifier: Apache-2.0
"""The types of the parameters of a node."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import os
from typing import Any, Union

from launch.some_substitutions_type import SomeSubstitutionsType
from launch_ros.parameter_descriptions import ParameterFile

ParametersDict = Mapping[Any, Any]
"""Values or further dictionaries, keyed by parameter name."""

SomeParameters = Sequence[Union[
    SomeSubstitutionsType, 'os.PathLike[str]', ParameterFile, ParametersDict]]
"""Parameter files and dictionaries of parameters."""
