# SPDX-License-Identifier: Apache-2.0
"""The base class of the parsers of XML and YAML launch files."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
import re
from typing import Any, List, TYPE_CHECKING

from launch.frontend.entity import Entity
from launch.frontend.expose import action_parse_methods
from launch.frontend.parse_substitution import parse_substitution
from launch.invalid_launch_file_error import InvalidLaunchFileError
from launch.substitution import Substitution

if TYPE_CHECKING:
    from launch.action import Action
    from launch.launch_description import LaunchDescription


class InvalidFrontendLaunchFileError(InvalidLaunchFileError):
    """Raised when a file is not valid XML or YAML."""


@cache
def load_launch_extensions() -> None:
    """Import the packages that add actions, such as launch_ros."""
    for extension in entry_points(group='launch.frontend.launch_extension'):
        extension.load()


class Parser:
    """A parser that converts the entities in a launch file to actions."""

    @classmethod
    def get_file_extensions(cls) -> list[str]:
        """Return the file name extensions of the format, such as `xml`."""
        raise NotImplementedError

    @classmethod
    def load(cls, path: str) -> tuple[Entity, Parser]:
        """
        Read a file, and return its root entity and a parser.

        :raises InvalidFrontendLaunchFileError: if the file does not have the format
        """
        raise NotImplementedError

    @staticmethod
    @cache
    def get_parsers_from_entry_points() -> dict[str, type[Parser]]:
        """Return the installed parsers, keyed by format."""
        return {entry.name: entry.load() for entry in entry_points(group='launch.frontend.parser')}

    def parse_description(self, entity: Entity) -> LaunchDescription:
        """Convert the root entity of a launch file to a launch description."""
        from launch.launch_description import LaunchDescription

        if entity.type_name != 'launch':
            raise RuntimeError(
                f"The root of the launch file is '{entity.type_name}', but must be 'launch'")
        load_launch_extensions()
        return LaunchDescription([self.parse_action(child) for child in entity.children])

    def parse_action(self, entity: Entity) -> Action:
        """Convert an entity to an action."""
        if entity.type_name not in action_parse_methods:
            raise RuntimeError(f"'{entity.type_name}' is not an action. The stand-in for launch "
                               f'supports {", ".join(sorted(action_parse_methods))}')
        action_class, arguments = action_parse_methods[entity.type_name](entity, self)
        entity.assert_entity_completely_parsed()
        return action_class(**arguments)

    def parse_substitution(self, value: str) -> list[Substitution]:
        """Convert text such as '$(var name)' to a list of substitutions."""
        return parse_substitution(value)

    def parse_optional(self, value: Any) -> Any:
        """Convert text to a list of substitutions, and return all other values unchanged."""
        return parse_substitution(value) if isinstance(value, str) else value

    def parse_pairs(self, entity: Entity, nested: str, first: str = 'name', second: str = 'value'
                    ) -> list[tuple[tuple[Substitution, ...], list[Substitution]]]:
        """
        Convert two attributes of each nested entity to pairs of substitutions.

        :param nested: name of the nested entities, such as `env`
        :param first: attribute that becomes the first item of a pair
        :param second: attribute that becomes the second item of a pair
        """
        pairs = []
        for child in entity.get_attr(nested, data_type=List[Entity], optional=True) or []:
            pairs.append((tuple(parse_substitution(child.get_attr(first))),
                          parse_substitution(child.get_attr(second))))
            child.assert_entity_completely_parsed()
        return pairs

    def escape_characters(self, value: str) -> str:
        """Replace each character with a backslash in front of it by the character."""
        return re.sub(r'\\(.)', r'\1', value)
