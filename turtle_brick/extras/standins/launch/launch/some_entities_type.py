# SPDX-License-Identifier: Apache-2.0
"""The type of one or more entities."""

from collections.abc import Iterable
from typing import Union

from launch.launch_description_entity import LaunchDescriptionEntity

SomeEntitiesType = Union[LaunchDescriptionEntity, Iterable[LaunchDescriptionEntity]]
