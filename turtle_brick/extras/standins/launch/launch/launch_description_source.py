# SPDX-License-Identifier: Apache-2.0
"""The base class of launch description sources."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

if TYPE_CHECKING:
    from launch.launch_description import LaunchDescription


class LaunchDescriptionSource:
    """A launch file whose path may contain substitutions."""

    def __init__(self, location: SomeSubstitutionsType) -> None:
        self.path = normalize_to_list_of_substitutions(location)
        self.location = ''

    def read(self, path: str) -> LaunchDescription:
        """Read a launch file."""
        raise NotImplementedError

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """Expand the path, and read the launch file."""
        self.location = perform_substitutions(context, self.path)
        return self.read(self.location)

    def try_get_launch_description_without_context(self) -> LaunchDescription | None:
        """Read the launch file, or return None if that fails outside of a launch."""
        with suppress(Exception):  # The path may depend on unset launch configurations.
            return self.get_launch_description(LaunchContext())
        return None
