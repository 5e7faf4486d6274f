# SPDX-License-Identifier: Apache-2.0
"""The base classes of event handlers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Union

from launch.event import Event
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.some_entities_type import SomeEntitiesType
from launch.utilities import normalize_to_list_of_entities

Reaction = Union[SomeEntitiesType, Callable[..., Any]]
"""Entities, or a function that receives an event and a context and returns entities."""


class BaseEventHandler:
    """The base class of all event handlers."""

    def __init__(self, *, matcher: Callable[[Any], bool], handle_once: bool = False) -> None:
        self.matcher = matcher
        self.handle_once = handle_once

    def matches(self, event: Event) -> bool:
        """Return whether this handler handles an event."""
        return self.matcher(event)

    def handle(self, event: Event, context: LaunchContext) -> Iterable[LaunchDescriptionEntity]:
        """Handle an event, and return the entities to execute."""
        return []


class EventHandler(BaseEventHandler):
    """An event handler with a function that decides which events it handles."""

    def __init__(self, *, matcher: Callable[[Any], bool], entities: Reaction | None = None,
                 handle_once: bool = False) -> None:
        super().__init__(matcher=matcher, handle_once=handle_once)
        self.entities = entities

    def handle(self, event: Event, context: LaunchContext) -> Iterable[LaunchDescriptionEntity]:
        entities = self.entities
        return to_entities(entities(event, context) if callable(entities) else entities)


def to_entities(result: SomeEntitiesType | None) -> list[LaunchDescriptionEntity]:
    """Return the list of the entities that a function has returned."""
    return [] if result is None else normalize_to_list_of_entities(result)
