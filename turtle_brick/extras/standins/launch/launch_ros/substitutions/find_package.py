# SPDX-License-Identifier: Apache-2.0
"""The substitutions FindPackagePrefix and FindPackageShare."""

from __future__ import annotations

from collections.abc import Sequence

import ament_index_python
from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.substitutions.path_join_substitution import PathSubstitutionBase
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


class FindPackage(PathSubstitutionBase):
    """The base class of substitutions that return a package directory."""

    def __init__(self, package: SomeSubstitutionsType) -> None:
        self.package = normalize_to_list_of_substitutions(package)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        (package,) = data
        return cls, {'package': package}

    def describe(self) -> str:
        return f'{type(self).__name__}(pkg={describe(self.package)})'

    def get_directory(self, package_name: str) -> str:
        """Return the directory of an installed package."""
        raise NotImplementedError

    def find(self, package_name: str) -> str:
        """
        Return the directory of a package.

        :raises PackageNotFoundError: if the package is not installed; the message says so if the
            environment lacks a package of ROS 2
        """
        try:
            return self.get_directory(package_name)
        except ament_index_python.PackageNotFoundError:
            if package_name not in ament_index_python.get_resources('absent_packages'):
                raise
            reason, _ = ament_index_python.get_resource('absent_packages', package_name)
            raise ament_index_python.PackageNotFoundError(reason) from None

    def perform(self, context: LaunchContext) -> str:
        return self.find(perform_substitutions(context, self.package))


@expose_substitution('find-pkg-prefix', least=1, most=1)
class FindPackagePrefix(FindPackage):
    """The directory in which a package is installed."""

    def get_directory(self, package_name: str) -> str:
        return ament_index_python.get_package_prefix(package_name)


@expose_substitution('find-pkg-share', least=1, most=1)
class FindPackageShare(FindPackage):
    """The share directory of a package."""

    def get_directory(self, package_name: str) -> str:
        return ament_index_python.get_package_share_directory(package_name)
