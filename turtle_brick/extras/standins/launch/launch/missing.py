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
