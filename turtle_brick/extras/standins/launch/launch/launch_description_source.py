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
