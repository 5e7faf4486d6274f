# SPDX-License-Identifier: Apache-2.0
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
