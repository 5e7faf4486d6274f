# SPDX-License-Identifier: Apache-2.0
"""The type of arguments that may contain substitutions."""

from collections.abc import Iterable
from os import PathLike
from typing import Union

from launch.substitution import Substitution

SomeSubstitutionsType = Union[
    str, 'PathLike[str]', Substitution, Iterable[Union[str, 'PathLike[str]', Substitution]]]
