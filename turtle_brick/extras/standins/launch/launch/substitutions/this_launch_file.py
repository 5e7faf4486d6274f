# SPDX-License-Identifier: Apache-2.0
"""The substitution ThisLaunchFile."""

from __future__ import annotations

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.substitution import Substitution
from launch.substitutions.substitution_failure import SubstitutionFailure


@expose_substitution('filename')
class ThisLaunchFile(Substitution):
    """The path of the current launch file."""

    def describe(self) -> str:
        return 'ThisLaunchFile()'

    def perform(self, context: LaunchContext) -> str:
        if not context.launch_file:
            raise SubstitutionFailure('ThisLaunchFile is only defined in a launch file')
        return context.launch_file
