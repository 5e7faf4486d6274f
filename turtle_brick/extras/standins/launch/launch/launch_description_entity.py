# SPDX-License-Identifier: Apache-2.0
"""The base class of actions and launch descriptions."""

from __future__ import annotations

from asyncio import Future
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from launch.condition import Condition
    from launch.launch_context import LaunchContext


class LaunchDescriptionEntity:
    """Something that a launch executes."""

    condition: Condition | None = None
    """Condition without which the entity is not executed."""

    def execute(self, context: LaunchContext) -> Iterable[LaunchDescriptionEntity] | None:
        """Execute the entity, and return the entities to execute next."""
        return None

    def visit(self, context: LaunchContext) -> None:
        """Execute the entity and the entities that it returns, unless its condition is false."""
        if self.condition is None or self.condition.evaluate(context):
            for entity in self.execute(context) or ():
                entity.visit(context)
            context.announce_completion(self)

    def get_asyncio_future(self) -> Future[None] | None:
        """Return a future that is done when the entity has ended, or None if it has ended."""
        return None

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the entities that this one may execute, as far as they are known."""
        return []
