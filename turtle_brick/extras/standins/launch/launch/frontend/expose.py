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
