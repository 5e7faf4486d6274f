# SPDX-License-Identifier: Apache-2.0
"""The parser of YAML launch files."""

from __future__ import annotations

from pathlib import Path

from launch import frontend
from launch_yaml.entity import Entity
import yaml


class Parser(frontend.Parser):
    """A parser that converts the entities in a YAML launch file to actions."""

    @classmethod
    def get_file_extensions(cls) -> list[str]:
        return ['yaml', 'yml']

    @classmethod
    def load(cls, path: str) -> tuple[Entity, Parser]:
        try:
            tree = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
        except yaml.YAMLError as error:
            raise frontend.InvalidFrontendLaunchFileError(
                f"'{path}' is not valid YAML: {error}") from None
        if not isinstance(tree, dict) or len(tree) != 1:
            raise frontend.InvalidFrontendLaunchFileError(
                f"'{path}' must have exactly one root, which is 'launch'")
        ((type_name, content),) = tree.items()
        return Entity(content, type_name), cls()
