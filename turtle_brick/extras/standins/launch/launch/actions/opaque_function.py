# SPDX-License-Identifier: Apache-2.0
"""The action OpaqueFunction."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from launch.action import Action
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity


class OpaqueFunction(Action):
    """Calls a function with the launch context, and executes the entities that it returns."""

    def __init__(self, *, function: Callable[..., Iterable[LaunchDescriptionEntity] | None],
                 args: Iterable[Any] = (), kwargs: Mapping[str, Any] | None = None,
                 **left_over: Any) -> None:
        super().__init__(**left_over)
        self.function = function
        self.args = list(args)
        self.kwargs = dict(kwargs or {})

    def execute(self, context: LaunchContext) -> Iterable[LaunchDescriptionEntity] | None:
        return self.function(context, *self.args, **self.kwargs)
