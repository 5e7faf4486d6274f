# SPDX-License-Identifier: Apache-2.0
"""The explanation of names that the stand-ins do not provide."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn


def missing_name(package: str) -> Callable[[str], NoReturn]:
    """Return a module-level __getattr__ that reports a missing name of a stand-in."""
    def __getattr__(name: str) -> NoReturn:
        kind = ImportError if name[:1].isupper() else AttributeError
        raise kind(f'{name} is not in the stand-in for {package}: check its spelling, use another '
                   'feature, or install the real ROS 2 Jazzy')
    return __getattr__
