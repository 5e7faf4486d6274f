# SPDX-License-Identifier: Apache-2.0
"""The parser of text with substitutions, such as '$(var name)/launch'."""

from __future__ import annotations

from functools import cache
import re
from typing import Any

from lark import Lark, Token, Transformer
from launch.frontend.expose import substitution_parse_methods
from launch.substitution import Substitution
from launch.substitutions.text_substitution import TextSubstitution


@cache
def get_parser() -> Lark:
    """Return the parser of the grammar in grammar.lark."""
    return Lark.open('grammar.lark', __file__, start='template')


def text_substitution(text: str) -> TextSubstitution:
    """Return a text in which a backslash has protected the character after it."""
    return TextSubstitution(text=re.sub(r'\\(.)', r'\1', text))


class ExtractSubstitution(Transformer):  # type: ignore[misc,type-arg,unused-ignore]
    """Converts syntax trees to substitutions."""

    def template(self, parts: list[Any]) -> list[Substitution]:
        """Convert the texts and substitutions in a template."""
        return [text_substitution(part) if isinstance(part, Token) else part for part in parts]

    value = template

    def substitution(self, parts: list[Any]) -> Substitution:
        """Convert a substitution with a name and arguments."""
        name, *arguments = parts
        if name not in substitution_parse_methods:
            raise RuntimeError(f'$({name} ...) is not a substitution. The stand-in for launch '
                               f'supports {", ".join(sorted(substitution_parse_methods))}')
        substitution_class, kwargs = substitution_parse_methods[name](arguments)
        return substitution_class(**kwargs)


def parse_substitution(value: str) -> list[Substitution]:
    """Convert text to a list of substitutions."""
    if '$(' not in value:
        return [text_substitution(value)]
    return ExtractSubstitution().transform(get_parser().parse(value))
