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
"""Types of command-line arguments."""

from __future__ import annotations

import argparse
from collections.abc import Callable
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
