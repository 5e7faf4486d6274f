# SPDX-License-Identifier: Apache-2.0
"""The substitution TextSubstitution."""

from __future__ import annotations

from launch.launch_context import LaunchContext
from launch.substitution import Substitution


class TextSubstitution(Substitution):
    """A text without any variable part."""

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f'TextSubstitution requires text of type str, but {text!r} is of type '
                            f'{type(text).__name__}')
        self.text = text

    def describe(self) -> str:
        return f"'{self.text}'"

    def perform(self, context: LaunchContext) -> str:
        return self.text
