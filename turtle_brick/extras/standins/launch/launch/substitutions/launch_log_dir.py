# SPDX-License-Identifier: Apache-2.0
"""The substitution LaunchLogDir."""

from __future__ import annotations

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.logging import launch_config
from launch.substitutions.path_join_substitution import PathSubstitutionBase


@expose_substitution('launch_log_dir')
@expose_substitution('log_dir')
class LaunchLogDir(PathSubstitutionBase):
    """The log directory of this launch."""

    def describe(self) -> str:
        return 'LaunchLogDir()'

    def perform(self, context: LaunchContext) -> str:
        return launch_config.log_dir
