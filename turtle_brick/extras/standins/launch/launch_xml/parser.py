# SPDX-License-Identifier: Apache-2.0
"""The parser of XML launch files."""

from __future__ import annotations

from xml.etree import ElementTree

from launch import frontend
from launch_xml.entity import Entity


class Parser(frontend.Parser):
    """A parser that converts the elements of an XML launch file to actions."""

    @classmethod
    def get_file_extensions(cls) -> list[str]:
        return ['xml', 'launch']

    @classmethod
    def load(cls, path: str) -> tuple[Entity, Parser]:
        try:
            return Entity(ElementTree.parse(path).getroot()), cls()
        except ElementTree.ParseError as error:
            raise frontend.InvalidFrontendLaunchFileError(
                f"'{path}' is not valid XML: {error}") from None
