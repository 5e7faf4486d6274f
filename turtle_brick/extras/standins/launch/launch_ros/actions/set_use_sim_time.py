# SPDX-License-Identifier: Apache-2.0
"""The action SetUseSimTime."""

from __future__ import annotations

from typing import Any

from launch import Action
from launch.frontend import Entity, expose_action, Parser


@expose_action('set_use_sim_time')
class SetUseSimTime(Action):
    """Sets the clock of the node of the launch, which the stand-in does not have."""

    def __init__(self, value: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.value = value

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['value'] = parser.parse_substitution(entity.get_attr('value'))
        return cls, arguments
