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
"""The base class of substitutions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from launch.launch_context import LaunchContext

Parsed = tuple[Callable[..., 'Substitution'], dict[str, Any]]
"""The class of a substitution and its arguments."""


class Substitution:
    """A text that is known only while the launch runs. Subclasses override `perform`."""

    def perform(self, context: LaunchContext) -> str:
        """Return the text."""
        raise NotImplementedError(f'{type(self).__name__} does not override perform()')

    def describe(self) -> str:
        """Return the unexpanded form, which `ros2 launch -s` prints."""
        return f'{type(self).__name__}(...)'

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        """Return a class and its arguments for a substitution in an XML or YAML launch file."""
        return cls, {}


def describe(substitutions: Iterable[Substitution]) -> str:
    """Return the unexpanded form of a list of substitutions."""
    return ' + '.join(substitution.describe() for substitution in substitutions)
