# SPDX-License-Identifier: Apache-2.0
"""The substitution AnonName."""

from __future__ import annotations

from collections.abc import Sequence
import os
import random
import re
import socket
import sys

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_substitution('anon', least=1, most=1)
class AnonName(Substitution):
    """A unique name that begins with a given text and is the same throughout a launch."""

    def __init__(self, name: SomeSubstitutionsType) -> None:
        self.name = normalize_to_list_of_substitutions(name)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        (name,) = data
        return cls, {'name': name}

    def describe(self) -> str:
        return f'AnonName({describe(self.name)})'

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.name)
        unique = f'{name}_{socket.gethostname()}_{os.getpid()}_{random.randint(0, sys.maxsize)}'
        return context.launch_configurations.setdefault(
            f'anon{name}', re.sub('[-.:]', '_', unique))
