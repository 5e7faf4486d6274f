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
