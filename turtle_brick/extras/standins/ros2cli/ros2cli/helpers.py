# SPDX-License-Identifier: Apache-2.0
"""Functions for the arguments and the output of several verbs."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
import sys
from typing import Any, NoReturn


def positive_float(text: str) -> float:
    """Convert an argument to a positive number."""
    value = float(text)
    if not value > 0.0:
        raise argparse.ArgumentTypeError('Value must be positive')
    return value


class Unsupported(argparse.Action):
    """An option that ends the command with an error because the stand-in lacks it."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace,
                 values: Any, option_string: str | None = None) -> NoReturn:
        sys.exit(f'this stand-in for ros2cli does not support {parser.prog} {option_string}')


def complete_with(argument: argparse.Action, completer: Callable[..., list[str]]) -> None:
    """Set the function that returns the completions of an argument after the Tab key."""
    setattr(argument, 'completer', completer)


def print_names(entities: Mapping[str, Sequence[str]], only_count: bool,
                show_types: bool = False) -> None:
    """Print the number of entities, or the name of each one and optionally its types."""
    if only_count:
        print(len(entities))
        return
    for name, types in entities.items():
        print(f'{name} [{", ".join(types)}]' if show_types else name)
