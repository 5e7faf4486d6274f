# SPDX-License-Identifier: Apache-2.0
"""The names of actions and substitutions in XML and YAML launch files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

Exposed = TypeVar('Exposed', bound=type)

action_parse_methods: dict[str, Callable[..., Any]] = {}
"""Methods that parse actions, keyed by the name of the element."""

substitution_parse_methods: dict[str, Callable[..., Any]] = {}
"""Methods that parse substitutions, keyed by name."""


def expose_action(name: str) -> Callable[[Exposed], Exposed]:
    """Return a decorator that gives an action class a name in launch files."""
    def expose(action_class: Exposed) -> Exposed:
        action_parse_methods[name] = getattr(action_class, 'parse')
        return action_class
    return expose


def expose_substitution(name: str, least: int = 0, most: int = 0) -> Callable[[Exposed], Exposed]:
    """
    Return a decorator that gives a substitution class a name in launch files.

    :param least: smallest number of arguments
    :param most: largest number of arguments
    """
    expected = str(least) if least == most else f'{least} to {most}'

    def expose(substitution_class: Exposed) -> Exposed:
        def parse(data: Sequence[Any]) -> Any:
            if not least <= len(data) <= most:
                raise TypeError(f'Substitution $({name} ...) has {len(data)} arguments, but '
                                f'expects {expected}')
            return getattr(substitution_class, 'parse')(data)
        substitution_parse_methods[name] = parse
        return substitution_class
    return expose
