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
