# SPDX-License-Identifier: Apache-2.0
"""The substitution ThisLaunchFileDir."""

from __future__ import annotations

import os

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.substitutions.path_join_substitution import PathSubstitutionBase
from launch.substitutions.substitution_failure import SubstitutionFailure


@expose_substitution('dirname')
class ThisLaunchFileDir(PathSubstitutionBase):
    """The directory of the current launch file."""

    def describe(self) -> str:
        return 'ThisLaunchFileDir()'

    def perform(self, context: LaunchContext) -> str:
        if not context.launch_file:
            raise SubstitutionFailure('ThisLaunchFileDir is only defined in a launch file')
        return os.path.dirname(context.launch_file)
