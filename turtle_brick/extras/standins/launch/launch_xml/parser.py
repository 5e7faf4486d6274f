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
