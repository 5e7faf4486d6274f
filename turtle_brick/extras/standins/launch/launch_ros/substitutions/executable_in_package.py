# SPDX-License-Identifier: Apache-2.0
"""The substitution ExecutableInPackage."""

from __future__ import annotations

from collections.abc import Sequence
import os
import shutil

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.substitutions.substitution_failure import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch_ros.substitutions.find_package import FindPackagePrefix


@expose_substitution('exec-in-pkg', least=2, most=2)
class ExecutableInPackage(Substitution):
    """The path of an executable in a package."""

    def __init__(self, executable: SomeSubstitutionsType, package: SomeSubstitutionsType) -> None:
        self.executable = normalize_to_list_of_substitutions(executable)
        self.package = normalize_to_list_of_substitutions(package)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        executable, package = data
        return cls, {'executable': executable, 'package': package}

    def describe(self) -> str:
        return f'ExecInPkg(pkg={describe(self.package)}, exec={describe(self.executable)})'

    def perform(self, context: LaunchContext) -> str:
        executable = perform_substitutions(context, self.executable)
        package = perform_substitutions(context, self.package)
        prefix = FindPackagePrefix(package).find(package)
        directory = os.path.join(prefix, 'lib', package)
        path = shutil.which(executable, path=directory)
        if path is None:
            raise SubstitutionFailure(
                f"executable '{executable}' not found on the libexec directory '{directory}'")
        return path
