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
"""The action ResetLaunchConfigurations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from launch.action import Action
from launch.frontend import Entity, expose_action, Parser
from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions


@expose_action('reset')
class ResetLaunchConfigurations(Action):
    """Removes all launch configurations except the given ones."""

    def __init__(self, launch_configurations: Mapping[Any, SomeSubstitutionsType] | None = None,
                 **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.launch_configurations = dict(launch_configurations or {})

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['launch_configurations'] = dict(parser.parse_pairs(entity, 'keep'))
        return cls, arguments

    def execute(self, context: LaunchContext) -> None:
        kept = {}
        for name, value in self.launch_configurations.items():
            name = perform_substitutions(context, normalize_to_list_of_substitutions(name))
            kept[name] = perform_substitutions(context, normalize_to_list_of_substitutions(value))
        context.launch_configurations = kept
