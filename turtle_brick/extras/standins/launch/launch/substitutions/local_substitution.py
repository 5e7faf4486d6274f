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
"""The substitution LocalSubstitution."""

from __future__ import annotations

from typing import Any

from launch.launch_context import LaunchContext
from launch.substitution import Substitution


class LocalSubstitution(Substitution):
    """A local value of the launch, such as `event.reason` in an event handler."""

    def __init__(self, expression: str, description: str = '') -> None:
        self.expression = expression
        self.description = description

    def describe(self) -> str:
        return f"LocalVar('{self.expression}')"

    def perform(self, context: LaunchContext) -> str:
        value: Any = context.locals
        for name in self.expression.split('.'):
            value = getattr(value, name)
        return str(value)
