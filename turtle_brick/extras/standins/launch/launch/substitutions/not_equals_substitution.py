# SPDX-License-Identifier: Apache-2.0
"""The substitution NotEqualsSubstitution."""

from __future__ import annotations

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.substitutions.equals_substitution import EqualsSubstitution


@expose_substitution('not-equals', least=2, most=2)
class NotEqualsSubstitution(EqualsSubstitution):
    """The text `true` if two values differ as booleans, numbers or text."""

    def is_equal(self, context: LaunchContext) -> bool:
        return not super().is_equal(context)
